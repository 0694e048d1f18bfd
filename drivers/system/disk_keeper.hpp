#pragma once

#include <filesystem>

namespace birdseye {

/// Brings files and folders onto the disk in place of the machine. Only a simulator puts one there: a disk that is
/// late, or full, or loses power is then one of its own. Who writes asks by drivers/system/durable.hpp.
class DiskKeeper {
 public:
  virtual ~DiskKeeper() = default;

  /// Of a folder: the names in it. Gives 0, or the number of an error as fsync() does.
  [[nodiscard]] virtual int sync(const std::filesystem::path& path) = 0;

  /// For the calling thread of the machine. Null: its disk is the machine's.
  static DiskKeeper* present();
  /// The same. keeper: outlives its being here. Null: none from now on.
  static void put(DiskKeeper* keeper);
};

}  // namespace birdseye
