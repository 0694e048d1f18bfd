#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "calibration/solve/point_fit.hpp"
#include "host/app/commands.hpp"
#include "host/app/text_files.hpp"
#include "host/app/write_files.hpp"

namespace birdseye::host {

namespace {

struct Options {
  std::filesystem::path ct, tracker, out, json;
};

/// What a fiducial registration error means for a skin-marker registration of the liver, in words.
std::pair<std::string, std::string> verdict_of(double fre_rms_mm) {
  constexpr double kPassMm = 2, kMarginalMm = 5;
  if (fre_rms_mm <= kPassMm)
    return {"pass", fmt::format("fiducial registration error {:.2f} mm, at most {} mm", fre_rms_mm, kPassMm)};
  if (fre_rms_mm <= kMarginalMm) {
    return {"marginal", fmt::format("fiducial registration error {:.2f} mm, over {} mm: touch the worst marker again",
                                    fre_rms_mm, kPassMm)};
  }
  return {"fail", fmt::format("fiducial registration error {:.2f} mm, over {} mm: are the points in the same order?",
                              fre_rms_mm, kMarginalMm)};
}

Result<ExitCode> register_fiducials(const Options& options) {
  if (options.out.empty()) return Error{Errc::bad_value, "--out: is empty; name the file to write"};
  const auto ct = read_points(options.ct);
  if (!ct) return ct.error();
  const auto tracker = read_points(options.tracker);
  if (!tracker) return tracker.error();
  const auto fit = calibration::fit_points<Patient, Tracker>(*ct, *tracker);
  if (!fit) {
    return Error{fit.error().code,
                 fmt::format("{}, {}: {}", options.ct.string(), options.tracker.string(), fit.error().what)};
  }
  const auto [verdict, reason] = verdict_of(fit->fre_rms_mm);
  nlohmann::json json;
  json["fre_rms_mm"] = fit->fre_rms_mm;
  json["residuals_mm"] = fit->residuals_mm;
  json["leave_one_out_mm"] = fit->leave_one_out_mm;
  const Eigen::Matrix4d m = fit->to_from.matrix();
  for (int i = 0; i < 4; ++i) json["patient_from_tracker"].push_back({m(i, 0), m(i, 1), m(i, 2), m(i, 3)});
  json["verdict"] = verdict;
  json["reasons"] = {reason};
  if (auto written = write_files({{options.out, pose_text(fit->to_from.matrix())}, {options.json, text_of(json)}});
      !written) {
    return written.error();
  }
  for (std::size_t i = 0; i < ct->size(); ++i) {
    fmt::print("fiducial {:2}  residual {:6.3f} mm", i + 1, fit->residuals_mm[i]);
    if (!fit->leave_one_out_mm.empty()) fmt::print("  left out {:6.3f} mm", fit->leave_one_out_mm[i]);
    fmt::print("\n");
  }
  fmt::print("FRE {:.4f} mm rms: {} ({})\n", fit->fre_rms_mm, verdict, reason);
  return verdict == "fail" ? ExitCode::verdict_fail : ExitCode::success;
}

}  // namespace

void add_register(CLI::App& app, CommandStatus& status) {
  const auto options = std::make_shared<Options>();
  CLI::App& reg = *app.add_subcommand("register", "bring a CT and the patient together");
  reg.require_subcommand(1);
  CLI::App& fiducials = *reg.add_subcommand("fiducials", "rigidly, by corresponding points");
  fiducials.add_option("--ct", options->ct, "markers in the CT: x y z a line, mm, patient frame")->required();
  fiducials.add_option("--tracker", options->tracker, "the same markers as touched, in the same order, tracker frame")
      ->required();
  fiducials.add_option("--out", options->out, "patient_from_tracker, a 4x4 matrix")->required();
  fiducials.add_option("--json", options->json, "write the figures to this file");
  fiducials.callback([options, &status] {
    const auto done = register_fiducials(*options);
    done ? void(status.code = *done) : status.refuse(done.error());
  });
}

}  // namespace birdseye::host
