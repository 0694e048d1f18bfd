#include "host/case/true_deformation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <sstream>

#include "drivers/system/json_file.hpp"
#include "drivers/system/whole_file.hpp"

namespace birdseye::host {

Result<std::vector<Landmark>> read_landmarks(const std::filesystem::path& path) {
  const auto text = read_whole_file(path, kMostTextBytes);
  if (!text) return text.error();
  std::vector<Landmark> landmarks;
  std::istringstream in(*text);
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (number == 1 && line.rfind("name", 0) == 0) continue;
    if (line.empty()) continue;
    Landmark landmark;
    std::istringstream fields(line);
    std::getline(fields, landmark.name, ',');
    std::string rest;
    std::getline(fields, rest);
    std::replace(rest.begin(), rest.end(), ',', ' ');
    std::istringstream numbers(rest);
    for (int i = 0; i < 3; ++i) numbers >> landmark.rest_mm[i];
    for (int i = 0; i < 3; ++i) numbers >> landmark.deformed_mm[i];
    if (!numbers || !landmark.rest_mm.allFinite() || !landmark.deformed_mm.allFinite()) {
      return Error{Errc::bad_format,
                   fmt::format("{}: line {}: a name and six numbers are needed", path.string(), number)};
    }
    landmarks.push_back(std::move(landmark));
  }
  return landmarks;
}

Result<TrueDeformation> read_true_deformation(const std::filesystem::path& path) {
  const auto wrong = [&](const std::string& why) {
    return Error{Errc::bad_format,
                 fmt::format("{}: {}; name the control_points.json of birdseye-sim case", path.string(), why)};
  };
  try {
    const auto read = read_json_file(path);
    if (!read) return read.error();
    const nlohmann::json& json = *read;
    const auto low = json.at("box_low_mm").get<std::array<double, 3>>();
    const auto high = json.at("box_high_mm").get<std::array<double, 3>>();
    auto patch = BezierPatch::create(json.at("degree").get<std::array<int, 3>>());
    if (!patch) return wrong(patch.error().what);
    TrueDeformation out{Eigen::Vector3d(low.data()), Eigen::Vector3d(high.data()) - Eigen::Vector3d(low.data()),
                        *std::move(patch)};
    if (!(out.box_mm.minCoeff() > 0)) return wrong("has a box of no size");
    std::vector<Eigen::Vector3d> moves;
    for (const auto& point : json.at("displacement_mm")) {
      const auto move_mm = point.get<std::array<double, 3>>();
      moves.emplace_back(Eigen::Vector3d(move_mm.data()).cwiseQuotient(out.box_mm));
    }
    if (moves.size() != out.patch.free_points()) {
      return wrong(
          fmt::format("has {} displacements for {} inner control points", moves.size(), out.patch.free_points()));
    }
    out.patch.set_displacements(moves);
    return out;
  } catch (const nlohmann::json::exception&) {
    return wrong(kPartMissing);
  }
}

double epsilon(const TrueDeformation& truth, const DisplacementField* field) {
  constexpr int kLevel = 3;
  const PatchOctree tree = *PatchOctree::uniform(kLevel);
  double sum = 0;
  for (std::size_t i = 0; i < tree.free_vertices(); ++i) {
    const Eigen::Vector3d x = tree.vertex(i);
    Eigen::Vector3d rest = truth.patch.displacement(x);
    if (field != nullptr)
      rest -= field->displacement(truth.low_mm + x.cwiseProduct(truth.box_mm)).cwiseQuotient(truth.box_mm);
    sum += rest.squaredNorm();
  }
  return sum;
}

}  // namespace birdseye::host
