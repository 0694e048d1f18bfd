#include "calibration/record/field_map_json.hpp"

#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace birdseye::calibration {

namespace {

std::vector<std::vector<double>> numbers_of(const std::vector<Eigen::Vector3d>& vectors) {
  std::vector<std::vector<double>> out;
  out.reserve(vectors.size());
  for (const Eigen::Vector3d& v : vectors) out.push_back({v.x(), v.y(), v.z()});
  return out;
}

Eigen::Vector3d triple_of(const nlohmann::json& json) {
  if (json.size() != 3) throw std::invalid_argument("three numbers are needed for a vector");
  return {json[0].get<double>(), json[1].get<double>(), json[2].get<double>()};
}

std::vector<Eigen::Vector3d> triples_of(const nlohmann::json& json) {
  std::vector<Eigen::Vector3d> out;
  for (const nlohmann::json& one : json) out.push_back(triple_of(one));
  return out;
}

}  // namespace

void to_json(nlohmann::json& json, const FieldMapData& data) {
  const FieldFunctions& f = data.functions;
  json = {{"kind", name_of(f.basis)},
          {"order", f.order},
          {"box_mm", numbers_of({f.low_mm, f.high_mm})},
          {"centres_mm", numbers_of(f.centres_mm)},
          {"position_mm", numbers_of(data.position_mm)},
          {"rotation_rad", numbers_of(data.rotation_rad)},
          {"sigma_mm", data.sigma_mm}};
}

void from_json(const nlohmann::json& json, FieldMapData& data) {
  const auto basis = field_basis_of(json.at("kind").get<std::string>());
  if (!basis) throw std::invalid_argument("a kind of map that is unknown");
  data.functions.basis = *basis;
  json.at("order").get_to(data.functions.order);
  const nlohmann::json& box = json.at("box_mm");
  if (box.size() != 2) throw std::invalid_argument("a box has two corners");
  data.functions.low_mm = triple_of(box[0]);
  data.functions.high_mm = triple_of(box[1]);
  data.functions.centres_mm = triples_of(json.at("centres_mm"));
  data.position_mm = triples_of(json.at("position_mm"));
  data.rotation_rad = triples_of(json.at("rotation_rad"));
  json.at("sigma_mm").get_to(data.sigma_mm);
}

}  // namespace birdseye::calibration
