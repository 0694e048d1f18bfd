#pragma once

#include <filesystem>
#include <functional>
#include <string_view>
#include <utility>

#include "calibration/base/result.hpp"

namespace birdseye {

/// A name beside a place, in the place's folder, that nobody has. `take` tries to have a name, and answers whether it
/// does; where it does not by EEXIST, the next name is tried. They are counted from 0, so that what is simulated has
/// the same names each time. Empty where none could be had: errno says why.
std::filesystem::path take_part_name(const std::filesystem::path& place,
                                     const std::function<bool(const std::filesystem::path&)>& take);

/// A file until it is whole: under the name that it will have, so that who writes it finds the format by the ending,
/// in a fresh folder beside its place, where nobody else's file is in the way. What is left of it goes away with this.
class PartFile {
 public:
  /// Refuses a place where there is something that is no file, as a folder, a pipe or a device.
  static Result<PartFile> make(const std::filesystem::path& place);
  PartFile(PartFile&& other) noexcept
      : place_(std::move(other.place_)), folder_(std::exchange(other.folder_, std::filesystem::path())) {}
  PartFile& operator=(PartFile&& other) noexcept;
  ~PartFile();

  [[nodiscard]] const std::filesystem::path& place() const { return place_; }
  [[nodiscard]] std::filesystem::path path() const { return folder_ / place_.filename(); }
  /// For whatever else belongs to it until it is whole.
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  /// Puts what was written into its place: after a power cut there is the former file or the whole new one,
  /// which has the permissions of the former.
  Result<void> put_durably();

 private:
  PartFile(std::filesystem::path place, std::filesystem::path folder)
      : place_(std::move(place)), folder_(std::move(folder)) {}
  void remove();

  std::filesystem::path place_, folder_;
};

/// Writes a text as such a file. of_new: the permissions of one that was not there; unknown: as the user's new files
/// have them.
Result<void> write_durably(const std::filesystem::path& place, std::string_view text,
                           std::filesystem::perms of_new = std::filesystem::perms::unknown);

}  // namespace birdseye
