#include "host/doctor/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "drivers/system/program.hpp"

namespace birdseye::host {

namespace {

constexpr std::array kStates{CheckState::good, CheckState::could_be_better, CheckState::missing, CheckState::bad,
                             CheckState::not_known};

std::ptrdiff_t count_of(const std::vector<Check>& checks, CheckState state) {
  return std::count_if(checks.begin(), checks.end(), [&](const Check& check) { return check.state == state; });
}

}  // namespace

const char* name_of(CheckState state) {
  switch (state) {
    case CheckState::good:
      return "good";
    case CheckState::could_be_better:
      return "could be better";
    case CheckState::missing:
      return "missing";
    case CheckState::bad:
      return "bad";
    case CheckState::not_known:
      break;
  }
  return "not known";
}

bool any_bad(const std::vector<Check>& checks) {
  return count_of(checks, CheckState::bad) > 0;
}

std::string lines_of(const Check& check) {
  std::string text = in_one_line(fmt::format("  {:<15}  {}: {}", name_of(check.state), check.name, check.found)) + "\n";
  if (!check.remedy.empty()) text += in_one_line(fmt::format("  {:<15}  do: {}", "", check.remedy)) + "\n";
  return text;
}

std::string sum_of(const std::vector<Check>& checks) {
  std::string sum;
  for (const CheckState state : kStates) {
    const auto count = count_of(checks, state);
    if (count > 0) sum += fmt::format("{}{} {}", sum.empty() ? "" : ", ", count, name_of(state));
  }
  return sum.empty() ? "nothing was asked" : sum;
}

nlohmann::json check_json(const std::vector<Check>& checks) {
  nlohmann::json list = nlohmann::json::array(), counts = nlohmann::json::object();
  for (const Check& check : checks) {
    nlohmann::json one{
        {"area", check.area}, {"name", check.name}, {"state", name_of(check.state)}, {"found", check.found}};
    if (!check.remedy.empty()) one["do"] = check.remedy;
    list.push_back(std::move(one));
  }
  for (const CheckState state : kStates) counts[name_of(state)] = count_of(checks, state);
  return {{"checks", std::move(list)}, {"counts", std::move(counts)}};
}

}  // namespace birdseye::host
