#include "device/birdseyed/config_section.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <exception>
#include <sstream>
#include <toml.hpp>

#include "calibration/base/nesting.hpp"
#include "calibration/base/parser_words.hpp"

namespace birdseye::device {

struct ConfigValue : toml::value {
  explicit ConfigValue(const toml::value& value) : toml::value(value) {}
};

namespace {

std::int64_t line_of(const toml::value& value) {
  return static_cast<std::int64_t>(value.location().line());
}

}  // namespace

void ConfigFaults::add(std::int64_t line, const std::string& text) {
  const std::string place = line > 0 ? fmt::format("{}:{}", file_.string(), line) : file_.string();
  faults_.emplace(line, fmt::format("{}: {}", place, text));
}

std::string ConfigFaults::text() const {
  std::string all;
  for (const auto& [line, fault] : faults_) all += (all.empty() ? "" : "\n") + fault;
  return all;
}

ConfigSection::ConfigSection(ConfigFaults& faults, std::string name, std::shared_ptr<const ConfigValue> table)
    : faults_(&faults), name_(std::move(name)), table_(std::move(table)) {}

std::shared_ptr<const ConfigValue> ConfigSection::find(const char* key, bool required) {
  known_.insert(key);
  if (has(key)) return std::make_shared<ConfigValue>(table_->as_table().at(key));
  if (required) fail(key, "is missing");
  return nullptr;
}

bool ConfigSection::has(const char* key) const {
  return table_ != nullptr && table_->as_table().count(key) != 0;
}

void ConfigSection::fail(const char* key, const std::string& why) {
  if (*key == 0) {
    if (const std::string first = why.substr(0, why.find_first_of(": ")); has(first.c_str()))
      return fail(first.c_str(), why.substr(why.find_first_not_of(": ", first.size())));
  }
  if (*key != 0 && !failed_.insert(key).second) return;
  const std::int64_t line = has(key) ? line_of(table_->as_table().at(key)) : table_ != nullptr ? line_of(*table_) : 0;
  const std::string colon = *key == 0 ? "" : ": ";
  faults_->add(line, fmt::format("[{}] {}{}{}", name_, key, colon, why));
}

void ConfigSection::text(const char* key, std::string& value, bool required) {
  const auto found = find(key, required);
  if (found == nullptr) return;
  if (!found->is_string()) return fail(key, "needs text in quotes");
  const std::string& given = found->as_string().str;
  // Of a NUL whoever opens what it names would see no more than what stands before it.
  if (std::ranges::any_of(given, [](unsigned char c) { return c < ' ' || c == 0x7F; }))
    return fail(key, "has a control character");
  value = given;
}

void ConfigSection::number(const char* key, std::optional<double>& value, double low, double high) {
  const auto found = find(key);
  if (found == nullptr) return;
  if (!found->is_floating() && !found->is_integer()) return fail(key, "needs a number");
  value = found->is_floating() ? found->as_floating() : static_cast<double>(found->as_integer());
  if (!(*value >= low && *value <= high)) fail(key, fmt::format("{:g} is not within {:g} and {:g}", *value, low, high));
}

void ConfigSection::number(const char* key, double& value, double low, double high) {
  std::optional<double> read;
  number(key, read, low, high);
  if (read) value = *read;
}

void ConfigSection::integer(const char* key, std::optional<int>& value, int low, int high) {
  const auto found = find(key);
  if (found == nullptr) return;
  if (!found->is_integer()) return fail(key, "needs a whole number");
  if (found->as_integer() < low || found->as_integer() > high)
    return fail(key, fmt::format("{} is not within {} and {}", found->as_integer(), low, high));
  value = static_cast<int>(found->as_integer());
}

void ConfigSection::integer(const char* key, int& value, int low, int high) {
  std::optional<int> read;
  integer(key, read, low, high);
  if (read) value = *read;
}

void ConfigSection::flag(const char* key, bool& value) {
  const auto found = find(key);
  if (found == nullptr) return;
  if (!found->is_boolean()) return fail(key, "needs true or false");
  value = found->as_boolean();
}

void ConfigSection::milliseconds(const char* key, std::optional<Duration>& value, double high_ms) {
  std::optional<double> ms;
  number(key, ms, 0, high_ms);
  if (ms) value = Duration::from_seconds(*ms * 1e-3);
}

void ConfigSection::milliseconds(const char* key, Duration& value, double high_ms) {
  std::optional<Duration> read;
  milliseconds(key, read, high_ms);
  if (read) value = *read;
}

void ConfigSection::texts(const char* key, std::vector<std::string>& values) {
  const auto found = find(key);
  if (found == nullptr) return;
  if (!found->is_array()) return fail(key, "needs a list of names");
  values.clear();
  for (const toml::value& item : found->as_array()) {
    if (!item.is_string()) return fail(key, "needs a list of names");
    values.push_back(item.as_string().str);
  }
}

std::vector<double> ConfigSection::numbers(const char* key, std::size_t count, double low, double high) {
  const auto found = find(key);
  if (found == nullptr) return {};
  std::vector<double> values;
  if (found->is_array()) {
    for (const toml::value& item : found->as_array()) {
      if (item.is_floating()) values.push_back(item.as_floating());
      if (item.is_integer()) values.push_back(static_cast<double>(item.as_integer()));
    }
  }
  const auto outside = [&](double v) { return !(v >= low && v <= high); };
  if (values.size() == count && found->as_array().size() == count &&
      std::none_of(values.begin(), values.end(), outside)) {
    return values;
  }
  fail(key, fmt::format("needs a list of {} numbers within {:g} and {:g}", count, low, high));
  return {};
}

std::vector<ConfigSection> ConfigSection::tables(const char* key) {
  const auto found = find(key);
  std::vector<ConfigSection> sections;
  if (found == nullptr) return sections;
  const bool tables = found->is_array() && std::all_of(found->as_array().begin(), found->as_array().end(),
                                                       [](const toml::value& item) { return item.is_table(); });
  if (!tables) {
    fail(key, fmt::format("is given as [[{}.{}]]", name_, key));
    return sections;
  }
  for (const toml::value& item : found->as_array())
    sections.emplace_back(*faults_, name_ + "." + key, std::make_shared<ConfigValue>(item));
  return sections;
}

void ConfigSection::finish() {
  if (table_ == nullptr) return;
  std::multimap<std::int64_t, std::string> by_line;  // the table itself is in no order
  for (const auto& [key, value] : table_->as_table()) {
    if (known_.count(key) == 0) by_line.emplace(line_of(value), key);
  }
  FirstFew unknown;
  for (const auto& [line, key] : by_line) {
    if (unknown.takes(line)) fail(key.c_str(), fmt::format("unknown key; known are {}", fmt::join(known_, ", ")));
  }
  if (unknown.others() > 0)
    faults_->add(unknown.line(), fmt::format("[{}] and {} more unknown keys", name_, unknown.others()));
}

Result<ConfigFile> ConfigFile::parse(const std::string& text, const std::filesystem::path& path) {
  if (nests_too_deeply(text, Notation::toml)) {
    return Error{
        Errc::bad_format,
        fmt::format("{}: nests lists, tables or keys deeper than any configuration; write it anew", path.string())};
  }
  try {
    std::istringstream stream(text);
    return ConfigFile(std::make_shared<ConfigValue>(toml::parse(stream, path.string())));
  } catch (const toml::syntax_error& problem) {
    return Error{Errc::bad_format, fmt::format("{}:{}: is not TOML (texts need quotes): {}", path.string(),
                                               problem.location().line(), parser_words(problem.what()))};
  } catch (const std::exception& problem) {
    return Error{Errc::bad_format, fmt::format("{}: is not TOML: {}", path.string(), parser_words(problem.what()))};
  }
}

std::vector<ConfigFile::Entry> ConfigFile::entries() const {
  std::vector<Entry> entries;
  for (const auto& [name, value] : root_->as_table()) entries.push_back({name, line_of(value), value.is_table()});
  std::ranges::sort(entries, {}, &Entry::line);
  return entries;
}

ConfigSection ConfigFile::section(ConfigFaults& faults, const std::string& name) const {
  const auto found = root_->as_table().find(name);
  const bool table = found != root_->as_table().end() && found->second.is_table();
  return {faults, name, table ? std::make_shared<ConfigValue>(found->second) : nullptr};
}

}  // namespace birdseye::device
