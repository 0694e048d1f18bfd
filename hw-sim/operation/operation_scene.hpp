#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "calibration/base/result.hpp"
#include "hw-sim/camera/laparoscope.hpp"
#include "hw-sim/operation/operation_truth.hpp"

namespace birdseye::hw_sim {

/// What the scope of an operation sees: the board, then the patient's organ in its cavity, traced.
class OperationScene {
 public:
  /// truth: outlives it. Errors are Laparoscope::create()'s.
  static Result<std::unique_ptr<OperationScene>> create(const OperationTruth& truth, std::uint64_t seed);

  /// RGB, of the size of the truth's lens. The same time gives the same bytes.
  std::vector<std::uint8_t> look(double at_s);

 private:
  OperationScene(const OperationTruth& truth, std::unique_ptr<Laparoscope> scope)
      : truth_(truth), scope_(std::move(scope)) {}

  const OperationTruth& truth_;
  std::unique_ptr<Laparoscope> scope_;
};

}  // namespace birdseye::hw_sim
