#pragma once

#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "calibration/geometry/field_map.hpp"

/// A map of the field as JSON, exactly: what is read back is the same map to the bit.
namespace birdseye::calibration {

namespace field_json {

inline std::vector<std::vector<double>> rows(const std::vector<Eigen::Vector3d>& vectors) {
  std::vector<std::vector<double>> out;
  out.reserve(vectors.size());
  for (const Eigen::Vector3d& v : vectors) out.push_back({v.x(), v.y(), v.z()});
  return out;
}

inline Eigen::Vector3d vector(const nlohmann::json& json) {
  if (json.size() != 3) throw std::invalid_argument("three numbers are needed for a vector");
  return {json[0].get<double>(), json[1].get<double>(), json[2].get<double>()};
}

inline std::vector<Eigen::Vector3d> vectors(const nlohmann::json& json) {
  std::vector<Eigen::Vector3d> out;
  for (const nlohmann::json& one : json) out.push_back(vector(one));
  return out;
}

}  // namespace field_json

inline void to_json(nlohmann::json& json, const FieldMapData& data) {
  const FieldFunctions& f = data.functions;
  json = {{"kind", name_of(f.basis)},
          {"order", f.order},
          {"box_mm", field_json::rows({f.low_mm, f.high_mm})},
          {"centres_mm", field_json::rows(f.centres_mm)},
          {"position_mm", field_json::rows(data.position_mm)},
          {"rotation_rad", field_json::rows(data.rotation_rad)},
          {"sigma_mm", data.sigma_mm}};
}

/// Throws what nlohmann throws, or std::invalid_argument. Whether the data make a map is for FieldMap::from to say.
inline void from_json(const nlohmann::json& json, FieldMapData& data) {
  const auto basis = field_basis_of(json.at("kind").get<std::string>());
  if (!basis) throw std::invalid_argument("a kind of map that is unknown");
  data.functions.basis = *basis;
  json.at("order").get_to(data.functions.order);
  const nlohmann::json& box = json.at("box_mm");
  if (box.size() != 2) throw std::invalid_argument("a box has two corners");
  data.functions.low_mm = field_json::vector(box[0]);
  data.functions.high_mm = field_json::vector(box[1]);
  data.functions.centres_mm = field_json::vectors(json.at("centres_mm"));
  data.position_mm = field_json::vectors(json.at("position_mm"));
  data.rotation_rad = field_json::vectors(json.at("rotation_rad"));
  json.at("sigma_mm").get_to(data.sigma_mm);
}

}  // namespace birdseye::calibration
