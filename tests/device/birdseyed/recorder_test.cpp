#include "device/birdseyed/recorder.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdio>
#include <mutex>

#include "device/birdseyed/appliance.hpp"
#include "device/birdseyed/instrument_board.hpp"
#include "device/wire/client.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/synced_files.hpp"

namespace birdseye::device {
namespace {

RawEvent bytes(std::uint8_t value) {
  return TrackerBytes{{{0x80, value}, DeviceTime{value}}};
}

template <typename Condition>
bool comes_true(Condition condition) {
  const DeviceTime deadline = device_now() + Duration::from_ms(20'000);
  while (!condition() && device_now() < deadline) sleep_for(Duration::from_ms(2));
  return condition();
}

/// A disk whose writes wait until they are let through, with a record of what it was asked.
struct Disk {
  std::mutex mutex;
  std::condition_variable changed;
  int let_through = 2;  // magic and settings
  bool slow = false;
  int sync_fails = 0;
  std::string asked;  // w and s, in order
  int writes() {
    const std::lock_guard lock(mutex);
    return static_cast<int>(std::count(asked.begin(), asked.end(), 'w'));
  }
  std::string asked_so_far() {
    const std::lock_guard lock(mutex);
    return asked;
  }
  void let(int writes) {
    {
      const std::lock_guard lock(mutex);
      let_through += writes;
    }
    changed.notify_all();
  }
};

class DiskFile : public RecordFile {
 public:
  explicit DiskFile(std::shared_ptr<Disk> disk) : disk_(std::move(disk)) {}
  int write(std::span<const std::uint8_t>) override {
    std::unique_lock lock(disk_->mutex);
    disk_->changed.wait(lock, [this] { return disk_->let_through > 0; });
    --disk_->let_through;
    disk_->asked += 'w';
    const bool slow = disk_->slow;
    lock.unlock();
    if (slow) sleep_for(Duration::from_ms(50));
    return 0;
  }
  int sync() override {
    const std::lock_guard lock(disk_->mutex);
    disk_->asked += 's';
    return disk_->sync_fails;
  }

 private:
  std::shared_ptr<Disk> disk_;
};

std::unique_ptr<Recorder> record_to(const std::shared_ptr<Disk>& disk) {
  RecordConfig config;
  config.folder = "/nowhere";
  config.create = [disk](const auto&) -> Result<NewRecordFile> {
    return NewRecordFile{std::make_unique<DiskFile>(disk), "/nowhere/r.berec"};
  };
  return *Recorder::start(config, {});
}

TEST(Recorder, ADiskThatDoesNotKeepUpEndsItAtTheBoundAndAtOnce) {
  const auto disk = std::make_shared<Disk>();
  const auto recorder = record_to(disk);
  constexpr std::size_t kFrameBytes = 1'000'000;
  const auto pixels = std::make_shared<const Bytes>(kFrameBytes);
  FrameCame came;
  came.frame.rgb = pixels;
  std::size_t taken = 0;
  for (; taken < 500 && recorder->text().find("too slow") == std::string::npos; ++taken) recorder->take(came);
  EXPECT_NE(recorder->text().find("too slow"), std::string::npos);  // though the first write has yet to end
  EXPECT_EQ(disk->writes(), 2);
  EXPECT_LE(taken - 1, Recorder::kMostHeldBytes / kFrameBytes);
  EXPECT_GE(taken + 1, Recorder::kMostHeldBytes / kFrameBytes);
  // Here, in `came`, and at most so often in the recorder; and each goes when it is written, not all at the end.
  EXPECT_LE(pixels.use_count() - 2, static_cast<long>(Recorder::kMostHeldBytes / kFrameBytes));
  disk->let(20);
  EXPECT_TRUE(comes_true([&] { return pixels.use_count() - 2 <= static_cast<long>(taken) - 20; }));
  EXPECT_GT(pixels.use_count() - 2, 20);
  disk->let(500);
  EXPECT_TRUE(comes_true([&] { return pixels.use_count() == 2; }));
  EXPECT_EQ(disk->writes(), 2 + static_cast<int>(taken) - 1) << "what was taken before is kept";
}

TEST(Recorder, ADiskThatHangsDoesNotHoldUpTheEnd) {
  const auto disk = std::make_shared<Disk>();
  const std::weak_ptr<Disk> used = disk;
  auto recorder = record_to(disk);
  for (int i = 0; i < 100; ++i) recorder->take(bytes(1));
  recorder.reset();  // without the change: for ever
  EXPECT_EQ(disk->writes(), 2);
  disk->let(1);  // it comes back: the thread ends, with one sync and no more of what waited
  EXPECT_TRUE(comes_true([&] { return used.use_count() == 1; }));
  EXPECT_EQ(disk->asked_so_far(), "wwws");
}

TEST(Recorder, ASlowDiskGetsWhatItCanAtTheEndAndOneSync) {
  const auto disk = std::make_shared<Disk>();
  disk->let(1000);
  disk->slow = true;
  auto recorder = record_to(disk);
  for (int i = 0; i < 400; ++i) recorder->take(bytes(1));  // 20 s of it
  recorder.reset();
  EXPECT_TRUE(comes_true([&] { return disk.use_count() == 1; }));
  EXPECT_GT(disk->writes(), 3);
  EXPECT_LT(disk->writes(), 200);
  EXPECT_TRUE(disk->asked_so_far().ends_with("ws"));
}

TEST(Recorder, ADiskThatLosesWhatItTookEndsItAndIsSaid) {
  const auto disk = std::make_shared<Disk>();
  disk->let(1'000'000);
  disk->sync_fails = EIO;
  const auto recorder = record_to(disk);
  EXPECT_TRUE(comes_true([&] {
    recorder->take(bytes(1));
    return recorder->text().find("Input/output error") != std::string::npos;
  })) << recorder->text();
}

TEST(Recorder, ADiskThatDoesNotAnswerAtTheStartIsAnError) {
  const auto disk = std::make_shared<Disk>();
  disk->let_through = 0;
  RecordConfig config;
  config.folder = "/nowhere";
  config.create = [disk](const auto&) -> Result<NewRecordFile> {
    return NewRecordFile{std::make_unique<DiskFile>(disk), "/nowhere/r.berec"};
  };
  const auto recorder = Recorder::start(config, {});
  ASSERT_FALSE(recorder);
  EXPECT_NE(recorder.error().what.find("does not answer"), std::string::npos);
  disk->let(10);
  EXPECT_TRUE(comes_true([&] { return disk.use_count() <= 2; }));  // here and in `create`, which went with the thread
}

struct Counted {
  std::atomic<std::uint64_t> writes = 0, synced_writes = 0, syncs = 0;
};

/// A file whose process is killed; with its power, where it is told to: then what was not synced is not there, but for
/// some bytes of it.
class DoomedFile : public RecordFile {
 public:
  DoomedFile(std::unique_ptr<RecordFile> file, bool power_fails, Counted& counted)
      : file_(std::move(file)), power_fails_(power_fails), counted_(counted) {}
  int write(std::span<const std::uint8_t> bytes) override {
    cache_.insert(cache_.end(), bytes.begin(), bytes.end());
    if (!power_fails_) flush(cache_.size());
    if (power_fails_ && !torn_ && cache_.size() > 1000) {
      flush(cache_.size() - bytes.size() / 2);
      torn_ = true;
    }
    ++counted_.writes;
    return 0;
  }
  int sync() override {
    flush(cache_.size());
    torn_ = false;
    const int failed = file_->sync();
    counted_.synced_writes = counted_.writes.load();
    ++counted_.syncs;
    return failed;
  }

 private:
  void flush(std::size_t some) {
    file_->write(std::span(cache_).first(some));
    cache_.erase(cache_.begin(), cache_.begin() + static_cast<std::ptrdiff_t>(some));
  }
  std::unique_ptr<RecordFile> file_;
  bool power_fails_, torn_ = false;
  Counted& counted_;
  Bytes cache_;
};

/// Records until there were three syncs and more was written since.
[[noreturn]] void record_until_killed(RecordConfig config, bool power_fails, Counted& counted) {
  config.create = [&](const std::filesystem::path& folder) -> Result<NewRecordFile> {
    auto made = create_record_file(folder);
    if (made) made->file = std::make_unique<DoomedFile>(std::move(made->file), power_fails, counted);
    return made;
  };
  auto recorder = Recorder::start(config, {});
  if (!recorder) {
    std::fprintf(stderr, "%s\n", recorder.error().what.c_str());
    ::_exit(1);
  }
  const DeviceTime deadline = device_now() + Duration::from_ms(10'000);
  for (std::uint8_t i = 0; counted.syncs < 3 || counted.writes < counted.synced_writes + 40; ++i) {
    if (device_now() > deadline) ::_exit(2);
    (*recorder)->take(bytes(i));
    sleep_for(Duration::from_ms(2));
  }
  ::kill(::getpid(), SIGKILL);
  ::_exit(3);
}

/// A recording of a process that was killed: how many writes it gives back, events each the next of the one before.
std::uint64_t given_back(bool power_fails, Counted& counted, bool& cut_short) {
  const birdseye::testing::Scratch scratch;
  RecordConfig config;
  config.folder = scratch / "recordings";
  const pid_t child = ::fork();
  if (child == 0) record_until_killed(config, power_fails, counted);
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status)) << "1: no file, 2: no syncs: " << WEXITSTATUS(status);
  std::uint64_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(config.folder)) {
    auto reader = RawEventReader::open(entry.path());
    EXPECT_TRUE(reader);
    if (!reader) continue;
    for (;; ++count) {
      const auto event = reader->next();
      EXPECT_TRUE(event) << event.error().what;
      if (!event || !*event) break;
      EXPECT_EQ(std::get<TrackerBytes>(**event).chunk.bytes.back(), static_cast<std::uint8_t>(count));
    }
    cut_short = reader->cut_short();
  }
  return count + 2;  // magic and settings
}

TEST(Recorder, WhatWasSyncedSurvivesAPowerCutAndWhatWasWrittenAKill) {
  void* const shared = ::mmap(nullptr, sizeof(Counted), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(shared, MAP_FAILED);
  for (const bool power_fails : {true, false}) {
    const auto& counted = *new (shared) Counted;
    bool cut_short = false;
    const std::uint64_t back = given_back(power_fails, *static_cast<Counted*>(shared), cut_short);
    EXPECT_GE(counted.syncs, 3U);
    EXPECT_GE(back, power_fails ? counted.synced_writes : counted.writes);
    if (power_fails) {
      EXPECT_LT(back, counted.writes);
      EXPECT_TRUE(cut_short);
    }
  }
  ::munmap(shared, sizeof(Counted));
}

TEST(Recorder, BeginsAFileOfItsOwnEachTime) {
  const birdseye::testing::Scratch scratch;
  RecordConfig config;
  config.folder = scratch / "recordings";
  for (int i = 1; i <= 4; ++i) {  // within a second
    const auto recorder = Recorder::start(config, {});
    ASSERT_TRUE(recorder) << recorder.error().what;
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(config.folder), {}), i);
  }
}

TEST(Appliance, RunsWithoutARecordingAndSaysSo) {
  Config config;
  config.tracker.line.device = "unix:/nowhere/tracker";
  config.camera.source = "unix:/nowhere/camera";
  config.record.folder = "/proc/no-such-place";
  const auto server = *wire::Server::listen("127.0.0.1", 0);
  const auto appliance = Appliance::start(config, *server);
  ASSERT_TRUE(appliance) << appliance.error().what;
  EXPECT_NE((*appliance)->summary().find("not recording: /proc/no-such-place"), std::string::npos);
  const auto deadline = Deadline::after(Duration::from_ms(20'000));
  const auto client = *wire::Client::connect("127.0.0.1", server->port(), deadline);
  std::string recording;
  while (recording.empty()) {
    const auto event = client->next(deadline);
    ASSERT_TRUE(event && *event);
    if (const auto* health = std::get_if<wire::Health>(&**event)) recording = health->recording;
  }
  EXPECT_EQ(recording.rfind("not recording: /proc/no-such-place", 0), 0U) << recording;
}

TEST(Recorder, KeepsEverythingItIsGiven) {
  const birdseye::testing::Scratch scratch;
  birdseye::testing::forget_synced();
  RecordConfig config;
  config.folder = scratch / "new/recordings";
  std::filesystem::path path;
  {
    auto recorder = Recorder::start(config, {});
    ASSERT_TRUE(recorder) << recorder.error().what;
    path = (*recorder)->path();
    EXPECT_EQ((*recorder)->text(), path.string());
    for (int i = 0; i < 100; ++i) (*recorder)->take(bytes(static_cast<std::uint8_t>(i)));
  }
  EXPECT_TRUE(birdseye::testing::is_synced(path));
  EXPECT_TRUE(birdseye::testing::is_synced(config.folder)) << "a power cut leaves the bytes without a name";
  EXPECT_TRUE(birdseye::testing::is_synced(scratch / "new"));
  EXPECT_TRUE(birdseye::testing::is_synced(scratch.path()));
  auto reader = RawEventReader::open(path);
  ASSERT_TRUE(reader) << reader.error().what;
  for (int i = 0; i < 100; ++i) {
    const auto event = reader->next();
    ASSERT_TRUE(event && *event);
    EXPECT_EQ(std::get<TrackerBytes>(**event).chunk.bytes.back(), i);
  }
  EXPECT_FALSE(*reader->next());
}

TEST(Recorder, EndsAtItsLimitAndSaysSo) {
  const birdseye::testing::Scratch scratch;
  RecordConfig config;
  config.folder = scratch / "recordings";
  config.most_gb = 1e-6;
  const auto recorder = *Recorder::start(config, {});
  for (int i = 0; i < 200; ++i) recorder->take(bytes(1));
  const DeviceTime deadline = device_now() + Duration::from_ms(5000);
  while (recorder->text().find("most_gb") == std::string::npos && device_now() < deadline) {
    recorder->take(bytes(1));
    sleep_for(Duration::from_ms(5));
  }
  EXPECT_NE(recorder->text().find("most_gb"), std::string::npos) << recorder->text();
}

TEST(Recorder, AFolderThatCannotBeIsNamed) {
  RecordConfig config;
  config.folder = "/proc/no-such-place";
  const auto recorder = Recorder::start(config, {});
  ASSERT_FALSE(recorder);
  EXPECT_NE(recorder.error().what.find("[record] folder"), std::string::npos);
}

TEST(InstrumentBoard, TellsTheWholeFromItsParts) {
  InstrumentBoard board;
  const auto note = [&board](Instrument instrument, InstrumentState state, const char* text) {
    board.note({.instrument = instrument, .state = state, .text = text});
    return board.state();
  };
  EXPECT_EQ(note(Instrument::tracker, InstrumentState::starting, "t"), ApplianceState::starting);
  EXPECT_EQ(note(Instrument::camera, InstrumentState::running, "c"), ApplianceState::starting);
  EXPECT_EQ(note(Instrument::tracker, InstrumentState::running, "t"), ApplianceState::ready);
  EXPECT_EQ(board.faults(), "");
  EXPECT_EQ(note(Instrument::camera, InstrumentState::silent, "no frames"), ApplianceState::degraded);
  EXPECT_EQ(note(Instrument::tracker, InstrumentState::absent, "no line"), ApplianceState::degraded);
  EXPECT_EQ(board.faults(), "no line; no frames");
  EXPECT_EQ(board.of(Instrument::camera).times_lost, 1U);
  EXPECT_EQ(note(Instrument::camera, InstrumentState::running, "c"), ApplianceState::degraded);
  EXPECT_EQ(note(Instrument::tracker, InstrumentState::running, "t"), ApplianceState::ready);
}

TEST(StatusLed, ShowsEachStateInItsOwnWay) {
  const auto changes = [](ApplianceState state) {
    int count = 0;
    for (int ms = 1; ms < 2000; ++ms)
      count +=
          led_on(state, {std::int64_t{ms} * 1'000'000}) != led_on(state, {std::int64_t{ms - 1} * 1'000'000}) ? 1 : 0;
    return count;
  };
  EXPECT_EQ(changes(ApplianceState::ready), 0);
  EXPECT_TRUE(led_on(ApplianceState::ready, {0}));
  EXPECT_EQ(changes(ApplianceState::starting), 3);
  EXPECT_EQ(changes(ApplianceState::degraded), 19);
}

}  // namespace
}  // namespace birdseye::device
