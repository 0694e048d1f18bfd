#include "host/render/scene/transfer_function.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "calibration/record/strict_json.hpp"
#include "drivers/system/whole_file.hpp"

namespace birdseye::host {

namespace {

using Points = std::vector<TransferPoint>;

const std::map<std::string, Points>& presets() {
  static const std::map<std::string, Points> kPresets = {
      // Soft tissue in the narrow window in which organs differ, fat as a breath, bone as ivory.
      {"abdomen",
       {{-200, {0, 0, 0}, 0},
        {-150, {0.55, 0.42, 0.25}, 0.004},
        {-60, {0.60, 0.45, 0.28}, 0.004},
        {-20, {0.30, 0.05, 0.05}, 0.06},
        {20, {0.52, 0.14, 0.12}, 0.6},
        {60, {0.86, 0.46, 0.36}, 0.9},
        {110, {0.92, 0.62, 0.48}, 0.9},
        {180, {0.95, 0.85, 0.66}, 1.2},
        {400, {1.0, 0.97, 0.88}, 2.0}}},
      {"bone", {{150, {0.80, 0.65, 0.45}, 0}, {300, {0.95, 0.88, 0.70}, 0.5}, {700, {1, 0.98, 0.92}, 2}}},
      {"liver",
       {{10, {0.45, 0.12, 0.10}, 0},
        {40, {0.62, 0.22, 0.17}, 0.15},
        {130, {0.80, 0.36, 0.26}, 0.25},
        {180, {0.85, 0.45, 0.3}, 0}}},
      {"skin", {{-600, {0.85, 0.66, 0.55}, 0}, {-300, {0.88, 0.70, 0.58}, 1}, {3071, {0.95, 0.80, 0.70}, 1}}},
      {"vessel", {{130, {0.75, 0.15, 0.15}, 0}, {180, {0.85, 0.20, 0.20}, 0.4}, {350, {1.0, 0.55, 0.45}, 1}}},
      // Portal veins blue, hepatic veins pale violet, a tumour that has taken up contrast medium green: told apart by
      // HU, once all but their labels is left out. At its rim a portal vein has the HU of a hepatic one: of another hue
      // it would look like one.
      {kTumourAndVessels,
       {{80, {0.74, 0.62, 1.0}, 0},
        {140, {0.74, 0.62, 1.0}, 0.16},
        {185, {0.74, 0.62, 1.0}, 0.22},
        {205, {0.0, 0.32, 0.85}, 0.22},
        {240, {0.0, 0.32, 0.85}, 0.25},
        {290, {0.35, 0.95, 0.45}, 0.30},
        {340, {0.30, 1.0, 0.35}, 0.40},
        {500, {0.40, 1.0, 0.40}, 0.40}}},
  };
  return kPresets;
}

TransferPoint between(const Points& points, double hu) {
  if (hu <= points.front().hu) return points.front();
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (hu > points[i].hu) continue;
    const double u = (hu - points[i - 1].hu) / std::max(1e-9, points[i].hu - points[i - 1].hu);
    const TransferPoint &a = points[i - 1], &b = points[i];
    return {hu, a.rgb + u * (b.rgb - a.rgb), a.extinction_per_mm + u * (b.extinction_per_mm - a.extinction_per_mm)};
  }
  return points.back();
}

}  // namespace

TransferFunction::TransferFunction(const std::vector<TransferPoint>& points) : points_(points) {
  table_.reserve(kEntries);
  seen_up_to_.reserve(kEntries + 1);
  seen_up_to_.push_back(0);
  for (int hu = kLowestHu; hu <= kHighestHu; ++hu) {
    const TransferPoint p = between(points, hu);
    table_.push_back({static_cast<float>(p.rgb.x()), static_cast<float>(p.rgb.y()), static_cast<float>(p.rgb.z()),
                      static_cast<float>(p.extinction_per_mm)});
    seen_up_to_.push_back(seen_up_to_.back() + (p.extinction_per_mm > 0 ? 1 : 0));
  }
}

const TransferFunction::Entry& TransferFunction::at(int hu) const {
  return table_[static_cast<std::size_t>(std::clamp(hu, kLowestHu, kHighestHu) - kLowestHu)];
}

bool TransferFunction::any_seen(int low, int high) const {
  const auto first = static_cast<std::size_t>(std::clamp(low, kLowestHu, kHighestHu) - kLowestHu);
  const auto last = static_cast<std::size_t>(std::clamp(high, kLowestHu, kHighestHu) - kLowestHu);
  return seen_up_to_[last + 1] > seen_up_to_[first];
}

std::vector<std::string> transfer_presets() {
  std::vector<std::string> names;
  for (const auto& [name, points] : presets()) names.push_back(name);
  return names;
}

Result<TransferFunction> load_transfer_function(const std::string& name_or_path) {
  if (const auto found = presets().find(name_or_path); found != presets().end()) return TransferFunction(found->second);
  constexpr std::size_t kMostBytes = 1U << 20U;
  const auto text = read_whole_file(name_or_path, kMostBytes);
  if (!text && text.error().code == Errc::not_found) {
    return Error{Errc::not_found, fmt::format("transfer function \"{}\": neither a file nor one of {}", name_or_path,
                                              fmt::join(transfer_presets(), ", "))};
  }
  if (!text) return text.error();
  const auto wrong = [&](const std::string& why) {
    return Error{Errc::bad_format, fmt::format("{}: {}; see docs/manual/volumes.md", name_or_path, why)};
  };
  std::string twice;
  const auto json = calibration::strict_json<nlohmann::json>(*text, &twice);
  if (!twice.empty()) return wrong(fmt::format("\"{}\" stands twice in it", twice));
  try {
    Points points;
    constexpr auto kUnknown = [](const nlohmann::json& object, std::initializer_list<const char*> known) {
      for (const auto& [key, value] : object.items()) {
        if (std::find(known.begin(), known.end(), key) == known.end()) return key;
      }
      return std::string();
    };
    if (const std::string key = kUnknown(json, {"points"}); !key.empty()) return wrong(key + ": unknown key");
    if (!json.at("points").is_array()) return wrong("points is no array");
    for (const auto& item : json.at("points")) {
      if (const std::string key = kUnknown(item, {"hu", "rgb", "extinction_per_mm"}); !key.empty())
        return wrong(key + ": unknown key");
      const auto rgb = item.at("rgb").get<std::vector<double>>();
      if (rgb.size() != 3) return wrong("rgb needs three numbers");
      points.push_back(
          {item.at("hu").get<double>(), {rgb[0], rgb[1], rgb[2]}, item.at("extinction_per_mm").get<double>()});
      const TransferPoint& p = points.back();
      if (!(p.extinction_per_mm >= 0) || p.rgb.minCoeff() < 0 || p.rgb.maxCoeff() > 1) {
        return wrong("rgb must lie in [0, 1] and extinction_per_mm must not be negative");
      }
      if (points.size() > 1 && !(p.hu > points[points.size() - 2].hu)) return wrong("points must ascend in hu");
    }
    if (points.empty()) return wrong("holds no points");
    return TransferFunction(points);
  } catch (const nlohmann::json::exception&) {
    return wrong("is not a transfer function in JSON");
  }
}

std::string transfer_text(const TransferFunction& transfer) {
  nlohmann::json points = nlohmann::json::array();
  for (const TransferPoint& point : transfer.points()) {
    points.push_back({{"hu", point.hu},
                      {"rgb", {point.rgb.x(), point.rgb.y(), point.rgb.z()}},
                      {"extinction_per_mm", point.extinction_per_mm}});
  }
  return nlohmann::json{{"points", points}}.dump(2) + "\n";
}

}  // namespace birdseye::host
