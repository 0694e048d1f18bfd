#include "device/birdseyed/core.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "device/birdseyed/event_queue.hpp"
#include "device/birdseyed/recording.hpp"
#include "device/wire/foreign_messages.hpp"
#include "drivers/system/clock.hpp"
#include "tests/support/core_session.hpp"
#include "tests/support/example_record.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::device {
namespace {

using birdseye::testing::at;
using birdseye::testing::camera_runs;
using birdseye::testing::frame;
using birdseye::testing::kZeroNs;
using birdseye::testing::only;
using birdseye::testing::session;
using birdseye::testing::told;
using birdseye::testing::tracker_runs;
using birdseye::testing::TrackerBytesSource;
using birdseye::testing::unpacked;

std::vector<wire::Event> told(const std::vector<RawEvent>& events, const CoreSettings& settings = {}) {
  Core core(settings);
  return told(core, events);
}

TEST(Core, EachFrameHasThePoseOfItsOwnTime) {
  for (const int wait_ms : {0, 60}) {
    CoreSettings settings;
    settings.pose_wait = Duration::from_ms(wait_ms);
    const auto frames = only<wire::VideoFrame>(told(session(8, 1), settings));
    ASSERT_GT(frames.size(), 190U);
    std::size_t good = 0;
    for (const auto& f : frames) {
      if (!f.info.pose.tracker_from_sensor) continue;
      ++good;
      const double taken_s = static_cast<double>(f.info.sequence) / 25;
      const Eigen::Vector3d true_mm = TrackerBytesSource::pose_at(taken_s).position_mm;
      // 628 mm/s: a millisecond is 0.6 mm.
      if (taken_s < 3) continue;
      EXPECT_LT((f.info.pose.tracker_from_sensor->translation() - true_mm).norm(), 0.7) << taken_s;
    }
    EXPECT_GT(good, frames.size() - 5);
  }
}

/// Frames that are stamped 83.1 ms late, as the record in force says.
TEST(Core, TheRecordsLatencyIsTakenOffTheFramesTimes) {
  CoreSettings settings;
  settings.calibration =
      calibration::record_text(testing::example_record(4, 2, {{"model", "miniBIRD"}}, {{"card", "C"}}));
  auto tracker = tracker_runs(0);
  tracker.identity = {{"model", "miniBIRD"}};
  auto camera = camera_runs(0);
  camera.identity = {{"card", "C"}};
  auto events = session(8, 1);
  std::erase_if(events, [](const RawEvent& event) { return std::holds_alternative<InstrumentChanged>(event); });
  events.insert(events.begin(), {tracker, camera});
  constexpr double kLate_s = 0.0831;
  for (RawEvent& event : events) {
    if (auto* came = std::get_if<FrameCame>(&event)) {
      came->frame.acquired = came->frame.acquired + Duration::from_seconds(kLate_s);
      came->frame.arrived = came->frame.arrived + Duration::from_seconds(kLate_s);
    }
  }
  std::stable_sort(events.begin(), events.end(), [](const auto& a, const auto& b) { return time_of(a) < time_of(b); });
  const auto frames = only<wire::VideoFrame>(told(events, settings));
  std::size_t good = 0;
  for (const auto& f : frames) {
    const double taken_s = static_cast<double>(f.info.sequence) / 25;
    if (!f.info.pose.tracker_from_sensor || taken_s < 3) continue;
    ++good;
    ASSERT_TRUE(f.info.latency.has_value());
    EXPECT_NEAR(f.info.latency->seconds(), kLate_s, 1e-9);
    EXPECT_NEAR(f.info.acquired_sigma.seconds(), std::hypot(1e-4, 1e-3 / 3.92), 1e-6);
    const Eigen::Vector3d true_mm = TrackerBytesSource::pose_at(taken_s).position_mm;
    EXPECT_LT((f.info.pose.tracker_from_sensor->translation() - true_mm).norm(), 0.7) << taken_s;
  }
  EXPECT_GT(good, 100U);
  EXPECT_FALSE(only<wire::VideoFrame>(told(session(1, 1)))[0].info.latency.has_value()) << "nobody measured it";
}

TEST(Core, ANoticeIsSaidInStatusAndIsNothingAmiss) {
  CoreSettings settings;
  settings.notice = "the wire is plain";
  InstrumentChanged gone = camera_runs(0);
  gone.state = InstrumentState::absent;
  const auto statuses = only<wire::Status>(told({gone, camera_runs(0.1)}, settings));
  ASSERT_GE(statuses.size(), 2U);
  EXPECT_FALSE(statuses.front().ok);
  EXPECT_NE(statuses.front().text.find("; the wire is plain"), std::string::npos) << statuses.front().text;
  EXPECT_TRUE(statuses.back().ok);
  EXPECT_EQ(statuses.back().text, "the wire is plain");
}

TEST(Core, ACameraThatCountsFromElsewhereHasLostNothing) {
  Core core({});
  for (RawEvent event : session(4, 1)) {
    if (auto* const came = std::get_if<FrameCame>(&event); came != nullptr && came->frame.sequence >= 50)
      came->frame.sequence += drivers::kMostSequence / 2;
    (void)core.take(event);
  }
  EXPECT_GT(core.counters().frames, 90U);
  EXPECT_EQ(core.counters().frames_lost, 0U);
}

TEST(Core, PosesWhoseTimeIsInDoubtAreNotPublished) {
  Core core({});
  wire::Unpacker unpacker;
  std::vector<wire::Event> said;
  // At the very start the beat is not known at all. Then ten records are lost whole, which the bytes do not show.
  int n = 0, published_after = 0;
  for (const RawEvent& event : session(8, 5)) {
    const bool bytes = std::holds_alternative<TrackerBytes>(event);
    if (bytes && ++n >= 500 && n < 510) continue;
    const auto birds = only<wire::Birds>(unpacked(core.take(event), unpacker));
    if (bytes && n < 3) {
      EXPECT_TRUE(birds.empty()) << n;
    }
    published_after += n >= 510 ? static_cast<int>(birds.size()) : 0;
    for (const auto& b : birds) {
      const double at_s = static_cast<double>(b.acquired.ns - kZeroNs) * 1e-9;
      const Eigen::Vector3d true_mm = TrackerBytesSource::pose_at(at_s).position_mm;
      // 628 mm/s: a lost measurement is 6 mm.
      EXPECT_LT((b.birds.at(0).tracker_from_sensor.translation() - true_mm).norm(), 1.5) << n;
    }
  }
  EXPECT_GT(published_after, 270);
  EXPECT_EQ(core.counters().tracker.lost_measurements, 10U);
  EXPECT_GE(core.counters().clock_events, 1U);
  EXPECT_NE(core.counters().tracker_drift_ppm, 0);
}

TEST(Core, BesideTdataEachBirdHasATransformUnlessSwitchedOff) {
  for (const bool transforms : {true, false}) {
    CoreSettings settings;
    settings.transforms = transforms;
    Core core(settings);
    wire::Unpacker unpacker;
    int poses = 0;
    for (const RawEvent& event : session(3, 1)) {
      for (const wire::Packet& packet : core.take(event)) {
        if (packet.kind != wire::Packet::Kind::tracking) continue;
        ++poses;
        const auto messages = birdseye::testing::messages_of(packet);
        const auto first = *unpacker.push(messages.at(0));
        const auto birds = std::get<wire::Birds>(std::get<wire::Event>(*first));
        ASSERT_EQ(messages.size(), transforms ? 1 + birds.birds.size() : 1);
        if (!transforms) continue;
        const std::span message(messages.at(1));
        const auto header = *wire::read_header(message, wire::kLargestBody);
        EXPECT_EQ(header.type, "TRANSFORM");
        EXPECT_EQ(header.device, "ScopeToTracker");
        EXPECT_EQ(header.time.ns, birds.acquired.ns);
        const auto read = wire::read_foreign(header, message.subspan(wire::kHeaderBytes));
        ASSERT_TRUE(read) << read.error().what;
        const auto& told = std::get<wire::ForeignPoses>(*read);
        ASSERT_EQ(told.birds.size(), 1U);
        EXPECT_EQ(told.birds[0].tracker_from_sensor.matrix(), birds.birds[0].tracker_from_sensor.matrix());
      }
    }
    EXPECT_GT(poses, 200);
  }
}

TEST(Core, TheSameEventsGiveTheSameBytes) {
  const auto events = session(3, 2);
  Core a({}), b({});
  for (const RawEvent& event : events) {
    const auto from_a = a.take(event);
    const auto from_b = b.take(event);
    ASSERT_EQ(from_a.size(), from_b.size());
    for (std::size_t i = 0; i < from_a.size(); ++i) EXPECT_EQ(from_a[i].bytes(), from_b[i].bytes());
  }
}

TEST(Core, WithoutMeasurementsAFrameLeavesAndSaysWhy) {
  std::vector<RawEvent> events{camera_runs(0)};
  for (std::uint64_t n = 0; n < 5; ++n) events.emplace_back(FrameCame{frame(n, 0.04 * static_cast<double>(n), 0.1)});
  const auto frames = only<wire::VideoFrame>(told(events));
  ASSERT_EQ(frames.size(), 5U);
  for (const auto& f : frames) {
    EXPECT_EQ(f.info.pose.kind, PoseKind::refused);
    EXPECT_FALSE(f.info.pose.reason.empty());
  }
}

TEST(Core, AFrameWaitsForPosesNoLongerThanItMay) {
  CoreSettings settings;
  settings.pose_wait = Duration::from_ms(60);
  Core core(settings);
  core.take(camera_runs(0));
  const auto is_frame = [](const std::vector<wire::Packet>& packets) {
    return std::any_of(packets.begin(), packets.end(),
                       [](const wire::Packet& p) { return p.kind == wire::Packet::Kind::frame; });
  };
  EXPECT_FALSE(is_frame(core.take(FrameCame{frame(0, 1.0, 1.02)})));
  EXPECT_TRUE(core.waiting());
  EXPECT_FALSE(is_frame(core.take(Tick{at(1.07)})));
  EXPECT_TRUE(is_frame(core.take(Tick{at(1.0801)})));
  EXPECT_FALSE(core.waiting());
}

TEST(Core, AFrameThatCameBeforeIsCountedAndNotSentAgain) {
  Core core({});
  wire::Unpacker unpacker;
  core.take(camera_runs(0));
  std::vector<std::uint64_t> sent;
  for (const std::uint64_t number : {0U, 1U, 1U, 2U, 2U, 0U}) {  // the last: it counts anew
    for (const auto& image : only<wire::VideoFrame>(unpacked(core.take(FrameCame{frame(number, 1, 1.02)}), unpacker)))
      sent.push_back(image.info.sequence);
  }
  EXPECT_EQ(sent, (std::vector<std::uint64_t>{0, 1, 2, 0}));
  EXPECT_EQ(core.counters().frames_repeated, 2U);
  EXPECT_EQ(core.counters().frames, 4U);
}

TEST(Core, StampsThatJumpAreAnEventOfTheClock) {
  Core core({});
  wire::Unpacker unpacker;
  core.take(camera_runs(0));
  std::vector<wire::ClockChange> told;
  for (std::uint64_t n = 0; n < 100; ++n) {
    const double taken = static_cast<double>(n) / 25;
    const FrameCame came{frame(n, n < 50 ? taken : taken + 0.02, taken + 0.03)};
    for (const auto& change : only<wire::ClockChange>(unpacked(core.take(came), unpacker))) told.push_back(change);
  }
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].clock, "camera");
  EXPECT_EQ(told[0].kind, "step");
  EXPECT_NEAR(told[0].by.seconds(), 0.02, 0.001);
  EXPECT_EQ(core.counters().clock_events, 1U);
}

/// By such a stamp video that has stopped would seem fresh for as long as it lies ahead.
TEST(Core, StampsAheadOfTheClockAreRefusedAndSaid) {
  Core core({});
  wire::Unpacker unpacker;
  core.take(camera_runs(0));
  std::vector<wire::Status> said;
  const auto frame_of = [&](std::uint64_t n, double ahead_s) {
    const double arrived = static_cast<double>(n) / 25;
    const auto events = unpacked(core.take(FrameCame{frame(n, arrived + ahead_s, arrived)}), unpacker);
    for (const auto& status : only<wire::Status>(events)) said.push_back(status);
    return only<wire::VideoFrame>(events).at(0).info;
  };
  EXPECT_EQ(frame_of(0, -0.03).acquired.ns, at(-0.03).ns);
  EXPECT_EQ(core.board().state(), ApplianceState::ready);
  const wire::FrameInfo ahead = frame_of(1, 2);
  EXPECT_EQ(ahead.acquired.ns, ahead.arrived.ns) << "it was exposed no later";
  EXPECT_EQ(ahead.pose.kind, PoseKind::refused);
  EXPECT_NE(ahead.pose.reason.find("2000 ms ahead of the clock"), std::string::npos) << ahead.pose.reason;
  EXPECT_EQ(core.board().state(), ApplianceState::degraded);
  ASSERT_FALSE(said.empty());
  EXPECT_EQ(said.back().text, "the camera's stamps lie 2000 ms ahead of the clock");
  for (std::uint64_t n = 2; n < 30; ++n) frame_of(n, -0.03);
  EXPECT_EQ(core.board().state(), ApplianceState::ready);
  EXPECT_TRUE(said.back().ok) << said.back().text;
}

TEST(Core, StampsAheadThatJitterAreSaidOnce) {
  Core core({});
  wire::Unpacker unpacker;
  core.take(camera_runs(0));
  std::size_t said = 0;
  for (std::uint64_t n = 0; n < 100; ++n) {
    const double arrived_s = static_cast<double>(n) / 25;
    const double ahead_s = 2 + 0.03 * static_cast<double>(n % 7);
    const auto events = unpacked(core.take(FrameCame{frame(n, arrived_s + ahead_s, arrived_s)}), unpacker);
    for (const auto& status : only<wire::Status>(events)) said += status.ok ? 0 : 1;
  }
  EXPECT_EQ(said, 1U);
  EXPECT_EQ(core.board().state(), ApplianceState::degraded);
}

TEST(Core, AnInstrumentThatGoesIsSaidOnceAndItsFramesHaveNoPose) {
  auto events = session(4, 3);
  const auto gone = [](const RawEvent& e) { return std::holds_alternative<TrackerBytes>(e) && time_of(e) > at(2); };
  std::erase_if(events, gone);
  events.insert(std::find_if(events.begin(), events.end(), [](const RawEvent& e) { return time_of(e) > at(2); }),
                InstrumentChanged{.instrument = Instrument::tracker,
                                  .state = InstrumentState::absent,
                                  .text = "the line is gone",
                                  .at = at(2)});
  const auto said = told(events);
  int times = 0;
  for (const auto& status : only<wire::Status>(said)) times += status.text == "the line is gone" ? 1 : 0;
  EXPECT_EQ(times, 1);
  for (const auto& f : only<wire::VideoFrame>(said)) {
    if (static_cast<double>(f.info.sequence) / 25 < 2.2) continue;
    EXPECT_EQ(f.info.pose.kind, PoseKind::refused);
  }
}

TEST(Core, APedalIsPassedOnWithItsTime) {
  const auto pedals = only<wire::Pedal>(told({EdgesCame{{{drivers::GpioInput::pedal, true, at(1)}}, at(1.001)}}));
  ASSERT_EQ(pedals.size(), 1U);
  EXPECT_TRUE(pedals[0].pressed);
  EXPECT_EQ(pedals[0].at, at(1));
}

TEST(Recording, ReplaysToTheSameBytes) {
  auto events = session(3, 4);
  events.insert(events.begin() + 100, Tick{at(0.9)});
  events.insert(
      events.begin() + 200,
      EdgesCame{{{drivers::GpioInput::pedal, true, at(1)}, {drivers::GpioInput::strobe, false, at(1)}}, at(1)});
  CoreSettings settings;
  settings.pose.smoothing = Duration::from_ms(40);
  settings.pose_wait = Duration::from_ms(60);
  const birdseye::testing::Scratch scratch;
  const auto path = scratch / "session.berec";
  {
    std::ofstream out(path, std::ios::binary);
    const auto put = [&out](const Bytes& bytes) {
      out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    };
    put(recording_magic());
    put(block_of(settings));
    for (const RawEvent& event : events) put(block_of(event));
  }
  auto reader = RawEventReader::open(path);
  ASSERT_TRUE(reader) << reader.error().what;
  Core live(settings), again(reader->settings());
  for (const RawEvent& event : events) {
    const auto read = reader->next();
    ASSERT_TRUE(read && *read);
    const auto a = live.take(event);
    const auto b = again.take(**read);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) ASSERT_EQ(a[i].bytes(), b[i].bytes());
  }
  EXPECT_FALSE(*reader->next());
  EXPECT_FALSE(reader->cut_short());
}

TEST(Recording, IsGoodUpToWhereItWasCutOrDamaged) {
  Bytes whole = recording_magic();
  const auto put = [&whole](const Bytes& bytes) { whole.insert(whole.end(), bytes.begin(), bytes.end()); };
  put(block_of(CoreSettings{}));
  std::vector<std::size_t> ends;
  for (int i = 0; i < 20; ++i) {
    put(block_of(RawEvent(TrackerBytes{{{0x80, 1, 2, static_cast<std::uint8_t>(i)}, at(i)}})));
    ends.push_back(whole.size());
  }
  const birdseye::testing::Scratch scratch;
  std::mt19937 rng(5);
  for (int trial = 0; trial < 300; ++trial) {
    Bytes bytes = whole;
    const std::size_t place = kMagicBytes + block_of(CoreSettings{}).size() + rng() % (whole.size() - ends[0]);
    const bool cut = trial % 2 == 0;
    if (cut) {
      bytes.resize(place);
    } else {
      bytes[place] ^= static_cast<std::uint8_t>(1U << rng() % 8);
    }
    const auto path = scratch.file("r.berec", {bytes.begin(), bytes.end()});
    auto reader = RawEventReader::open(path);
    ASSERT_TRUE(reader);
    const auto whole_blocks = std::count_if(ends.begin(), ends.end(), [&](std::size_t end) { return end <= place; });
    std::ptrdiff_t read = 0;
    for (;; ++read) {
      const auto event = reader->next();
      if (!event || !*event) break;
      ASSERT_EQ(std::get<TrackerBytes>(**event).chunk.bytes.back(), read);
    }
    EXPECT_EQ(read, whole_blocks) << place;
  }
}

/// What a file of these says: the reader's error, or nothing.
std::string refusal(const CoreSettings& settings, const std::vector<RawEvent>& events) {
  const birdseye::testing::Scratch scratch;
  Bytes bytes = recording_magic();
  const auto put = [&bytes](const Bytes& more) { bytes.insert(bytes.end(), more.begin(), more.end()); };
  put(block_of(settings));
  for (const RawEvent& event : events) put(block_of(event));
  auto reader = RawEventReader::open(scratch.file("r.berec", {bytes.begin(), bytes.end()}));
  if (!reader) return reader.error().what;
  const auto next = reader->next();
  return next ? "" : next.error().what;
}

std::string refusal(const RawEvent& event) {
  return refusal(CoreSettings{}, {event});
}

TEST(Recording, OfSettingsThatMakeNoSenseIsRefused) {
  EXPECT_EQ(refusal(CoreSettings{}, {}), "");
  const auto with = [](auto change) {
    CoreSettings settings;
    change(settings);
    return refusal(settings, {});
  };
  EXPECT_NE(with([](auto& s) { s.bird_names.clear(); }).find("0 names of birds"), std::string::npos);
  EXPECT_NE(with([](auto& s) { s.bird_names.assign(15, "b"); }).find("15 names"), std::string::npos);
  EXPECT_NE(with([](auto& s) { s.bird_names = {""}; }).find("without a name"), std::string::npos);
  // As TDATA carries them.
  EXPECT_NE(with([](auto& s) {
              s.bird_names = {"scope", "table-reference-left-hand-pointer", "table-reference-left"};
            }).find("two birds of one name"),
            std::string::npos);
  EXPECT_NE(with([](auto& s) { s.pose.capacity = 0; }).find("limits of poses"), std::string::npos);
  EXPECT_NE(with([](auto& s) { s.frame_clock.rate_hz = 0; }).find("rate of 0 Hz"), std::string::npos);
  EXPECT_NE(with([](auto& s) { s.pose_wait = {-1}; }).find("a time of"), std::string::npos);
}

TEST(Recording, OfALayoutThatMakesNoSenseIsRefused) {
  const auto with = [](auto change) {
    InstrumentChanged runs = tracker_runs(0);
    change(*runs.layout);
    return refusal(RawEvent(runs));
  };
  using drivers::minibird::RecordFormat;
  EXPECT_EQ(with([](auto&) {}), "");
  EXPECT_NE(with([](auto& l) { l.birds.clear(); }).find("a tracker of 0 birds"), std::string::npos);
  EXPECT_NE(with([](auto& l) { l.birds.resize(15); }).find("a tracker of 15 birds"), std::string::npos);
  EXPECT_NE(with([](auto& l) { l.birds.resize(2); }).find("2 birds for 1 names"), std::string::npos);
  EXPECT_NE(with([](auto& l) { l.birds[0].format = RecordFormat{6}; }).find("format"), std::string::npos);
  EXPECT_NE(with([](auto& l) { l.birds[0].mm_per_count = 0; }).find("scale"), std::string::npos);
  EXPECT_NE(with([](auto& l) { l.rate_hz = 0; }).find("rate of 0 Hz"), std::string::npos);
  EXPECT_NE(with([](auto& l) { l.rate_hz = 1e300; }).find("rate of"), std::string::npos);
  EXPECT_NE(with([](auto& l) { l.rate_hz = std::nan(""); }).find("makes no sense"), std::string::npos);
  EXPECT_NE(with([](auto& l) { l.baud = 0; }).find("0 baud"), std::string::npos);
  EXPECT_NE(with([](auto& l) { l.plausibility.slack_mm = -1; }).find("plausibility"), std::string::npos);
}

TEST(Recording, OfAnEventThatMakesNoSenseIsRefused) {
  EXPECT_EQ(refusal(FrameCame{frame(0, 1, 1)}), "");
  FrameCame came{frame(0, 1, 1)};
  came.frame.width_px = 5;
  EXPECT_NE(refusal(came).find("5 x 2 pixels in 24 bytes"), std::string::npos);
  came.frame.width_px = -4;
  came.frame.height_px = -2;
  EXPECT_NE(refusal(came).find("-4 x -2 pixels"), std::string::npos);
  InstrumentChanged camera = camera_runs(0);
  EXPECT_EQ(refusal(camera), "");
  camera.rate_hz = std::numeric_limits<double>::infinity();
  EXPECT_NE(refusal(camera).find("rate of inf Hz"), std::string::npos);
  camera = camera_runs(0);
  camera.instrument = static_cast<Instrument>(7);
  EXPECT_NE(refusal(camera).find("unknown"), std::string::npos);
  // Times that cannot be added or subtracted.
  constexpr DeviceTime kNever{std::numeric_limits<std::int64_t>::min()};
  EXPECT_NE(refusal(Tick{kNever}).find("a time of -9.22337e+09 s"), std::string::npos);
  EXPECT_NE(refusal(TrackerBytes{{{1}, kNever}}).find("a time of"), std::string::npos);
  came = {frame(0, 1, 1)};
  came.frame.acquired = kNever;
  EXPECT_NE(refusal(came).find("a time of"), std::string::npos);
  EXPECT_NE(refusal(EdgesCame{{{drivers::GpioInput::strobe, true, kNever}}, at(0)}).find("a time of"),
            std::string::npos);
}

TEST(EventQueue, DropsTheOldestFrameAndNothingElse) {
  EventQueue queue;
  queue.push(Tick{at(0)});
  for (std::uint64_t n = 0; n < EventQueue::kMostFrames + 5; ++n) queue.push(FrameCame{frame(n, 0, 0)});
  EXPECT_EQ(queue.frames_dropped(), 5U);
  const DeviceTime soon = device_now() + Duration::from_ms(1000);
  EXPECT_TRUE(std::holds_alternative<Tick>(*queue.pop(soon, {})));
  EXPECT_EQ(std::get<FrameCame>(*queue.pop(soon, {})).frame.sequence, 5U);
}

TEST(EventQueue, AHoleInTheTrackersBytesIsMarked) {
  EventQueue queue;
  for (std::size_t n = 0; n < EventQueue::kMostEvents; ++n) queue.push(Tick{at(0)});
  queue.push(TrackerBytes{{{1}, at(1)}});
  EXPECT_EQ(queue.others_dropped(), 1U);
  queue.push(camera_runs(1));  // never dropped
  EXPECT_EQ(queue.others_dropped(), 1U);
  const DeviceTime soon = device_now() + Duration::from_ms(1000);
  for (int i = 0; i < 2; ++i) queue.pop(soon, {});
  queue.push(TrackerBytes{{{2}, at(2)}});
  std::optional<RawEvent> last;
  while (auto event = queue.pop(device_now(), {})) last = std::move(event);
  EXPECT_TRUE(std::get<TrackerBytes>(*last).chunk.after_line_error);
}

}  // namespace
}  // namespace birdseye::device
