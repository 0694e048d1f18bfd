#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "calibration/base/result.hpp"
#include "drivers/identity/known_keys.hpp"

namespace birdseye {

/// The known keys for a program that runs on: as their file is at each question and, while the file cannot be used, as
/// it was when it last could. So a slip in the file puts nobody out; a machine whose line is taken out by the same edit
/// stays known until the file is mended. From any thread.
class FollowedKeys {
 public:
  /// An error where the file cannot be used to begin with.
  static Result<std::unique_ptr<FollowedKeys>> open(const std::filesystem::path& folder, const KnownKeys::Machine& own);

  /// As KnownKeys::name_of().
  std::optional<std::string> name_of(const PublicKey& key);
  /// What is wrong with the file now, with the remedy; empty: nothing.
  std::string fault();

 private:
  FollowedKeys(std::filesystem::path folder, KnownKeys::Machine own, KnownKeys known)
      : folder_(std::move(folder)), own_(std::move(own)), known_(std::move(known)) {}
  /// Reads the file again, under the mutex; the fault.
  std::string follow();

  std::filesystem::path folder_;
  KnownKeys::Machine own_;
  std::mutex mutex_;  ///< of what follows
  KnownKeys known_;   ///< as last read whole
};

}  // namespace birdseye
