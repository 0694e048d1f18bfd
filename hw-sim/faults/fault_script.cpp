#include "hw-sim/faults/fault_script.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <toml.hpp>
#include <utility>
#include <vector>

#include "calibration/base/nesting.hpp"
#include "calibration/base/parser_words.hpp"
#include "drivers/system/whole_file.hpp"
#include "hw-sim/base/hashed.hpp"
#include "hw-sim/faults/fault_table.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr double kLatestS = 1e6;
constexpr int kMostTimes = 10'000;

std::optional<double> number_of(const toml::value& value) {
  if (value.is_floating()) return value.as_floating();
  if (value.is_integer()) return static_cast<double>(value.as_integer());
  return std::nullopt;
}

/// How many pairs of neighbouring letters two names share, of all that they have: 0 to 1.
double likeness(std::string_view a, std::string_view b) {
  const auto pairs_of = [](std::string_view name) {
    std::multiset<std::string_view> pairs;
    for (std::size_t i = 0; i + 1 < name.size(); ++i) pairs.insert(name.substr(i, 2));
    return pairs;
  };
  const auto in_a = pairs_of(a), in_b = pairs_of(b);
  std::vector<std::string_view> shared;
  std::ranges::set_intersection(in_a, in_b, std::back_inserter(shared));
  return 2 * static_cast<double>(shared.size()) / std::max(1.0, static_cast<double>(in_a.size() + in_b.size()));
}

/// The faults that somebody may have meant by that name, at most three, the likeliest first.
std::vector<std::string_view> names_like(std::string_view name) {
  constexpr double kLike = 0.3;
  constexpr std::size_t kMost = 3;
  std::vector<std::pair<double, std::string_view>> found;
  for (const FaultSpec& each : fault_table()) {
    const double like = likeness(name, fault_name(each.kind));
    if (like >= kLike) found.emplace_back(-like, fault_name(each.kind));
  }
  std::ranges::sort(found);
  std::vector<std::string_view> names;
  for (std::size_t i = 0; i < std::min(kMost, found.size()); ++i) names.push_back(found[i].second);
  return names;
}

/// Reads the faults of one file and gathers what is wrong with it.
class Reader {
 public:
  Reader(Instruments instruments, std::uint64_t seed) : instruments_(instruments), seed_(seed) {}

  void read(const toml::value& root) {
    for (const auto& [key, value] : root.as_table()) {
      if (key == "seed" && value.is_integer() && value.as_integer() >= 0) {
        seed_ = static_cast<std::uint64_t>(value.as_integer());
      } else if (key != "fault" || !value.is_array()) {
        fail(value, fmt::format("{}: known are seed, a whole number, and [[fault]]", key));
      }
    }
    if (!root.contains("fault") || !root.at("fault").is_array()) return;
    for (const toml::value& entry : root.at("fault").as_array()) {
      if (entry.is_table()) {
        read_fault(entry);
      } else {
        fail(entry, "fault: each is a table, [[fault]]");
      }
      ++index_;
    }
  }

  [[nodiscard]] std::string problems() {
    std::stable_sort(problems_.begin(), problems_.end(),
                     [](const Problem& a, const Problem& b) { return a.line < b.line; });
    std::string text;
    for (const Problem& problem : problems_) {
      text += fmt::format("{}line {}: {}", text.empty() ? "" : "; ", problem.line, problem.what);
    }
    return text;
  }
  FaultScript script;

 private:
  struct Problem {
    std::uint_least32_t line;
    std::string what;
  };

  void fail(const toml::value& at, std::string what) { problems_.push_back({at.location().line(), std::move(what)}); }

  std::optional<double> number(const toml::value& entry, const char* key, double low, double high) {
    if (!entry.contains(key)) return std::nullopt;
    const toml::value& value = entry.at(key);
    const auto found = number_of(value);
    if (found && *found >= low && *found <= high) return found;
    fail(value, fmt::format("{}: needs a number of {:g} to {:g}", key, low, high));
    return std::nullopt;
  }

  const FaultSpec* spec_of(const toml::value& entry) {
    if (!entry.contains("name") || !entry.at("name").is_string()) {
      fail(entry, "a fault needs a name in quotes");
      return nullptr;
    }
    const toml::value& name = entry.at("name");
    const FaultSpec* const spec = fault_spec(name.as_string().str);
    if (spec != nullptr) return spec;
    const auto alike = names_like(name.as_string().str);
    fail(name,
         fmt::format("\"{}\": no such fault; {}all are in docs/manual/simulated-minibird.md and simulator.md",
                     name.as_string().str, alike.empty() ? "" : fmt::format("alike are {}; ", fmt::join(alike, ", "))));
    return nullptr;
  }

  /// Whom it befalls: who can have it, who is there, and what the entry says.
  std::optional<FaultTarget> target_of(const toml::value& entry, const FaultSpec& spec) {
    const bool programs = instruments_ == Instruments::with_programs;
    if (spec.of_world && (instruments_ == Instruments::both || programs) && !entry.contains("of"))
      return FaultTarget::world;
    if (spec.of_program && programs && !entry.contains("of")) return FaultTarget::program;
    bool tracker = spec.of_tracker && instruments_ != Instruments::camera;
    bool camera = spec.of_camera && instruments_ != Instruments::tracker;
    if (entry.contains("of")) {
      const toml::value& of = entry.at("of");
      const std::string who = of.is_string() ? of.as_string().str : "";
      if (who != "tracker" && who != "camera") {
        fail(of, "of: is \"tracker\" or \"camera\"");
        return std::nullopt;
      }
      (who == "tracker" ? camera : tracker) = false;
    }
    if (tracker && camera) {
      fail(entry,
           fmt::format("{}: either instrument can have it; add of = \"tracker\" or \"camera\"", fault_name(spec.kind)));
      return std::nullopt;
    }
    if (spec.of_world) {
      fail(entry, fmt::format("{}: befalls the operation and no instrument; give it to birdseye-sim cart, without of",
                              fault_name(spec.kind)));
      return std::nullopt;
    }
    if (spec.of_program) {
      fail(entry, fmt::format("{}: befalls the cart's programs and no instrument; give it to birdseye-sim operation, "
                              "without of",
                              fault_name(spec.kind)));
      return std::nullopt;
    }
    if (!tracker && !camera) {
      fail(entry, fmt::format("{}: there is no instrument here that can have it", fault_name(spec.kind)));
      return std::nullopt;
    }
    return tracker ? FaultTarget::tracker : FaultTarget::camera;
  }

  std::vector<double> times_of(const toml::value& entry) {
    if (entry.contains("times") && !entry.contains("between_s")) {
      fail(entry.at("times"),
           "times: goes with between_s = [from, to]; give that in place of at_s, or leave out times");
      return {};
    }
    const auto at_s = number(entry, "at_s", 0, kLatestS);
    if (at_s && !entry.contains("between_s")) return {*at_s};
    if (entry.contains("at_s") == entry.contains("between_s")) {
      fail(entry, "a fault needs at_s, or between_s = [from, to]");
      return {};
    }
    if (entry.contains("at_s")) return {};
    const toml::value& between = entry.at("between_s");
    std::vector<double> ends;
    for (std::size_t i = 0; between.is_array() && i < between.as_array().size(); ++i) {
      if (const auto end = number_of(between.as_array()[i])) ends.push_back(*end);
    }
    if (ends.size() != 2 || !(ends[0] >= 0 && ends[0] <= ends[1] && ends[1] <= kLatestS)) {
      fail(between, "between_s: needs [from, to] in seconds");
      return {};
    }
    const double times = number(entry, "times", 1, kMostTimes).value_or(1);
    std::vector<double> drawn;
    for (int i = 0; i < static_cast<int>(times); ++i) {
      const auto key = static_cast<std::uint64_t>(index_) * kMostTimes + static_cast<std::uint64_t>(i);
      drawn.push_back(ends[0] + (ends[1] - ends[0]) * hashed_uniform(seed_ + 131, key));
    }
    return drawn;
  }

  void read_fault(const toml::value& entry) {
    const FaultSpec* const spec = spec_of(entry);
    if (spec == nullptr) return;
    Fault fault;
    fault.kind = spec->kind;
    std::set<std::string_view> known{"name", "of", "at_s", "between_s", "times", "for_s"};
    for (const ParameterSpec& parameter : spec->parameters) {
      known.insert(parameter.name);
      const std::string key(parameter.name);
      const double value = number(entry, key.c_str(), parameter.low, parameter.high).value_or(parameter.usual);
      fault.values[key] = value;
      if (parameter.whole && value != std::floor(value)) fail(entry.at(key), key + ": needs a whole number");
    }
    for (const auto& [key, value] : entry.as_table()) {
      if (known.count(key) == 0) {
        fail(value, fmt::format("{}: {} has no such parameter; it has {}", key, fault_name(spec->kind),
                                fmt::join(known, ", ")));
      }
    }
    fault.for_s = number(entry, "for_s", spec->least_for_s, kLatestS);
    if (!entry.contains("for_s") && spec->without_end == WithoutEnd::refused) {
      fail(entry, fmt::format("{}: needs for_s, how long it lasts", fault_name(spec->kind)));
    }
    const auto target = target_of(entry, *spec);
    for (const double at_s : times_of(entry)) {
      fault.at_s = at_s;
      if (target) script.of(*target).push_back(fault);
    }
  }

  Instruments instruments_;
  std::uint64_t seed_;
  int index_ = 0;
  std::vector<Problem> problems_;
};

}  // namespace

std::vector<Fault>& FaultScript::of(FaultTarget target) {
  switch (target) {
    case FaultTarget::tracker:
      return tracker;
    case FaultTarget::camera:
      return camera;
    case FaultTarget::world:
      return world;
    case FaultTarget::program:
      break;
  }
  return programs;
}

const std::vector<Fault>& FaultScript::of(FaultTarget target) const {
  return const_cast<FaultScript*>(this)->of(target);
}

Result<FaultScript> read_fault_script(const std::filesystem::path& path, Instruments instruments, std::uint64_t seed) {
  constexpr std::size_t kMostBytes = 4U << 20U;
  const auto text = read_whole_file(path, kMostBytes);
  if (!text) return text.error();
  if (nests_too_deeply(*text, Notation::toml)) {
    return Error{Errc::bad_format,
                 fmt::format("{}: nests lists, tables or keys deeper than any script; write it anew", path.string())};
  }
  try {
    Reader reader(instruments, seed);
    std::istringstream stream(*text);
    reader.read(toml::parse(stream, path.string()));
    if (const std::string problems = reader.problems(); !problems.empty()) {
      return Error{Errc::bad_value, fmt::format("{}: {}", path.string(), problems)};
    }
    for (const FaultTarget target : kFaultTargets) {
      auto& faults = reader.script.of(target);
      std::stable_sort(faults.begin(), faults.end(), [](const Fault& a, const Fault& b) { return a.at_s < b.at_s; });
    }
    return std::move(reader.script);
  } catch (const toml::syntax_error& problem) {
    return Error{Errc::bad_format, fmt::format("{}: line {}: is not TOML: {}", path.string(), problem.location().line(),
                                               parser_words(problem.what()))};
  } catch (const std::exception& problem) {
    return Error{Errc::bad_format, fmt::format("{}: {}", path.string(), parser_words(problem.what()))};
  }
}

}  // namespace birdseye::hw_sim
