#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "calibration/base/result.hpp"
#include "calibration/time/clock.hpp"
#include "drivers/system/disk_keeper.hpp"

namespace birdseye::hw_sim {

/// A folder, as a disk has it that may be late, be full, or lose its power. What programs wrote and did not sync may
/// then be there, in part, or not at all: of each name and of each file the seed decides, apart from the others, so
/// that of a file that was given another name both may be there, or neither.
class LocalDisk final : public DiskKeeper {
 public:
  /// root: there already. Nothing outside of it is this disk's.
  LocalDisk(const std::filesystem::path& root, std::uint64_t seed);
  ~LocalDisk() override;
  LocalDisk(const LocalDisk&) = delete;
  LocalDisk& operator=(const LocalDisk&) = delete;

  int sync(const std::filesystem::path& path) override;

  /// Each sync takes so long.
  void set_late(Duration late) { late_ = late; }
  /// Full: each sync fails.
  void set_full(bool full) { full_ = full; }
  /// How many syncs have failed.
  [[nodiscard]] std::uint64_t failed() const { return failed_; }

  /// The power goes after so many syncs more. Until somebody ends them programs go on; what they write from then on is
  /// lost, and each sync fails.
  void lose_power_after(std::uint64_t syncs);
  /// The power goes now, where it has not gone before.
  void lose_power();
  [[nodiscard]] bool powerless() const { return left_.has_value(); }
  /// The power is back: the folder has what the disk kept. Nobody has a file of it open.
  Result<void> power_up();

 private:
  /// A file or a folder that one of the names on the disk leads to.
  struct Node {
    bool folder = false;
    std::uint64_t number = 0;  ///< of a file
    bool operator==(const Node&) const = default;
  };
  using Names = std::map<std::string, Node>;
  /// What is there after a power cut, by its path below root; a folder has no text.
  using Image = std::map<std::filesystem::path, std::optional<std::string>>;

  void wait_for_disk() const;
  void note(const std::filesystem::path& path);
  void note_all();
  void forget_removed();
  [[nodiscard]] Names names_in(const std::filesystem::path& folder);
  [[nodiscard]] std::filesystem::path held(std::uint64_t number) const;
  std::uint64_t hold(const std::filesystem::path& file);
  void survive(const std::filesystem::path& folder, Image& image);
  [[nodiscard]] std::string surviving_text(std::uint64_t number);
  [[nodiscard]] double drawn();

  std::filesystem::path root_, held_;  ///< held_: a link of each file that was synced, so that no other gets its number
  std::uint64_t seed_, key_ = 0, failed_ = 0;
  Duration late_{};
  bool full_ = false;
  std::optional<std::uint64_t> goes_after_;
  std::map<std::filesystem::path, Names> synced_names_;  ///< of each folder that was synced, by its path
  std::map<std::uint64_t, std::string> synced_text_;     ///< of each file that was synced, by its number
  std::optional<Image> left_;                            ///< since the power went
};

}  // namespace birdseye::hw_sim
