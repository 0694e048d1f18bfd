#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <string>

#include "calibration/base/program.hpp"
#include "hw-sim/phantom/phantom.hpp"
#include "hw-sim/world/cart.hpp"

namespace {

std::atomic<bool> g_stop = false;

}  // namespace

int main(int argc, char** argv) {
  using namespace birdseye;
  CLI::App app{"birdseye-sim: a patient, a tracker and a laparoscope for the appliance, with known truth",
               "birdseye-sim"};
  app.require_subcommand(1);
  int code = 0;
  const auto take = [&](const Result<void>& outcome) {
    if (outcome) return;
    print_error("birdseye-sim", outcome.error().what);
    code = 2;
  };

  hw_sim::PhantomSettings phantom;
  CLI::App& make = *app.add_subcommand("phantom", "write a patient: DICOM series, labels, surfaces, truth");
  make.add_option("--out", phantom.folder, "folder to write")->required();
  make.add_option("--seed", phantom.seed, "everything random follows from it");
  make.add_option("--ct", phantom.ct,
                  "a CT to build on (DICOM folder, NIfTI, NRRD, MHA) in place of the procedural body");
  make.add_option("--labels", phantom.labels, "organ labels of that CT")->needs("--ct");
  make.add_option("--liver-label", phantom.liver_label, "the liver's value in the labels")->needs("--labels");
  make.callback([&] { take(hw_sim::write_phantom(phantom)); });

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
  run.add_option("--size", size, "WIDTHxHEIGHT of the video");
  run.add_option("--rate", cart.rate_hz, "frames a second")->check(CLI::Range(1.0, 120.0));
  run.callback([&] {
    if (std::sscanf(size.c_str(), "%dx%d", &cart.width_px, &cart.height_px) != 2 || cart.width_px < 64 ||
        cart.height_px < 64 || cart.width_px > 4096 || cart.height_px > 4096) {
      take(Error{Errc::bad_value, "--size: give WIDTHxHEIGHT of 64 to 4096 pixels, as 768x576"});
      return;
    }
    std::signal(SIGTERM, [](int) { g_stop = true; });
    std::signal(SIGINT, [](int) { g_stop = true; });
    take(hw_sim::run_cart(cart, g_stop));
  });

  return run_program(app, argc, argv, [&code] { return code; });
}
