#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/time/clock.hpp"

namespace birdseye::device {

/// What is wrong with a file, one line each.
class ConfigFaults {
 public:
  explicit ConfigFaults(std::filesystem::path file) : file_(std::move(file)) {}
  /// line: 0 for a fault of the file as a whole.
  void add(std::int64_t line, const std::string& text);
  [[nodiscard]] std::size_t count() const { return faults_.size(); }
  [[nodiscard]] std::string text() const;  ///< in the order of the lines

 private:
  std::filesystem::path file_;
  std::multimap<std::int64_t, std::string> faults_;
};

/// The first ten of what may be many mistakes of one kind; the others are counted.
class FirstFew {
 public:
  /// Whether the next one, of this line, is to be told.
  bool takes(std::int64_t line) {
    if (++count_ == kMost + 1) line_ = line;
    return count_ <= kMost;
  }
  [[nodiscard]] std::size_t others() const { return count_ > kMost ? count_ - kMost : 0; }
  /// Of the first of the others.
  [[nodiscard]] std::int64_t line() const { return line_; }

 private:
  static constexpr std::size_t kMost = 10;
  std::size_t count_ = 0;
  std::int64_t line_ = 0;
};

/// A value as the reader of TOML has it.
struct ConfigValue;

/// One table of a configuration file. A value that is absent leaves what was there; one of the wrong type or out of its
/// range is a fault. Every key that is asked for is noted, so that finish() can name the others.
class ConfigSection {
 public:
  /// table: null where the file has no such section.
  ConfigSection(ConfigFaults& faults, std::string name, std::shared_ptr<const ConfigValue> table);

  void text(const char* key, std::string& value, bool required = false);
  void number(const char* key, double& value, double low, double high);
  void number(const char* key, std::optional<double>& value, double low, double high);
  void integer(const char* key, int& value, int low, int high);
  void integer(const char* key, std::optional<int>& value, int low, int high);
  void flag(const char* key, bool& value);
  void milliseconds(const char* key, Duration& value, double high_ms);
  void milliseconds(const char* key, std::optional<Duration>& value, double high_ms);
  void texts(const char* key, std::vector<std::string>& values);
  /// A list of exactly count numbers; empty where it is absent or wrong.
  std::vector<double> numbers(const char* key, std::size_t count, double low, double high);
  /// The tables of [[section.key]].
  std::vector<ConfigSection> tables(const char* key);

  [[nodiscard]] bool present() const { return table_ != nullptr; }
  [[nodiscard]] bool has(const char* key) const;
  /// Tells a fault of key. With an empty key it is that of the key with which `why` begins, else of the section as a
  /// whole. Only the first fault of a key is told, for others follow from it.
  void fail(const char* key, const std::string& why);
  /// Whether a fault of key was told.
  [[nodiscard]] bool failed(const std::string& key) const { return failed_.count(key) != 0; }
  /// Names the keys that nobody asked for, the first ten of them. To be called last.
  void finish();

 private:
  std::shared_ptr<const ConfigValue> find(const char* key, bool required = false);

  ConfigFaults* faults_;
  std::string name_;
  std::shared_ptr<const ConfigValue> table_;
  std::set<std::string> known_, failed_;
};

/// A configuration file as a whole.
class ConfigFile {
 public:
  /// Refuses what is not TOML.
  static Result<ConfigFile> parse(const std::string& text, const std::filesystem::path& path);

  /// What stands at the top of the file: sections, if all is well.
  struct Entry {
    std::string name;
    std::int64_t line = 0;
    bool is_table = false;
  };
  [[nodiscard]] std::vector<Entry> entries() const;
  [[nodiscard]] ConfigSection section(ConfigFaults& faults, const std::string& name) const;

 private:
  explicit ConfigFile(std::shared_ptr<const ConfigValue> root) : root_(std::move(root)) {}

  std::shared_ptr<const ConfigValue> root_;
};

}  // namespace birdseye::device
