#pragma once

#include <memory>
#include <vector>

#include "calibration/base/result.hpp"
#include "drivers/system/pipe.hpp"
#include "drivers/system/thread.hpp"

namespace birdseye::host {

/// Measures what this machine takes to hand a byte over twice, from thread to thread to thread, 144 times a second: as
/// often as a measurement changes hands on its way through birdseyed. The floor under birdseyed's own latency.
class TwoWakes {
 public:
  static Result<std::unique_ptr<TwoWakes>> start();
  ~TwoWakes();
  TwoWakes(const TwoWakes&) = delete;
  TwoWakes& operator=(const TwoWakes&) = delete;
  /// Ends the measurement. Returns the 99th percentile of each whole second, ms.
  std::vector<double> stop();

 private:
  TwoWakes(Pipe first, Pipe second);
  Pipe first_, second_;
  std::vector<double> ms_;
  std::vector<OwnedThread> threads_;
};

}  // namespace birdseye::host
