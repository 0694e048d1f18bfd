#include "hw-sim/operation/operation.hpp"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <iterator>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "calibration/detect/pattern.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/durable.hpp"
#include "drivers/system/local_programs.hpp"
#include "drivers/system/wait.hpp"
#include "host/files/record_file.hpp"
#include "host/operation/live_source.hpp"
#include "hw-sim/base/hashed.hpp"
#include "hw-sim/local/local_camera.hpp"
#include "hw-sim/local/local_disk.hpp"
#include "hw-sim/local/local_line.hpp"
#include "hw-sim/local/local_link.hpp"
#include "hw-sim/minibird/tracker_loop.hpp"
#include "hw-sim/operation/bench_path.hpp"
#include "hw-sim/operation/operation_patient.hpp"
#include "hw-sim/operation/operation_programs.hpp"
#include "hw-sim/operation/operation_recording.hpp"
#include "hw-sim/operation/operation_scene.hpp"
#include "hw-sim/operation/operation_window.hpp"
#include "hw-sim/operation/surgeon.hpp"

namespace birdseye::hw_sim {

namespace {

struct VideoSize {
  int width_px, height_px;
};
constexpr VideoSize kGrey{96, 72}, kPictures{160, 120}, kOfBoard{192, 144};  // smaller, no board is found
constexpr double kAtBoard = 0.3;   // of operations with pictures: the scope is calibrated at their beginning
constexpr double kRecords = 0.25;  // of operations: the appliance records
constexpr double kFaultsFrom_s = 20, kQuietAtEnd_s = 10;
constexpr double kCalibratedBy_s = 90;  // a turn or zoom over the board would make the calibration wrong for good
constexpr Duration kScreen = Duration::from_ms(20);  // from one picture on the screen to the next
constexpr double kActs_s = 0.1;                      // from one look of the surgeon to the next
constexpr double kMemory_s = 1;                      // to ask takes as long as a few poses

/// A log with the operation's time before each line, and a hash of more than it tells.
class Journal {
 public:
  /// pictures: what frames show is hashed too.
  Journal(std::int64_t zero_ns, bool pictures) : zero_ns_(zero_ns), pictures_(pictures) {}
  void say(HostTime now, const std::string& what) { text_ += fmt::format("{:10.3f} {}\n", at_s(now), what); }
  /// What is no more as it was when it was last said, but for the numbers in it.
  void follow(HostTime now, std::string& last, const std::string& what) {
    std::string without_numbers = what;
    std::erase_if(without_numbers, [](char c) { return c >= '0' && c <= '9'; });
    if (without_numbers != last) say(now, what);
    last = std::move(without_numbers);
  }
  void enter(std::uint64_t value) { hash_ = splitmix64(hash_ ^ value); }
  void enter(double value) { enter(std::bit_cast<std::uint64_t>(value)); }
  /// Eight bytes at a time.
  void enter(const std::vector<std::uint8_t>& bytes) {
    std::uint64_t word = 0;
    for (std::size_t i = 0; i + sizeof word <= bytes.size(); i += sizeof word) {
      std::memcpy(&word, &bytes[i], sizeof word);
      enter(word);
    }
  }
  void enter(const wire::Event& event, HostTime now) {
    enter(static_cast<std::uint64_t>(now.ns));
    enter(static_cast<std::uint64_t>(event.index()));
    if (const auto* const birds = std::get_if<wire::Birds>(&event)) {
      enter(static_cast<std::uint64_t>(birds->acquired.ns));
      for (const wire::Bird& bird : birds->birds)
        for (const double value : bird.tracker_from_sensor.translation()) enter(value);
    }
    if (const auto* const frame = std::get_if<wire::VideoFrame>(&event)) {
      enter(frame->info.sequence);
      enter(static_cast<std::uint64_t>(frame->info.acquired.ns));
      if (pictures_) enter(*frame->rgb);
      enter(static_cast<std::uint64_t>(frame->info.pose.kind));
      if (const auto& pose = frame->info.pose.tracker_from_sensor)
        for (const double value : pose->translation()) enter(value);
    }
  }
  [[nodiscard]] double at_s(HostTime now) const { return static_cast<double>(now.ns - zero_ns_) * 1e-9; }
  [[nodiscard]] const std::string& text() const { return text_; }
  [[nodiscard]] std::uint64_t hash() const { return hash_; }

 private:
  std::int64_t zero_ns_;
  bool pictures_;
  std::string text_;
  std::uint64_t hash_ = 0;
};

/// What befalls, at its time.
class Announcer {
 public:
  explicit Announcer(const FaultScript& script) {
    for (const FaultTarget target : kFaultTargets) {
      for (const Fault& fault : script.of(target)) {
        const std::string name = fmt::format("{} {}", target_name(target), fault_name(fault.kind));
        lines_.emplace_back(fault.at_s, "begins: " + name);
        if (fault.for_s) lines_.emplace_back(fault.at_s + *fault.for_s, "ends: " + name);
      }
    }
    std::stable_sort(lines_.begin(), lines_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  }
  void tell(Journal& journal, HostTime now) {
    for (; next_ < lines_.size() && lines_[next_].first <= journal.at_s(now); ++next_)
      journal.say(now, lines_[next_].second);
  }

 private:
  std::vector<std::pair<double, std::string>> lines_;
  std::size_t next_ = 0;
};

TrackerScript tracker_of(const OperationTruth& truth, std::uint64_t seed, const FaultScript& faults,
                         std::int64_t zero_ns) {
  TrackerSettings settings;
  settings.unit.birds = static_cast<int>(truth.birds());
  settings.noise = OperationTruth::kNoise;
  settings.seed = seed;
  settings.faults = faults.tracker;
  settings.faults_from_streaming = false;
  const BirdMotion motion = [&truth, zero_ns](std::size_t bird, std::int64_t at_ns) -> BirdPose {
    const auto pose = truth.tracker_from_sensor(bird, static_cast<double>(at_ns - zero_ns) * 1e-9);
    return {pose.rotation(), pose.translation()};
  };
  return {settings, motion, device_now().ns};
}

/// While the appliance is off.
std::vector<double> scope_exchanges(const FaultScript& faults) {
  std::vector<double> at_s;
  for (const Fault& fault : faults.programs)
    if (fault.kind == FaultKind::scope_exchanged) at_s.push_back(fault.at_s + *fault.for_s / 2);
  return at_s;
}

/// Events to the workflow until the screen is drawn the next time, as the window takes them.
void take_events(host::LiveSource& source, host::LiveWorkflow& workflow, OperationLaws& laws, Journal& journal,
                 OperationRecording* recording) {
  const HostTime deadline = host_now() + kScreen;
  bool frame = false;
  while (const auto event = source.next(frame ? host_now() : deadline)) {
    const HostTime now = host_now();
    frame = frame || std::holds_alternative<wire::VideoFrame>(*event);
    journal.enter(*event, now);
    laws.take(*event, now);
    if (recording != nullptr) recording->take(*event, now);
    workflow.take(*event, now, source.host_from_device());
  }
}

std::string words_of(const host::ShownPicture& shown) {
  if (!shown.any) return "nothing is on the screen";
  if (is_whole(shown)) return "the overlay is whole";
  return fmt::format("{}: {}", shown.overlaid ? "the overlay fades" : "there is no overlay", shown.reason);
}

std::size_t heap_bytes_in_use() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

/// Runs the operation, in virtual time. open: opens a window. scene: null where the video is grey. recording: null
/// where the appliance records nothing.
void operate(const SimulatedOperation& operation, OperationTruth& truth, OperationScene* scene,
             const host::Authors& authors, OperationRecording* recording, LocalDisk& disk,
             const WindowProgram::Open& open, OperationOutcome& out) {
  const std::int64_t zero_ns = device_now().ns;
  const LocalLine line("sim:tracker");
  TrackerLoop unit(line.instrument(), tracker_of(truth, operation.seed, out.faults, zero_ns), {});
  unit.align(zero_ns + 1);  // before the first measurement
  LocalCamera::Settings camera_settings;
  camera_settings.name = truth.camera_name();
  camera_settings.width_px = truth.lens(0).width_px;
  camera_settings.height_px = truth.lens(0).height_px;
  if (scene != nullptr) {
    camera_settings.look = [scene, zero_ns](std::int64_t exposed_ns) {
      return scene->look(static_cast<double>(exposed_ns - zero_ns) * 1e-9);
    };
  }
  camera_settings.timing.rate_hz = kVideo_hz;
  camera_settings.timing.seed = operation.seed;
  camera_settings.timing.faults = out.faults.camera;
  const LocalCamera camera(camera_settings, zero_ns);
  const LocalNetwork network({.delay = Duration::from_ms(1)});
  std::array<std::string, 2> records;
  for (std::size_t scope = 0; scope < records.size() && !truth.at_board(0); ++scope)
    records[scope] = host::record_text(truth.record_of(scope), *authors.machine);
  ApplianceProgram appliance(truth, line, camera, network, std::move(records), recording);
  WindowProgram window(open, network);
  WindowDisk window_disk(disk, window);
  FaultTimeline befalling(out.faults.programs, FaultTarget::program);
  befalling.begin(zero_ns);
  OperationLaws laws(
      truth, out.faults, [&camera](std::uint64_t sequence) { return camera.exposed_ns(sequence); }, zero_ns);
  if (operation.pictures) laws.watch_pictures();
  Surgeon surgeon(truth, operation.seed, operation.pictures ? SurgeonDoes::views_too : SurgeonDoes::no_views);
  Journal journal(zero_ns, operation.pictures);
  Announcer announcer(out.faults);
  std::string said, step, screen;
  bool had_power = true;
  std::vector<BrokenLaw> not_recorded;
  const auto judge_recording = [&] {
    const std::string wrong = recording != nullptr ? recording->judge() : "";
    if (!wrong.empty()) not_recorded.push_back({journal.at_s(host_now()), "recorded", wrong});
  };
  double acts_at_s = 0, memory_at_s = 0;
  const HostTime end = host_now() + Duration::from_seconds(operation.minutes * 60);
  while (host_now() < end) {
    befalling.advance(device_now().ns);
    if (befalling.active(FaultKind::link_cut) != nullptr) {
      network.cut();
      befalling.done(FaultKind::link_cut, device_now().ns);
    }
    const Fault* const late = befalling.active(FaultKind::link_late);
    network.set_late(Duration::from_seconds(late != nullptr ? late->value("ms") * 1e-3 : 0));
    if (recording != nullptr) recording->befall(befalling, host_now());
    if (befalling.active(FaultKind::appliance_power_cut) != nullptr) appliance.lose_power();
    const bool ends = befalling.active(FaultKind::appliance_restart) != nullptr ||
                      befalling.active(FaultKind::scope_exchanged) != nullptr ||
                      befalling.active(FaultKind::appliance_power_cut) != nullptr;
    const auto serves = appliance.run(!ends, truth.scope_in_use(journal.at_s(host_now())));
    if (!serves) return out.broken.push_back({journal.at_s(host_now()), "start", serves.error().what});
    if (ends) judge_recording();
    const auto powered = window_disk.befall(befalling, journal.at_s(host_now()));
    if (!powered) return out.broken.push_back({journal.at_s(host_now()), "start", powered.error().what});
    if (std::exchange(had_power, *powered) && !*powered) journal.say(host_now(), "the window's machine has no power");
    const auto opened = window.run(*powered && befalling.active(FaultKind::window_restart) == nullptr);
    if (!opened) return out.broken.push_back({journal.at_s(host_now()), "start", opened.error().what});
    laws.take(appliance.fills(), host_now());
    if (window.workflow() == nullptr) {
      sleep_for(kScreen);
      announcer.tell(journal, host_now());
      continue;
    }
    host::LiveWorkflow& workflow = *window.workflow();
    host::LiveSource& source = window.source();
    laws.take(source.fills(), host_now());
    if (*opened) {
      surgeon.stand_at(workflow, journal.at_s(host_now()));
      laws.opened(surgeon.checks());
    }
    if (befalling.active(FaultKind::window_stalls) != nullptr) {
      sleep_for(kScreen);
      announcer.tell(journal, host_now());
      laws.stood_still();
      continue;
    }
    take_events(source, workflow, laws, journal, recording);
    workflow.set_link(source.connected(), source.words(), source.may_retry());
    workflow.tick();
    workflow.draw();
    const HostTime now = host_now();
    // Each time: what is taken back just before the power goes was not lost.
    laws.take_kept(workflow.view(), disk.failed(), disk.powerless(), now);
    const host::ShownPicture shown = workflow.shown_at(now);
    laws.take(shown, workflow.picture(), now);
    journal.enter(shown.strength);
    announcer.tell(journal, now);
    journal.follow(now, screen, words_of(shown));
    if (journal.at_s(now) < acts_at_s) continue;
    acts_at_s = journal.at_s(now) + kActs_s;
    const std::size_t presses = surgeon.presses();
    surgeon.act(journal.at_s(now), now, shown);
    if (surgeon.presses() > presses) laws.pressed(now);
    if (journal.at_s(now) >= memory_at_s) {
      memory_at_s = journal.at_s(now) + kMemory_s;
      laws.take_memory(heap_bytes_in_use(), now);
    }
    const host::OperationView view = workflow.view();
    laws.take(view, surgeon.checks(), now);
    const host::StepNote& note = view.note(view.step);
    journal.follow(now, step,
                   fmt::format("step {}: {}", host::name_of(view.step),
                               view.guide_lines.empty() ? note.line : view.guide_lines.back()));
    journal.follow(now, said, "the appliance: " + view.link.appliance_says);
  }
  (void)appliance.run(false, 0);
  judge_recording();
  laws.finish(operation.minutes * 60);
  out.broken = laws.broken();
  std::ranges::move(not_recorded, std::back_inserter(out.broken));
  if (recording != nullptr) {
    out.recordings = recording->judged();
    out.found_again = recording->found_again();
  }
  out.laws = laws.figures();
  out.registrations = surgeon.registrations();
  out.deformations = surgeon.deformations();
  out.checks = surgeon.checks();
  out.log = journal.text();
  out.hash = journal.hash();
}

}  // namespace

Result<OperationOutcome> run_operation(const SimulatedOperation& operation) {
  OperationOutcome out;
  const bool reference = operation.reference.value_or(hashed_uniform(hashed_word(operation.seed, 5), 0) < 0.5);
  out.reference = reference;
  const bool records = operation.records.value_or(hashed_uniform(hashed_word(operation.seed, 18), 0) < kRecords);
  const bool at_board = operation.pictures && hashed_uniform(hashed_word(operation.seed, 8), 0) < kAtBoard;
  const double ends_s = operation.minutes * 60;
  if (operation.faults) {
    out.faults = *operation.faults;
  } else {
    const double until_s = ends_s - kQuietAtEnd_s;
    out.faults = draw_faults(operation.seed, kFaultsFrom_s, until_s, reference);
    if (operation.programs_end) out.faults.programs = draw_program_faults(operation.seed, kFaultsFrom_s, until_s);
    if (operation.disk_fails)
      std::ranges::move(draw_disk_faults(operation.seed, kFaultsFrom_s, until_s),
                        std::back_inserter(out.faults.programs));
    if (operation.more_befalls) {
      const auto add = [](std::vector<Fault>& to, std::vector<Fault> more) {
        std::ranges::move(more, std::back_inserter(to));
      };
      add(out.faults.programs, draw_delays(operation.seed, kFaultsFrom_s, until_s));
      if (!at_board) add(out.faults.programs, draw_scope_exchanges(operation.seed, kFaultsFrom_s, until_s));
      if (reference) add(out.faults.world, draw_tilts(operation.seed, kFaultsFrom_s, until_s));
      if (reference) add(out.faults.world, draw_slips(operation.seed, kFaultsFrom_s, until_s));
      if (records) add(out.faults.programs, draw_appliance_power_cuts(operation.seed, kFaultsFrom_s, until_s));
      if (records) add(out.faults.programs, draw_appliance_disk_faults(operation.seed, kFaultsFrom_s, until_s));
    }
    if (operation.pictures && !reference) draw_bumps_in_view(operation.seed, kFaultsFrom_s, until_s, out.faults);
    if (operation.pictures && operation.more_befalls)
      draw_scope_faults_in_view(operation.seed, at_board ? kCalibratedBy_s : kFaultsFrom_s, until_s, out.faults);
  }
  const VideoSize size = at_board ? kOfBoard : operation.pictures ? kPictures : kGrey;
  OperationTruth truth(operation.seed, size.width_px, size.height_px, Happenings(out.faults.world), reference);
  std::vector<double> exchanged_at_s = scope_exchanges(out.faults);
  if (at_board && !exchanged_at_s.empty()) {
    return Error{Errc::bad_value, fmt::format("scope_exchanged: the scope of seed {} is calibrated over a board, and "
                                              "nobody has a record of another; give another seed",
                                              operation.seed)};
  }
  truth.exchange_scopes(std::move(exchanged_at_s));
  if (!at_board) truth.fit_rods(operation.seed);
  WindowSettings window;
  window.video_must_agree = operation.pictures;
  if (at_board) {
    if (const auto begun = truth.begin_at_board(operation.seed); !begun) return begun.error();
    const auto pattern = calibration::parse_pattern(BenchPath::spec());
    if (!pattern) return pattern.error();
    window.pattern = *pattern;
  }
  std::unique_ptr<OperationScene> scene;
  if (operation.pictures) {
    auto created = OperationScene::create(truth, operation.seed);
    if (!created) return std::move(created).error();
    scene = *std::move(created);
    for (std::size_t scope = 0; scope < truth.scopes_used(); ++scope)
      truth.enter_round_field(scope, scene->round_field(scope));
  }
  const auto folder = RendezvousFolder::make();
  if (!folder) return folder.error();
  const auto patient =
      write_patient((*folder)->path(), truth, operation.pictures ? PatientHas::markers_and_organ : PatientHas::markers);
  if (!patient) return patient.error();
  window.patient = *patient;
  const host::Authors authors = host::Authors::for_once();  // another key changes nothing that is done
  const auto kept = (*folder)->path() / "window";
  if (const auto made = make_folder_durably(kept); !made) return made.error();
  LocalDisk disk(kept, hashed_word(operation.seed, 10));
  std::optional<OperationRecording> recording;
  if (records) recording.emplace((*folder)->path(), hashed_word(operation.seed, 19));
  const auto open = [&] { return open_window(window, truth, authors, kept); };
  // The first window reads its files before virtual time begins.
  auto first = open();
  if (!first) return std::move(first).error();
  const auto open_next = [&] { return *first != nullptr ? std::exchange(*first, nullptr) : open(); };
  const auto ran = run_in_virtual_time({.seed = operation.seed}, [&] {
    operate(operation, truth, scene.get(), authors, recording ? &*recording : nullptr, disk, open_next, out);
  });
  if (!ran) return ran.error();
  out.time = *ran;
  for (const BrokenLaw& law : out.broken)
    out.log += fmt::format("{:10.3f} broken: {}: {}\n", law.at_s, law.law, law.what);
  return out;
}

}  // namespace birdseye::hw_sim
