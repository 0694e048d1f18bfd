#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "drivers/system/background.hpp"
#include "drivers/system/clock.hpp"
#include "host/operation/operation.hpp"

namespace birdseye::host {

/// Keeps what an operation has found in a folder, and takes up what an earlier window kept. It writes on a thread of
/// its own, for a disk may take its time; its end waits until all is written, or the disk has failed again.
class OperationKeeper {
 public:
  /// out: where to; empty: nowhere. resume: what is to be taken up, if authors
  /// admit it; or empty.
  OperationKeeper(std::filesystem::path out, std::filesystem::path resume, Authors authors);
  ~OperationKeeper();
  OperationKeeper(const OperationKeeper&) = delete;
  OperationKeeper& operator=(const OperationKeeper&) = delete;

  /// Of another CT, other labels or a deformation that was judged by another target nothing is taken up. Once: the
  /// second time, and where nothing was to be taken up, it is empty. An error names the folder; nothing is written into
  /// it from then on, for what is there may yet be needed.
  Result<std::optional<Operation>> take_up(const std::string& ct_sha256, const std::string& labels_sha256,
                                           const Eigen::Vector3d& target_at_rest_mm);
  /// Stamped now. Not before what is there has been taken up. Of several in a row the last is written at any rate.
  void keep(Operation operation);
  /// Hears what became of each that was written, and begins the next. What could not be kept is written again every
  /// five seconds.
  void tick();
  /// Waits until all is written, or the disk has failed once more: which of them, fault() says.
  void finish();
  [[nodiscard]] bool writing() const { return writing_.running() || newest_ != written_; }
  /// Why it could not be kept.
  [[nodiscard]] const std::string& fault() const { return fault_; }

 private:
  void write();
  void hear();
  /// hear(), once the write that runs has ended. False: it does not end.
  bool wait_and_hear();

  std::filesystem::path out_, resume_;
  Authors authors_;
  Background<Result<void>> writing_;
  std::shared_ptr<const Operation> newest_;   ///< that was to be kept
  std::shared_ptr<const Operation> written_;  ///< whose writing was begun last
  std::optional<Deadline> again_;             ///< once what could not be kept is written again
  std::string fault_;
  bool finished_ = false;
};

}  // namespace birdseye::host
