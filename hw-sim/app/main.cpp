#include <CLI/CLI.hpp>
#include <string>

#include "drivers/system/interrupt.hpp"
#include "drivers/system/number_options.hpp"
#include "drivers/system/program.hpp"
#include "drivers/system/starter.hpp"
#include "hw-sim/app/campaign_command.hpp"
#include "hw-sim/app/instruments.hpp"
#include "hw-sim/app/kept_inputs.hpp"
#include "hw-sim/app/operation_command.hpp"
#include "hw-sim/case/registration_case.hpp"
#include "hw-sim/phantom/phantom.hpp"
#include "hw-sim/world/cart.hpp"

namespace {

constexpr const char* kDeformationKinds =
    "elastic (default), bezier, bend, push, compression, twist, breathing or pneumoperitoneum";

}  // namespace

int main(int argc, char** argv) {
  using namespace birdseye;
  CLI::App app{"birdseye-sim: a patient, a tracker and a laparoscope for the appliance, with known truth",
               "birdseye-sim"};
  app.set_version_flag("--version", "birdseye-sim " BIRDSEYE_VERSION);
  app.require_subcommand(1);
  bool end_with_stdin = false;
  OwnedThread watch;
  app.add_flag("--end-with-stdin", end_with_stdin,
               "end when standard input is closed: for a program that starts this one");
  app.parse_complete_callback([&] {
    if (end_with_stdin) watch = end_with_standard_input();
  });
  int code = 0;
  const auto take = [&](const Result<void>& outcome) {
    if (outcome) return;
    print_error("birdseye-sim", outcome.error().what);
    code = 2;
  };

  bool broken = false;
  hw_sim::add_operation_command(app, take, broken);
  hw_sim::add_campaign_command(app, take, broken);
  hw_sim::PhantomSettings phantom;
  CLI::App& make = *app.add_subcommand("phantom", "write a patient: DICOM series, labels, surfaces, truth");
  make.add_option("--out", phantom.folder, "folder to write")->required();
  make.add_option("--seed", phantom.seed, "everything random follows from it");
  make.add_option("--ct", phantom.ct,
                  "a CT to build on (DICOM folder, NIfTI, NRRD, MHA) in place of the procedural body");
  make.add_option("--labels", phantom.labels, "organ labels of that CT")->needs("--ct");
  make.add_option("--liver-label", phantom.liver_label, "the liver's value in the labels")->needs("--labels");
  make.callback([&] {
    // A slice stands for the series that it lies in.
    const auto kept = hw_sim::keep_inputs({phantom.folder / "ct", phantom.folder / "segmentation.nii.gz"},
                                          {phantom.ct, phantom.ct.parent_path(), phantom.labels});
    take(kept ? hw_sim::write_phantom(phantom) : kept);
  });

  hw_sim::CartSettings cart;
  std::string size = "768x576";
  CLI::App& run = *app.add_subcommand("cart", "run tracker and laparoscope over a patient, in real time");
  run.add_option("--phantom", cart.phantom, "folder of a patient")->required();
  run.add_option("--socket", cart.socket, "Unix socket for the camera's frames")->required();
  run.add_option("--tty", cart.tty, "name for the tracker's pseudo-terminal")->required();
  run.add_option("--out", cart.folder, "folder for cart.json and truth/")->required();
  run.add_option("--seed", cart.seed, "everything random follows from it");
  run.add_option("--position-noise-mm", cart.noise.position_mm, "per axis and record")->check(CLI::Range(0.0, 50.0));
  run.add_option("--angle-noise-deg", cart.noise.angle_deg, "per axis and record")->check(CLI::Range(0.0, 20.0));
  run.add_option("--deformation-mm", cart.deformation.amplitude_mm,
                 "how far the liver has moved since the CT, where it has moved most")
      ->check(CLI::Range(0.0, 30.0));
  std::string cart_deformation;
  run.add_option("--deformation", cart_deformation, kDeformationKinds);
  run.add_option("--distortion-mm", cart.distortion_mm, "largest displacement by metal in the room")
      ->check(CLI::Range(0.0, 500.0));
  run.add_option("--sway-s", cart.pace.sway_s, "how long the scope is first turned to and fro over the board")
      ->check(CLI::Range(0.0, 600.0));
  run.add_option("--camera-delay-ms", cart.camera_delay_ms,
                 "from exposure to arrival, of frames that then bear no stamp (default: stamped)")
      ->check(CLI::Range(0.0, 1000.0));
  run.add_option("--faults", cart.faults,
                 "script of faults of either instrument, and of what befalls the operation (TOML)");
  std::string fixed_on;
  run.add_option("--reference", fixed_on, "patient or table: fix a third bird on it")
      ->check(CLI::IsMember({"patient", "table"}));
  run.add_option("--size", size, "WIDTHxHEIGHT of the video");
  run.add_option("--dwell-s", cart.pace.dwell_s, "how long the scope is held still at each station over the board")
      ->check(CLI::Range(0.1, 20.0));
  run.add_option("--pause-s", cart.pace.pause_s,
                 "how long it then stays there, before the pointer touches the fiducials")
      ->check(CLI::Range(0.0, 600.0));
  run.add_flag("--drop-late", cart.drop_late, "leave out frames that are not traced in time, as a camera would");
  run.add_flag("--strokes", cart.pace.strokes, "after the fiducials, stroke the liver's face with the pointer");
  run.add_flag("--views", cart.pace.views, "hold the scope still at places about the liver, to keep views from");
  run.add_option("--look-s", cart.pace.look_s, "how long the scope then sweeps over the liver (default 7)")
      ->check(CLI::Range(1.0, 86400.0));
  run.add_option("--rate", cart.rate_hz, "frames a second")->check(CLI::Range(1.0, 120.0));
  run.callback([&] {
    for (const Result<void>& parsed : {hw_sim::parse_size(size, cart.width_px, cart.height_px),
                                       hw_sim::parse_deformation(cart_deformation, "", cart.deformation)}) {
      if (!parsed) {
        take(parsed);
        return;
      }
    }
    if (!fixed_on.empty())
      cart.reference = fixed_on == "patient" ? hw_sim::ReferenceOn::patient : hw_sim::ReferenceOn::table;
    const auto kept = hw_sim::keep_inputs({cart.folder / "cart.json", cart.folder / "truth/truth.json"}, {cart.faults});
    take(kept ? hw_sim::run_cart(cart, note_interrupts()) : kept);
  });

  hw_sim::add_minibird_command(app, take);
  hw_sim::add_ft232r_command(app, take);
  hw_sim::add_camera_command(app, take);

  hw_sim::CaseSettings registration;
  std::string dof, deformation;
  bool still = false;
  CLI::App& make_case =
      *app.add_subcommand("case", "write a registration case: CT at rest, views of it deformed, truth");
  make_case.add_option("--out", registration.folder, "folder to write")->required();
  make_case.add_option("--seed", registration.seed, "everything random follows from it");
  CLI::Option* const organ = make_case.add_option("--phantom", registration.phantom, "liver or head (default liver)");
  make_case.add_option("--ct", registration.ct, "a CT with a liver in place of the phantom")->excludes(organ);
  make_case.add_option("--labels", registration.labels, "organ labels of that CT")->needs("--ct");
  make_case.add_option("--liver-label", registration.liver_label, "the liver's value in the labels")->needs("--labels");
  make_case.add_option("--views", registration.views, "how many (default 5)");
  make_case.add_option("--size", size, "WIDTHxHEIGHT of the views (default 768x576)");
  make_case.add_option("--deformation", deformation, kDeformationKinds);
  make_case.add_option("--dof", dof,
                       "of bezier, which it implies: 3 (default), 24, 81.., or inner control points an axis as 3x3x3");
  make_case.add_option("--push-width-mm", registration.deformation.push_width_mm,
                       "of the dent of a push, at half its depth (default 40)");
  make_case.add_option("--amplitude-mm", registration.deformation.amplitude_mm,
                       "the largest move of the organ's surface (default 10)");
  make_case.add_flag("--no-deformation", still, "the same views of the organ at rest");
  make_case.add_option("--distance-mm", registration.distance_mm,
                       "about, from organ to lens (default as suits the organ)");
  make_case.add_option("--noise", registration.noise, "of the sensor, as a multiple of the usual (default 1)");
  make_case.add_option("--light-offset-mm", registration.lamp_offset_mm, "of the lamp, to the right of the lens");
  make_case.add_flag("--plain-background", registration.plain_background, "black in place of the cavity's wall");
  make_case.add_option("--texture", registration.texture, "contrast of the organ's pattern, of the usual (default 1)");
  make_case.add_option("--wet", registration.wet, "highlights, as a multiple of the usual (default 1)");
  make_case.add_option("--blood", registration.blood, "share of the organ's surface that it covers (default 0)");
  make_case.add_option("--instruments", registration.instruments, "before the organ, 0 to 3 (default 0)");
  make_case.add_option("--blur-px", registration.blur_px, "of the lens, a Gaussian's sigma (default 0)");
  hw_sim::PoseError& pose = registration.pose_error;
  make_case.add_option("--pose-noise-mm", pose.noise_mm, "of the tracker's sensor, per axis and view (default 0)");
  make_case.add_option("--pose-noise-deg", pose.noise_deg, "likewise");
  make_case.add_option("--pose-offset-mm", pose.offset_mm, "of hand-eye, the same in all views (default 0)");
  make_case.add_option("--pose-offset-deg", pose.offset_deg, "likewise");
  make_case.add_option("--touches", registration.touches,
                       "how many places of the surface that no view sees points.csv has (default 0)");
  make_case.add_option("--touch-noise-mm", registration.touch_noise_mm, "of theirs, per axis (default 1)");
  make_case.callback([&] {
    for (const Result<void>& parsed : {hw_sim::parse_size(size, registration.width_px, registration.height_px),
                                       hw_sim::parse_deformation(deformation, dof, registration.deformation)}) {
      if (!parsed) {
        take(parsed);
        return;
      }
    }
    if (still) registration.deformation.amplitude_mm = 0;
    const auto kept =
        hw_sim::keep_inputs({registration.folder / "ct.nii.gz", registration.folder / "segmentation.nii.gz"},
                            {registration.ct, registration.labels});
    take(kept ? hw_sim::write_case(registration) : kept);
  });

  refuse_odd_numbers(app);
  return run_program<CLI::ParseError>(
      app, argc, argv, [&] { return code == 0 && broken ? static_cast<int>(ExitCode::verdict_fail) : code; });
}
