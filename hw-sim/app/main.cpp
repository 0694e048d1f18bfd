#include <fmt/core.h>

#include <CLI/CLI.hpp>

#include "hw-sim/phantom/phantom.hpp"

int main(int argc, char** argv) {
  using namespace birdseye;
  CLI::App app{"birdseye-sim: a patient, a tracker and a laparoscope for the appliance, with known truth"};
  app.require_subcommand(1);
  int code = 0;
  const auto take = [&](const Result<void>& outcome) {
    if (outcome) return;
    fmt::print(stderr, "birdseye-sim: {}\n", outcome.error().what);
    code = 2;
  };

  hw_sim::PhantomSettings phantom;
  CLI::App& make = *app.add_subcommand("phantom", "write a patient: DICOM series, labels, surfaces, truth");
  make.add_option("--out", phantom.folder, "folder to write")->required();
  make.add_option("--seed", phantom.seed, "everything random follows from it");
  make.add_option("--ct", phantom.ct, "a CT to build on (NIfTI, NRRD, MHA) in place of the procedural body");
  make.add_option("--labels", phantom.labels, "organ labels of that CT")->needs("--ct");
  make.add_option("--liver-label", phantom.liver_label, "the liver's value in the labels");
  make.callback([&] { take(hw_sim::write_phantom(phantom)); });

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return code;
}
