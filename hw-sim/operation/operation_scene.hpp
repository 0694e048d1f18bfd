#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/round_field.hpp"
#include "hw-sim/camera/laparoscope.hpp"
#include "hw-sim/operation/operation_truth.hpp"

namespace birdseye::hw_sim {

/// What the scope that an operation has in use sees: the board, then the patient's organ in its cavity, traced.
class OperationScene {
 public:
  /// truth: outlives it. Errors are Laparoscope::create()'s.
  static Result<std::unique_ptr<OperationScene>> create(const OperationTruth& truth, std::uint64_t seed);

  /// The round field of a scope that the operation uses, as calibration finds it in pictures of the board. Empty: not
  /// found.
  std::optional<RoundField> round_field(std::size_t scope);
  /// RGB, of the size of the truth's lens. The same time gives the same bytes.
  std::vector<std::uint8_t> look(double at_s);

 private:
  using Scopes = std::array<std::unique_ptr<Laparoscope>, 2>;
  OperationScene(const OperationTruth& truth, Scopes scopes) : truth_(truth), scopes_(std::move(scopes)) {}

  const OperationTruth& truth_;
  Scopes scopes_;  ///< the second: null where it is never in use
};

}  // namespace birdseye::hw_sim
