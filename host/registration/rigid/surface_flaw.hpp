#pragma once

#include <filesystem>
#include <string>

namespace birdseye::host {

/// What is wrong with a surface's file that its decoder would not say: that it is cut short, of which the decoder makes
/// a smaller surface, or has a coordinate that the decoder takes for another. Words that go on from its name; empty
/// where nothing is, or where the decoder finds it. Of VTK's legacy polygons, PLY, STL and OBJ. Parses in this process.
std::string flaw_of_surface(const std::filesystem::path& path);

}  // namespace birdseye::host
