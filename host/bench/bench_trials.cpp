#include "host/bench/bench_trials.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "calibration/base/median.hpp"
#include "drivers/system/child_process.hpp"
#include "drivers/system/clock.hpp"
#include "host/bench/bench_machine.hpp"
#include "host/bench/processor_time.hpp"
#include "host/case/registration_error.hpp"
#include "host/case/run_registration.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

/// A folder that goes when it is done with.
class ScratchFolder {
 public:
  ScratchFolder() : path_(fs::temp_directory_path() / fmt::format("birdseye-bench-{}", ::getpid())) {
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

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

}  // namespace

Result<RegistrationCase> simulate(const SimulatedCase& wanted) {
  const ScratchFolder scratch;
  const fs::path folder = scratch.path() / "case", log = scratch.path() / "log";
  std::vector<std::string> command{(fs::read_symlink("/proc/self/exe").parent_path() / "birdseye-sim").string(),
                                   "case",
                                   "--out",
                                   folder.string(),
                                   "--seed",
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
  if (wanted.plain_background) command.emplace_back("--plain-background");
  auto child = ChildProcess::start(command, log);
  if (!child) return child.error();
  constexpr Duration kPatience = Duration::from_ms(120'000);
  if (child->wait(Deadline::after(kPatience)) != 0) {
    std::ifstream in(log);
    std::string line;
    std::getline(in, line);
    return Error{Errc::bad_value, fmt::format("birdseye-sim case --seed {}: {}", wanted.seed, line)};
  }
  return read_case(folder / "case.toml");
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
  const auto found = run_registration(own, *transfer, false, [](const std::string&) {});
  if (!found) return found.error();
  Trial trial;
  trial.time_s = (host_now() - began).seconds();
  trial.processor_s = process_cpu_s() - processor_began_s;
  trial.evaluations = found->evaluations + found->gradient_evaluations;
  if (!c.truth) return Error{Errc::bad_value, "the case has no [truth] control_points; make it by birdseye-sim case"};
  trial.epsilon_before = epsilon(*c.truth, nullptr);
  trial.epsilon_after = epsilon(*c.truth, &found->field);
  const auto mean_mm = [&](const char* prefix, const DisplacementField* field) {
    const auto error = landmark_error(c.landmarks, prefix, field);
    return error ? error->mean_mm : 0;
  };
  trial.tre_before_mm = mean_mm("", nullptr);
  trial.tre_after_mm = mean_mm("", &found->field);
  trial.surface_after_mm = mean_mm("surface", &found->field);
  // Both lie inside the organ.
  const double tumour_mm = mean_mm("tumour", &found->field), vessels_mm = mean_mm("vessel", &found->field);
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
