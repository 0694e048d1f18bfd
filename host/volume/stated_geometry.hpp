#pragma once

#include <filesystem>
#include <string>

namespace birdseye::host {

/// What a NRRD's or MetaImage's header lacks to say where its voxels lie, with the remedy; empty where it says so, and
/// of any other file. Their readers fill in what is missing, unseen: voxels of 1 mm, axes as the patient's.
std::string unstated_geometry(const std::filesystem::path& path);

}  // namespace birdseye::host
