#include "hw-sim/campaign/operation_results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <utility>

namespace birdseye::hw_sim {

namespace {

using Count = std::uint64_t OperationResult::*;
using Worst = double OperationResult::*;

constexpr std::array<std::pair<const char*, Count>, 17> kCounts{{{"laws_broken", &OperationResult::laws_broken},
                                                                 {"faults", &OperationResult::faults},
                                                                 {"faults_alone", &OperationResult::faults_alone},
                                                                 {"poses", &OperationResult::poses},
                                                                 {"frames", &OperationResult::frames},
                                                                 {"shown", &OperationResult::shown},
                                                                 {"overlaid", &OperationResult::overlaid},
                                                                 {"green", &OperationResult::green},
                                                                 {"judged", &OperationResult::judged},
                                                                 {"beyond", &OperationResult::beyond},
                                                                 {"registrations", &OperationResult::registrations},
                                                                 {"deformations", &OperationResult::deformations},
                                                                 {"checks", &OperationResult::checks},
                                                                 {"moved", &OperationResult::moved},
                                                                 {"moved_unwatched", &OperationResult::moved_unwatched},
                                                                 {"recordings", &OperationResult::recordings},
                                                                 {"found_again", &OperationResult::found_again}}};
constexpr std::array<std::pair<const char*, Worst>, 5> kWorst{{{"worst_pose", &OperationResult::worst_pose},
                                                               {"worst_age_ms", &OperationResult::worst_age_ms},
                                                               {"worst_circles", &OperationResult::worst_circles},
                                                               {"slowest_named_s", &OperationResult::slowest_named_s},
                                                               {"slowest_over_s", &OperationResult::slowest_over_s}}};

/// Refuses a number below zero, which would count as very many.
std::uint64_t count_in(const nlohmann::json& json) {
  if (!json.is_number_unsigned())
    throw nlohmann::json::type_error::create(302, "a count has to be a number from 0", &json);
  return json.get<std::uint64_t>();
}

}  // namespace

std::string line_of(const OperationResult& result) {
  nlohmann::ordered_json json{{"seed", result.seed}, {"minutes", result.minutes}, {"hash", result.hash}};
  for (const auto& [name, count] : kCounts) json[name] = result.*count;
  for (const auto& [name, worst] : kWorst) json[name] = result.*worst;
  nlohmann::ordered_json& by_fault = json["by_fault"] = nlohmann::ordered_json::object();
  for (const auto& [name, of] : result.by_fault)
    by_fault[name] = {of.befell, of.judged, of.slowest_named_s, of.slowest_over_s};
  json["broken"] = result.broken;
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

Result<OperationResult> result_of(const std::string& line) {
  try {
    const nlohmann::json json = nlohmann::json::parse(line);
    OperationResult out;
    json.at("seed").get_to(out.seed);
    json.at("minutes").get_to(out.minutes);
    json.at("hash").get_to(out.hash);
    json.at("broken").get_to(out.broken);
    for (const auto& [name, count] : kCounts) out.*count = count_in(json.at(name));
    for (const auto& [name, worst] : kWorst) json.at(name).get_to(out.*worst);
    for (const auto& [name, of] : json.at("by_fault").items())
      out.by_fault[name] = {count_in(of.at(0)), count_in(of.at(1)), of.at(2).get<double>(), of.at(3).get<double>()};
    out.laws_untold = out.laws_broken >= kMostLawsTold;
    return out;
  } catch (const nlohmann::json::exception& wrong) {
    return Error{Errc::bad_format, fmt::format("is no result of an operation ({}): {}", wrong.what(), line)};
  }
}

Result<OperationResult> sum_of(const SeedResults& results, std::uint64_t first, std::uint64_t last) {
  OperationResult out;
  out.operations = 0;
  auto summed = results.for_each(first, last, [&out](const SeedLine& line) -> Result<void> {
    auto one = result_of(line.line);
    if (one && one->seed != line.seed) one = Error{Errc::bad_format, fmt::format("is of seed {}", one->seed)};
    if (!one) {
      return Error{one.error().code, fmt::format("seed {}: {}; delete its row (sqlite3 FILE 'DELETE FROM results WHERE "
                                                 "seed = {}'), and the seed is run again",
                                                 line.seed, one.error().what, line.seed)};
    }
    ++out.operations;
    out.minutes += one->minutes;
    for (const auto& [name, of] : one->by_fault) {
      OperationResult::OfFault& sum = out.by_fault[name];
      sum.befell += of.befell;
      sum.judged += of.judged;
      sum.slowest_named_s = std::max(sum.slowest_named_s, of.slowest_named_s);
      sum.slowest_over_s = std::max(sum.slowest_over_s, of.slowest_over_s);
    }
    for (const auto& [name, count] : kCounts) out.*count += (*one).*count;
    for (const auto& [name, worst] : kWorst) out.*worst = std::max(out.*worst, (*one).*worst);
    out.laws_untold = out.laws_untold || one->laws_untold;
    if (one->laws_broken > 0 && !out.first_broken) out.first_broken = one->seed;
    if (!one->broken.empty()) out.broken += fmt::format("seed {}: {}\n", one->seed, one->broken);
    return {};
  });
  if (!summed) return summed.error();
  return out;
}

std::string words_of_faults(const OperationResult& result) {
  const auto within = [](double slowest_s) {
    return slowest_s > 0 ? fmt::format("within {:.2f} s", slowest_s) : std::string("(none judged)");
  };
  return fmt::format("faults named {}, over {}", within(result.slowest_named_s), within(result.slowest_over_s));
}

std::string words_by_fault(const OperationResult& result) {
  std::string out;
  for (const auto& [name, of] : result.by_fault) {
    out += fmt::format("  {:<32} {:>6}", name, of.befell);
    if (of.judged > 0) out += fmt::format(", {:>5} judged", of.judged);
    if (of.slowest_named_s > 0) out += fmt::format(", named within {:.2f} s", of.slowest_named_s);
    if (of.slowest_over_s > 0) out += fmt::format(", over within {:.2f} s of its end", of.slowest_over_s);
    out += '\n';
  }
  return out;
}

std::string words_of_laws(const OperationResult& result) {
  return fmt::format("{}{} laws broken", result.laws_broken, result.laws_untold ? " or more" : "");
}

}  // namespace birdseye::hw_sim
