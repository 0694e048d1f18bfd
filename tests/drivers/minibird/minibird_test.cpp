#include "drivers/minibird/minibird.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <deque>
#include <filesystem>

#include "calibration/geometry/transform.hpp"
#include "drivers/io/serial_port.hpp"
#include "drivers/minibird/assembler.hpp"
#include "drivers/system/clock.hpp"
#include "hw-sim/minibird/pseudo_terminal.hpp"
#include "hw-sim/minibird/unit.hpp"

namespace birdseye::drivers::minibird {
namespace {

/// A line with the simulator's electronics at its other end. The stream moves on when it is read, so no clock matters.
class UnitLine final : public ByteStream {
 public:
  explicit UnitLine(int birds)
      : unit_([&] {
          hw_sim::UnitSettings settings;
          settings.birds = birds;
          return settings;
        }()) {
    poses.resize(static_cast<std::size_t>(birds));
  }

  Result<std::size_t> read(std::span<std::uint8_t> into, Deadline /*deadline*/) override {
    if (unplugged) return Error{Errc::disconnected, "test: unplugged"};
    if (pending_.empty()) {
      for (const std::uint8_t byte : unit_.measure(poses)) pending_.push_back(byte);
      if (cut_to > 0 && !pending_.empty()) {
        for (auto& p : poses) p.position_mm.x() += 5;
        for (const std::uint8_t byte : unit_.measure(poses)) pending_.push_back(byte);
        pending_.erase(pending_.begin() + cut_from, pending_.begin() + cut_to);
        cut_to = 0;
      }
      if (lose_bytes > 0 && !pending_.empty()) {
        pending_.erase(pending_.begin() + 5);
        --lose_bytes;
      }
    }
    std::size_t n = 0;
    while (n < into.size() && !pending_.empty()) {
      into[n++] = pending_.front();
      pending_.pop_front();
    }
    return n;
  }
  Result<void> write(std::span<const std::uint8_t> bytes, Deadline /*deadline*/) override {
    if (silent) return {};
    for (const std::uint8_t byte : bytes) {
      for (const std::uint8_t reply : unit_.receive(byte)) pending_.push_back(reply);
    }
    return {};
  }
  void discard_input() override { pending_.clear(); }
  bool set_rts(bool asserted) override {
    if (asserted) unit_.reset();
    return has_rts;
  }
  [[nodiscard]] const std::string& name() const override { return name_; }

  std::vector<hw_sim::BirdPose> poses;
  bool silent = false, unplugged = false, has_rts = true;
  int lose_bytes = 0;
  int cut_from = 0, cut_to = 0;  ///< bytes cut out of the next two cycles

 private:
  hw_sim::Unit unit_;
  std::string name_ = "/dev/test";
  std::deque<std::uint8_t> pending_;
};

/// The conversation and what makes sense of it, as the appliance has them.
class Stream {
 public:
  Stream(std::unique_ptr<ByteStream> line, const MiniBirdSettings& settings)
      : bird_(MiniBird::start(std::move(line), settings)) {
    if (bird_) assembler_.emplace((*bird_)->layout());
  }
  explicit operator bool() const { return bird_.has_value(); }
  [[nodiscard]] const Error& error() const { return bird_.error(); }
  MiniBird& bird() { return **bird_; }
  [[nodiscard]] MiniBirdCounters counters() const { return assembler_->counters(); }
  Result<std::vector<Measurement>> read() {
    for (int tries = 0; tries < 10; ++tries) {
      const auto chunk = (*bird_)->read(device_now() + Duration::from_ms(100));
      if (!chunk) return chunk.error();
      if (!*chunk) continue;
      if (auto measurements = assembler_->push(**chunk); !measurements.empty()) return measurements;
    }
    return std::vector<Measurement>();
  }

 private:
  Result<std::unique_ptr<MiniBird>> bird_;
  std::optional<MeasurementAssembler> assembler_;
};

MiniBirdSettings quick(int birds) {
  MiniBirdSettings settings;
  settings.birds = birds;
  settings.plausibility.frozen_after = 0;  // the line's sensors have no noise
  settings.reset_hold = settings.reset_settle = settings.configure_wait = settings.bus_reset_wait =
      settings.run_wait = {};
  settings.quiet = Duration::from_ms(3);
  settings.reply_timeout = settings.answer_within = Duration::from_ms(20);
  return settings;
}

hw_sim::BirdPose pose(double x, double y, double z, double turn) {
  return {rotation_exp(Eigen::Vector3d(0.3, -0.5, turn)), Eigen::Vector3d(x, y, z)};
}

TEST(MiniBird, StreamsTheTruePosesInEveryFormat) {
  for (const char* name : {"position_angles", "position_matrix", "position_quaternion"}) {
    auto line = std::make_unique<UnitLine>(2);
    line->poses = {pose(300, -50, 120, 0.4), pose(210, 90, -60, -1.1)};
    const auto truth = line->poses;
    MiniBirdSettings settings = quick(2);
    settings.format = *record_format_of(name);
    Stream bird(std::move(line), settings);
    ASSERT_TRUE(bird) << bird.error().what;
    EXPECT_EQ(bird.bird().info().model, "6DFOB");
    EXPECT_EQ(bird.bird().info().latched_error, "");
    EXPECT_EQ(bird.bird().info().revision_major, 3);  // 03 43
    EXPECT_EQ(bird.bird().info().revision_minor, 67);
    EXPECT_EQ(bird.bird().info().crystal_mhz, 40);             // 28 00
    EXPECT_DOUBLE_EQ(bird.bird().info().rate_hz, 103.296875);  // 4C 67
    // The first after a start waits to be confirmed.
    EXPECT_EQ(bird.read()->front().birds[0].kind, DoubtKind::unconfirmed);
    for (int cycle = 0; cycle < 5; ++cycle) {
      const auto read = bird.read();
      ASSERT_TRUE(read);
      ASSERT_EQ(read->size(), 1U);
      for (std::size_t i = 0; i < 2; ++i) {
        ASSERT_TRUE(read->front().birds[i].pose) << name;
        // Four counts of position; of a matrix word, four counts are 0.007 degrees, of an angle 0.09.
        EXPECT_LT((*read->front().birds[i].pose->position_mm - truth[i].position_mm).cwiseAbs().maxCoeff(), 0.12);
        EXPECT_LT(rotation_angle_between(*read->front().birds[i].pose->rotation, truth[i].rotation), 2e-3) << name;
      }
    }
  }
}

TEST(MiniBird, WorksOnALineWithoutReset) {
  auto line = std::make_unique<UnitLine>(1);
  line->has_rts = false;
  line->poses = {pose(300, 0, 0, 0)};
  Stream bird(std::move(line), quick(1));
  ASSERT_TRUE(bird) << bird.error().what;
  EXPECT_FALSE(bird.bird().info().has_reset_line);
  EXPECT_EQ(bird.read()->size(), 1U);
}

TEST(MiniBird, ASilentTrackerIsAnErrorThatNamesPortAndRemedy) {
  auto line = std::make_unique<UnitLine>(1);
  line->silent = true;
  Stream bird(std::move(line), quick(1));
  ASSERT_FALSE(bird);
  EXPECT_EQ(bird.error().code, Errc::timeout);
  EXPECT_NE(bird.error().what.find("/dev/test"), std::string::npos);
  EXPECT_NE(bird.error().what.find("power, cable"), std::string::npos);
}

TEST(MiniBird, AMissingBirdIsNamed) {
  Stream bird(std::make_unique<UnitLine>(2), quick(3));
  ASSERT_FALSE(bird);
  EXPECT_NE(bird.error().what.find("bird 3 of 3"), std::string::npos) << bird.error().what;
}

TEST(MiniBird, ALostByteCostsOneRecordNotTheStream) {
  auto owned = std::make_unique<UnitLine>(2);
  UnitLine& line = *owned;
  line.poses = {pose(300, 0, 0, 0), pose(250, 0, 0, 0)};
  Stream bird(std::move(owned), quick(2));
  ASSERT_TRUE(bird) << bird.error().what;
  line.lose_bytes = 1;
  int whole = 0, cycles = 0;
  while (cycles < 20) {
    const auto read = bird.read();
    ASSERT_TRUE(read);
    for (const Measurement& m : *read) {
      ++cycles;
      if (m.birds[0].pose && m.birds[1].pose) ++whole;
    }
  }
  EXPECT_EQ(bird.counters().phase_errors, 1U);
  EXPECT_GE(whole, 18);
}

TEST(MiniBird, RecordsOfTwoCyclesAreNotTakenForOne) {
  auto owned = std::make_unique<UnitLine>(2);
  UnitLine& line = *owned;
  line.poses = {pose(300, 0, 0, 0), pose(250, 0, 0, 0)};
  Stream bird(std::move(owned), quick(2));
  ASSERT_TRUE(bird) << bird.error().what;
  // Cut from within the second record of one cycle to within the first of the next: what is left is the first bird of
  // one cycle and the second bird of another.
  line.cut_from = 30;
  line.cut_to = 60;
  for (int cycles = 0; cycles < 8;) {
    const auto read = bird.read();
    ASSERT_TRUE(read);
    for (const Measurement& m : *read) {
      ++cycles;
      if (m.birds[0].pose && m.birds[1].pose) {
        EXPECT_LT(std::abs((m.birds[0].pose->position_mm->x() - m.birds[1].pose->position_mm->x()) - 50), 0.3);
      }
    }
    // The scene moves on with every cycle, both birds alike: a pair of two cycles would show.
    for (auto& p : line.poses) p.position_mm.x() += 5;
  }
  EXPECT_GE(bird.counters().phase_errors, 1U);
}

TEST(MiniBird, ASaturatedSensorGivesNoPose) {
  auto line = std::make_unique<UnitLine>(1);
  line->poses = {{Eigen::Matrix3d::Zero(), Eigen::Vector3d(100, 0, 0)}};
  Stream bird(std::move(line), quick(1));
  ASSERT_TRUE(bird) << bird.error().what;
  const auto read = bird.read();
  ASSERT_TRUE(read);
  EXPECT_FALSE(read->front().birds[0].pose);
  EXPECT_EQ(bird.counters().senseless_records, 1U);
}

TEST(MiniBird, ALostLineIsAnError) {
  auto owned = std::make_unique<UnitLine>(1);
  UnitLine& line = *owned;
  Stream bird(std::move(owned), quick(1));
  ASSERT_TRUE(bird) << bird.error().what;
  line.unplugged = true;
  EXPECT_EQ(bird.read().error().code, Errc::disconnected);
}

TEST(SerialPort, CarriesBytesAndSeesTheLineGo) {
  const auto link = std::filesystem::temp_directory_path() / ("birdseye-serial-" + std::to_string(::getpid()));
  auto terminal = std::make_unique<hw_sim::PseudoTerminal>(*hw_sim::PseudoTerminal::open(link));
  const auto port = SerialPort::open(link, 115200);
  ASSERT_TRUE(port) << port.error().what;
  EXPECT_FALSE((*port)->set_rts(true));
  EXPECT_EQ(SerialPort::open(link, 115200).error().code, Errc::in_use);
  const Bytes sent{0x11, 0x13, 0x00, 0xFF, 0x0D, 0x0A};  // what a line discipline would eat or change
  terminal->write(sent);
  std::array<std::uint8_t, 16> got;
  const auto count = (*port)->read(got, device_now() + Duration::from_ms(1000));
  ASSERT_TRUE(count);
  EXPECT_EQ(Bytes(got.begin(), got.begin() + static_cast<std::ptrdiff_t>(*count)), sent);
  EXPECT_EQ(*(*port)->read(got, device_now() + Duration::from_ms(10)), 0U);
  terminal.reset();
  EXPECT_EQ((*port)->read(got, device_now() + Duration::from_ms(1000)).error().code, Errc::disconnected);
}

TEST(SerialPort, NamesWhatCannotBeOpened) {
  EXPECT_EQ(SerialPort::open("/nonexistent", 115200).error().code, Errc::not_found);
  EXPECT_EQ(SerialPort::open("/dev/null", 115200).error().code, Errc::bad_value);
  EXPECT_NE(SerialPort::open("/dev/null", 1234).error().what.find("1234"), std::string::npos);
}

}  // namespace
}  // namespace birdseye::drivers::minibird
