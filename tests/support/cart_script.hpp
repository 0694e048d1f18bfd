#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <string>

#include "tests/support/command.hpp"
#include "tests/support/programs_folder.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::testing {

/// A simulated cart and the birdseyed that is configured for it.
struct ScriptedCart {
  int width_px = 192, height_px = 144;
  std::string simulator{};  ///< further options of `birdseye-sim cart`
  std::string camera{};     ///< further lines of the configuration's [camera]
  std::string sections{};   ///< further sections of the configuration
};

/// Starts both in the scratch folder, runs the commands there once the camera delivers, and ends both. In the commands
/// $bin is the folder of our programs, $server the appliance's HOST:PORT and $appliance birdseyed's process.
inline CommandResult run_at_cart(const Scratch& scratch, const ScriptedCart& cart, const std::string& commands) {
  static constexpr const char* kStart = R"(cd "$1"; bin=$2; server=127.0.0.1:$3; size=$4; simulator=$5
trap 'kill $(jobs -p) 2>/dev/null; wait' EXIT
$bin/birdseye-sim phantom --out phantom > phantom.log 2>&1 || exit 9
$bin/birdseye-sim cart --phantom phantom --socket cam --tty tty --out . --size $size $simulator > sim.log 2>&1 &
for n in $(seq 150); do grep -q ready sim.log && break; sleep 0.1; done
$bin/birdseyed --config cart.toml > birdseyed.log 2>&1 &
appliance=$!
for n in $(seq 150); do grep -q 'camera running' birdseyed.log && break; sleep 0.1; done
)";
  const std::string port = std::to_string(20000 + ::getpid() % 20000), width = std::to_string(cart.width_px),
                    height = std::to_string(cart.height_px);
  const std::string config = scratch.file(
      "cart.toml", "[tracker]\ndevice = \"" + (scratch / "tty").string() +
                       "\"\nbaud = 115200\nbirds = 2\nnames = [\"scope\", \"pointer\"]\n"
                       "rate_hz = 103.3\nfrozen_after = 0\nmost_speed_mm_s = 6000\nmost_turn_deg_s = 3000\n"
                       "hemisphere = \"forward\"\nrecord = \"position_matrix\"\ndelay_ms = 7.5\n[camera]\n"
                       "source = \"socket:" +
                       (scratch / "cam").string() + "\"\nwidth = " + width + "\nheight = " + height +
                       "\nrate_hz = 25\n" + cart.camera + cart.sections +
                       "[wire]\nbind = \"127.0.0.1\"\nport = " + port + "\n");
  EXPECT_TRUE(std::filesystem::exists(config));
  const std::string script = scratch.file("cart.sh", kStart + commands);
  // run() begins with one of our programs.
  return run("birdseye", "--help > /dev/null; bash " + script + " " + scratch.path().string() + " " +
                             programs_folder() + " " + port + " " + width + "x" + height + " '" + cart.simulator + "'");
}

}  // namespace birdseye::testing
