#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calibration/base/result.hpp"
#include "drivers/identity/public_key.hpp"

namespace birdseye {

/// The machines whose keys this one knows, by names that its people gave them: the text file `known` beside its own
/// key, a line a machine, with its name and its key in hexadecimal digits. Its own key is known without a line.
class KnownKeys {
 public:
  struct Machine {
    std::string name;
    PublicKey key;
  };

  /// Of the folder, where there may be no such file. own: this machine's key, or nothing where it has none yet; where a
  /// line has its name already, it is called as free_name() says. Refuses a line that is damaged, by its number, and a
  /// file that others may change, or that belongs to another user than this one or root.
  static Result<KnownKeys> read(const std::filesystem::path& folder, const std::optional<Machine>& own);
  /// This machine alone, and no file: none can be added.
  static KnownKeys of_own(const Machine& own);

  /// The name of the machine with this key; nothing where it is unknown.
  [[nodiscard]] std::optional<std::string> name_of(const PublicKey& key) const;
  /// Also into the file, and onto the disk. A key that is known stays with its name. Refuses what is_name() does
  /// not take, and a name that another key has.
  Result<void> add(const std::string& name, const PublicKey& key);
  /// A file's name has at most 255 bytes, and pairing keeps NAME.crt.
  static constexpr std::size_t kMostNameBytes = 255 - 4;
  /// Whether another machine may have it: it is one word of at most kMostNameBytes, and the name of a file other than
  /// this machine's own.
  [[nodiscard]] static bool is_name(std::string_view name);
  /// The name, or where a machine has it already the first of NAME-2, NAME-3 that none has, NAME cut where it is too
  /// long for that.
  [[nodiscard]] std::string free_name(const std::string& name) const;
  /// Why add() would refuse the machine; empty where it would not.
  [[nodiscard]] std::string objection(const Machine& machine) const;
  [[nodiscard]] const std::vector<Machine>& machines() const { return machines_; }

 private:
  explicit KnownKeys(std::filesystem::path file) : file_(std::move(file)) {}

  std::filesystem::path file_;
  std::vector<Machine> machines_;  ///< this one first, where it has a key
};

}  // namespace birdseye
