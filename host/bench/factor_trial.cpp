#include "host/bench/factor_trial.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "drivers/system/clock.hpp"
#include "host/bench/processor_time.hpp"
#include "host/bench/simulator_case.hpp"
#include "host/case/registration_verdict.hpp"
#include "host/case/run_registration.hpp"
#include "host/files/text_files.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// The poses of a case's views, exact: those beside the truth, where the case's own err.
Result<std::vector<Transform<Camera, Patient>>> true_poses(const fs::path& folder, const RegistrationCase& c) {
  std::vector<Transform<Camera, Patient>> out;
  for (std::size_t n = 0; n < c.views.size(); ++n) {
    const fs::path path = folder / "truth" / fmt::format("view{}.txt", n);
    if (!fs::exists(path)) {
      out.push_back(c.views[n].camera_from_patient);
      continue;
    }
    const auto matrix = read_pose(path);
    if (!matrix) return matrix.error();
    out.push_back(Transform<Camera, Patient>::from_matrix(*matrix));
  }
  return out;
}

json json_of(const PlacesError& error) {
  return {{"mean_mm", error.mean_mm}, {"rms_mm", error.rms_mm}};
}

json json_of(const ExpectedError& error) {
  return {{"rms_mm", error.rms_mm}, {"radius95_mm", error.radius95_mm}};
}

/// What was said of a kind of places.
std::optional<ExpectedError> said_of(const std::string& kind, const ExpectedErrors& expected) {
  if (kind == "surface") return expected.surface;
  if (kind == "seen") return expected.seen;
  if (kind == "hidden") return expected.hidden;
  return kind == "inside" ? expected.inside : std::nullopt;
}

json kinds_of(const FactorCase& c, const ViewRegistration* found) {
  json kinds;
  for (const auto& [kind, places] : c.places) {
    if (places.empty()) continue;
    json one{{"places", places.size()}, {"before", json_of(error_of(places, nullptr))}};
    if (found != nullptr) one["after"] = json_of(error_of(places, &found->field));
    const auto said = found != nullptr && found->expected ? said_of(kind, *found->expected) : std::nullopt;
    if (said) one["predicted"] = json_of(*said);
    kinds[kind] = one;
  }
  return kinds;
}

json target_of(const FactorCase& c, const ViewRegistration* found) {
  const TruePlace target{*c.given.target_mm, c.truth.deformed_of(*c.given.target_mm)};
  json one{{"before_mm", error_of({&target, 1}, nullptr).mean_mm}};
  if (found == nullptr) return one;
  const double error_mm = error_of({&target, 1}, &found->field).mean_mm;
  one["error_mm"] = error_mm;
  if (!found->expected || found->expected->targets.empty()) return one;
  const ExpectedError& said = found->expected->targets.front();
  one["predicted"] = json_of(said);
  one["outside"] = error_mm > said.radius95_mm;
  return one;
}

}  // namespace

Result<FactorCase> make_factor_case(const FactorClass& wanted, const std::string& size, int seed) {
  std::vector<std::string> options{"--seed", std::to_string(seed), "--size", size};
  options.insert(options.end(), wanted.options.begin(), wanted.options.end());
  const HostTime began = host_now();
  const auto made = SimulatorCase::make(options);
  if (!made) return made.error();
  const double generation_s = (host_now() - began).seconds();
  auto given = read_case(made->folder() / "case.toml");
  if (!given) return given.error();
  if (!given->target_mm)
    return Error{Errc::bad_value, "the simulator's case has no [target]; build both programs anew"};
  auto truth = read_field(made->folder() / "truth" / "field.mha");
  if (!truth) return truth.error();
  const auto poses = true_poses(made->folder(), *given);
  if (!poses) return poses.error();
  auto transfer = load_transfer_function(given->transfer);
  if (!transfer) return transfer.error();
  auto places = true_places(*given, *transfer, *truth, *poses);
  if (!places) return places.error();
  double off_mm = 0;
  for (const Landmark& landmark : given->landmarks)
    off_mm = std::max(off_mm, (truth->deformed_of(landmark.rest_mm) - landmark.deformed_mm).norm());
  return FactorCase{*std::move(given), *std::move(transfer), *std::move(places), *std::move(truth), off_mm,
                    generation_s};
}

json factor_trial(const FactorCase& c, const std::string& optimiser, bool one_thread) {
  RegistrationCase own = c.given;
  own.optimiser = optimiser;
  constexpr int kPapersEvaluations = 55;  // of simplex and powell
  own.most_evaluations = kPapersEvaluations;
  const HostTime began = host_now();
  const double processor_began_s = one_thread ? thread_cpu_s() : process_cpu_s();
  const auto ran = run_registration(own, c.transfer, true, [](const std::string&) {});
  const double processor_s = (one_thread ? thread_cpu_s() : process_cpu_s()) - processor_began_s;
  json trial{{"optimiser", optimiser},
             {"views", own.views.size()},
             {"generation_s", c.generation_s},
             {"truth_off_mm", c.truth_off_mm},
             {"registration_s", (host_now() - began).seconds()},
             {"processor_s", processor_s}};
  const ViewRegistration* const found = ran ? &ran->found : nullptr;
  trial["kinds"] = kinds_of(c, found);
  trial["target"] = target_of(c, found);
  if (found == nullptr) {
    trial["error"] = ran.error().what;
    trial["grade"] = name_of(Grade::fail);
    return trial;
  }
  const Verdict verdict = verdict_of(own, *found);
  trial["grade"] = name_of(verdict.grade);
  trial["reason"] = verdict.reasons.empty() ? "" : verdict.reasons.front();
  trial["min_jacobian"] = found->min_jacobian;
  if (found->stereo_points) trial["stereo_points"] = *found->stereo_points;
  if (found->uncertainty_mm) trial["uncertainty_mm"] = *found->uncertainty_mm;
  return trial;
}

}  // namespace birdseye::host
