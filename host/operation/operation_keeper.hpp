#pragma once

#include <filesystem>
#include <string>

#include "host/operation/operation.hpp"

namespace birdseye::host {

/// Keeps what an operation has found in a folder, and takes up what an earlier window kept.
class OperationKeeper {
 public:
  /// out: where to; empty: nowhere. resume: what is to be taken up; or empty.
  OperationKeeper(std::filesystem::path out, std::filesystem::path resume);

  /// Of another CT nothing is taken up. Once: the second time, and where nothing was to be taken up, it is empty. An
  /// error names the folder; nothing is written from then on, for what is there may yet be needed.
  Result<std::optional<Operation>> take_up(const std::string& ct_checksum);
  /// Stamped now. Not before what is there has been taken up.
  void keep(Operation operation);
  /// Why the last could not be kept.
  [[nodiscard]] const std::string& fault() const { return fault_; }

 private:
  std::filesystem::path out_, resume_;
  std::string fault_;
};

}  // namespace birdseye::host
