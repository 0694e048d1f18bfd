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

constexpr std::array<std::pair<const char*, Count>, 13> kCounts{
    {{"laws_broken", &OperationResult::laws_broken},
     {"faults", &OperationResult::faults},
     {"faults_alone", &OperationResult::faults_alone},
     {"poses", &OperationResult::poses},
     {"frames", &OperationResult::frames},
     {"shown", &OperationResult::shown},
     {"overlaid", &OperationResult::overlaid},
     {"green", &OperationResult::green},
     {"beyond", &OperationResult::beyond},
     {"registrations", &OperationResult::registrations},
     {"checks", &OperationResult::checks},
     {"moved", &OperationResult::moved},
     {"moved_unwatched", &OperationResult::moved_unwatched}}};
constexpr std::array<std::pair<const char*, Worst>, 5> kWorst{{{"worst_pose", &OperationResult::worst_pose},
                                                               {"worst_age_ms", &OperationResult::worst_age_ms},
                                                               {"worst_circles", &OperationResult::worst_circles},
                                                               {"slowest_named_s", &OperationResult::slowest_named_s},
                                                               {"slowest_over_s", &OperationResult::slowest_over_s}}};

}  // namespace

std::string line_of(const OperationResult& result) {
  nlohmann::ordered_json json{{"seed", result.seed}, {"minutes", result.minutes}, {"hash", result.hash}};
  for (const auto& [name, count] : kCounts) json[name] = result.*count;
  for (const auto& [name, worst] : kWorst) json[name] = result.*worst;
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
    for (const auto& [name, count] : kCounts) json.at(name).get_to(out.*count);
    for (const auto& [name, worst] : kWorst) json.at(name).get_to(out.*worst);
    out.laws_untold = out.laws_broken >= kMostLawsTold;
    return out;
  } catch (const nlohmann::json::exception& wrong) {
    return Error{Errc::bad_format, fmt::format("is no result of an operation ({}): {}", wrong.what(), line)};
  }
}

Result<OperationResult> sum_of(const SeedResults& results, std::uint64_t first, std::uint64_t last) {
  OperationResult out;
  auto summed = results.for_each(first, last, [&out](const SeedLine& line) -> Result<void> {
    const auto one = result_of(line.line);
    if (!one) return one.error();
    out.minutes += one->minutes;
    for (const auto& [name, count] : kCounts) out.*count += (*one).*count;
    for (const auto& [name, worst] : kWorst) out.*worst = std::max(out.*worst, (*one).*worst);
    out.laws_untold = out.laws_untold || one->laws_untold;
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

std::string words_of_laws(const OperationResult& result) {
  return fmt::format("{}{} laws broken", result.laws_broken, result.laws_untold ? " or more" : "");
}

}  // namespace birdseye::hw_sim
