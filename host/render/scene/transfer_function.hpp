#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// HU -> colour and extinction, piecewise linear between control points (docs/image-formation.md).
struct TransferPoint {
  double hu = 0;
  Eigen::Vector3d rgb = Eigen::Vector3d::Ones();  ///< in [0, 1], as the screen shows it
  double extinction_per_mm = 0;
};

class TransferFunction {
 public:
  /// Points in ascending order of HU; at least one.
  explicit TransferFunction(const std::vector<TransferPoint>& points);

  static constexpr int kLowestHu = -1024, kHighestHu = 3071;
  struct Entry {
    float r, g, b, extinction_per_mm;
  };
  /// The entry for a whole HU, clamped to what a CT can hold.
  [[nodiscard]] const Entry& at(int hu) const;
  /// The points as they were given.
  [[nodiscard]] const std::vector<TransferPoint>& points() const { return points_; }
  /// Whether any HU of [low, high] is seen at all.
  [[nodiscard]] bool any_seen(int low, int high) const;

 private:
  static constexpr std::size_t kEntries = kHighestHu - kLowestHu + 1;
  std::vector<TransferPoint> points_;
  std::vector<Entry> table_;
  std::vector<int> seen_up_to_;  ///< running count of entries that are seen
};

/// Loads a preset by its name, or a JSON file {"points": [{"hu":, "rgb": [r, g, b], "extinction_per_mm":}, ...]}.
Result<TransferFunction> load_transfer_function(const std::string& name_or_path);
std::vector<std::string> transfer_presets();
/// The preset that shows vessels and tumour, each kind in a colour of its own.
inline constexpr const char* kTumourAndVessels = "tumour-and-vessels";
/// The text of a file that load_transfer_function reads back exactly.
std::string transfer_text(const TransferFunction& transfer);

}  // namespace birdseye::host
