#include "host/bench/bench_trials.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "calibration/base/median.hpp"
#include "drivers/system/clock.hpp"
#include "host/bench/bench_machine.hpp"
#include "host/bench/processor_time.hpp"
#include "host/bench/simulator_case.hpp"
#include "host/case/registration_error.hpp"
#include "host/case/run_registration.hpp"

namespace birdseye::host {

namespace {

double mean_of(const std::vector<Trial>& trials, double Trial::*field) {
  double sum = 0;
  for (const Trial& trial : trials) sum += trial.*field;
  return sum / static_cast<double>(std::max<std::size_t>(1, trials.size()));
}

double median_over(const std::vector<Trial>& trials, double Trial::*field) {
  std::vector<double> values;
  values.reserve(trials.size());
  for (const Trial& trial : trials) values.push_back(trial.*field);
  return median_of(std::move(values));
}

constexpr std::array<std::pair<const char*, double Trial::*>, 6> kErrors{
    {{"epsilon_before", &Trial::epsilon_before},
     {"epsilon_after", &Trial::epsilon_after},
     {"tre_before_mm", &Trial::tre_before_mm},
     {"tre_after_mm", &Trial::tre_after_mm},
     {"surface_after_mm", &Trial::surface_after_mm},
     {"inside_after_mm", &Trial::inside_after_mm}}};

}  // namespace

nlohmann::json json_of(const Trial& trial) {
  nlohmann::json out{{"evaluations", trial.evaluations}};
  for (const auto& [name, error] : kErrors) out[name] = trial.*error;
  return out;
}

Trial trial_of(const nlohmann::json& json) {
  Trial out;
  json.at("evaluations").get_to(out.evaluations);
  for (const auto& [name, error] : kErrors) json.at(name).get_to(out.*error);
  return out;
}

Result<RegistrationCase> simulate(const SimulatedCase& wanted) {
  std::vector<std::string> options{"--seed",
                                   std::to_string(wanted.seed),
                                   "--phantom",
                                   wanted.phantom,
                                   "--views",
                                   std::to_string(wanted.views),
                                   "--size",
                                   wanted.size,
                                   "--dof",
                                   fmt::format("{0}x{0}x{0}", wanted.inner),
                                   "--amplitude-mm",
                                   fmt::format("{}", wanted.amplitude_mm),
                                   "--noise",
                                   fmt::format("{}", wanted.noise),
                                   "--light-offset-mm",
                                   fmt::format("{}", wanted.light_offset_mm)};
  if (wanted.plain_background) options.emplace_back("--plain-background");
  const auto made = SimulatorCase::make(options);
  if (!made) return made.error();
  return read_case(made->folder() / "case.toml");
}

Result<Trial> try_once(const RegistrationCase& c, const Method& method) {
  const auto transfer = load_transfer_function(c.transfer);
  if (!transfer) return transfer.error();
  RegistrationCase own = c;
  own.optimiser = method.optimiser;
  own.similarity = method.similarity;
  own.most_evaluations = method.most_evaluations;
  const HostTime began = host_now();
  const double processor_began_s = process_cpu_s();
  const auto ran = run_registration(own, *transfer, false, [](const std::string&) {});
  if (!ran) return ran.error();
  const ViewRegistration& found = ran->found;
  Trial trial;
  trial.time_s = (host_now() - began).seconds();
  trial.processor_s = process_cpu_s() - processor_began_s;
  trial.evaluations = found.evaluations + found.gradient_evaluations;
  if (!c.truth) return Error{Errc::bad_value, "the case has no [truth] control_points; make it by birdseye-sim case"};
  trial.epsilon_before = epsilon(*c.truth, nullptr);
  trial.epsilon_after = epsilon(*c.truth, &found.field);
  const auto mean_mm = [&](const char* prefix, const DisplacementField* field) {
    const auto error = landmark_error(c.landmarks, prefix, field);
    return error ? error->mean_mm : 0;
  };
  trial.tre_before_mm = mean_mm("", nullptr);
  trial.tre_after_mm = mean_mm("", &found.field);
  trial.surface_after_mm = mean_mm("surface", &found.field);
  // Both lie inside the organ.
  const double tumour_mm = mean_mm("tumour", &found.field), vessels_mm = mean_mm("vessel", &found.field);
  trial.inside_after_mm = std::max(tumour_mm, vessels_mm);
  return trial;
}

Result<void> for_cases(SimulatedCase wanted, int count,
                       const std::function<Result<void>(const RegistrationCase&, int seed)>& work) {
  int made = 0;
  for (wanted.seed = 1; made < count; ++wanted.seed) {
    const auto c = simulate(wanted);
    if (!c && wanted.seed < 2 * count + 10) continue;
    if (!c) return c.error();
    if (auto done = work(*c, wanted.seed); !done) return done.with_context(fmt::format("seed {}", wanted.seed));
    ++made;
  }
  return {};
}

nlohmann::json summary_of(const std::vector<Trial>& trials) {
  std::vector<double> ratios, evaluations;
  for (const Trial& trial : trials) {
    ratios.push_back(trial.epsilon_after / trial.epsilon_before);
    evaluations.push_back(trial.evaluations);
  }
  const auto successes = std::count_if(ratios.begin(), ratios.end(), [](double r) { return r <= kSuccess; });
  std::vector<double> sorted = ratios;
  std::sort(sorted.begin(), sorted.end());
  return {{"trials", trials.size()},
          {"success_rate", static_cast<double>(successes) / static_cast<double>(trials.size())},
          {"epsilon_before_median", median_over(trials, &Trial::epsilon_before)},
          {"epsilon_after_median", median_over(trials, &Trial::epsilon_after)},
          {"epsilon_ratio_median", median_of(ratios)},
          {"epsilon_ratios", sorted},
          {"tre_before_mm_mean", mean_of(trials, &Trial::tre_before_mm)},
          {"tre_after_mm_mean", mean_of(trials, &Trial::tre_after_mm)},
          {"surface_tre_after_mm_mean", mean_of(trials, &Trial::surface_after_mm)},
          {"inside_tre_after_mm_mean", mean_of(trials, &Trial::inside_after_mm)},
          {"evaluations_median", median_of(evaluations)},
          {"time_s_median", median_over(trials, &Trial::time_s)},
          {"processor_s_median", median_over(trials, &Trial::processor_s)}};
}

}  // namespace birdseye::host
