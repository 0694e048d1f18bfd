#pragma once

#include <functional>
#include <string>

namespace birdseye::host {

/// The text in lines that are no wider than that, broken at spaces alone: ImGui breaks after a full stop too, and so
/// takes "0.1 mm" apart. A word that is wider stays whole.
std::string broken_at_spaces(const std::string& text, float wide,
                             const std::function<float(const std::string&)>& width_of);

}  // namespace birdseye::host
