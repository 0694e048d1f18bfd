#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::host {

struct RenderStudyOptions {
  std::filesystem::path pictures;  ///< a folder for a picture of each level, cut open; empty for none
  std::filesystem::path scene;  ///< a folder for the 256x256x64 liver and its scene, for other programs; empty for none
  std::vector<std::string> engines{"cpu"};
  int frames = 15;     ///< a row
  int threads = 0;     ///< 0: all cores
  bool large = false;  ///< also 512x512x128 voxels at 0.5 mm
  std::vector<int> levels{0, 1, 2, 3, 4, 5};
  std::vector<std::string> phantoms{"liver", "torso"};
};

/// Is told each row of the table once it is measured: a long study is watched.
using TellRow = std::function<void(const nlohmann::json& row)>;

/// `birdseye bench render`: times each engine on phantoms at each level of deformation, with and without pruning, and
/// compares its pictures with the reference renderer's. Gives the table (rows), the machine, and a verdict with
/// reasons: pictures and memory are judged, times are not. Makes the folders that it writes into.
Result<nlohmann::json> render_study(const RenderStudyOptions& options, const TellRow& tell);

}  // namespace birdseye::host
