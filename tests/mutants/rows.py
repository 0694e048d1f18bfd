"""Defects that somebody might write, one at a time, and who should find each: the table that mutants.py plants from. Old text
stands in its file exactly once, and the new text in its place builds without a warning."""
import dataclasses


@dataclasses.dataclass(frozen=True)
class Mutant:
    id: str
    file: str  # from the root of the tree
    old: str
    new: str
    wrong: str  # what is wrong then, in a sentence
    tests: str  # that should find it: a regular expression of ctest's
    targets: tuple  # that build these tests
    campaign: bool = True  # whether a campaign should find it


BIRDSEYED, MINIBIRD, OPERATION = ("device_birdseyed_test",), ("drivers_minibird_test",), ("hw_sim_operation_test",)
SEEDS = r"MendedSeed\.BreaksNoLawAnyMore"
WHOLE = r"^Operation\.(WithoutAFaultTheOverlayIsWhole|FaultsAtRandomBreakNoLaw)"

MUTANTS = (
    # What the tracker's driver makes of bytes.
    Mutant("scale", "drivers/minibird/configuration.cpp",
           "word_of(*scale) == 0 ? kMmPerCount36Inch", "word_of(*scale) != 0 ? kMmPerCount36Inch",
           "The two scales of positions are exchanged.", r"^MiniBird\.StreamsTheTruePosesInEveryFormat", MINIBIRD),
    Mutant("two-birds", "drivers/minibird/minibird.cpp",
           """  if (settings_.birds > 1) {
    if (auto flock = gather_flock(); !flock) return flock;""",
           """  if (settings_.birds > 2) {
    if (auto flock = gather_flock(); !flock) return flock;""",
           "A flock of just two birds is not gathered: more than one, written as more than two.",
           r"^MiniBirdStart\.AFlockIsGatheredAndEachBirdSet", MINIBIRD),
    Mutant("address", "drivers/minibird/record_parser.cpp",
           "if (record.address == 0 || record.address > formats_.size()) {", "if (record.address == 0) {",
           "A record may name a bird that there is none of.", rf"^(Assembler|Record)\.|{SEEDS}",
           MINIBIRD + OPERATION),
    Mutant("phase-errors", "drivers/minibird/assembler.cpp",
           "  counters.phase_errors = parser_.phase_errors();\n", "",
           "The parser's count of damaged records is not handed on.",
           r"^MiniBird\.ALostByteCostsOneRecordNotTheStream", MINIBIRD),
    Mutant("frozen", "drivers/minibird/bird_guard.cpp",
           """  if (const auto doubt = doubt_of_repeats(record.words, acquired)) {
    was_frozen_ = true;
    candidate_.reset();
    return withhold(*doubt);
  }""",
           """  if (doubt_of_repeats(record.words, acquired)) {
    was_frozen_ = true;
    candidate_.reset();
  }""",
           "That a bird is frozen is noted, and its reading judged on as if it were not.",
           r"^BirdGuard\..*Frozen", MINIBIRD),
    Mutant("line-noise", "drivers/minibird/bird_guard.cpp",
           "damaged_ += kDamageMemory * ((!makes_sense && made_sense_ ? 1 : 0) - damaged_);",
           "if (!makes_sense) damaged_ += kDamageMemory * ((made_sense_ ? 1 : 0) - damaged_);",
           "A line that was damaged is doubted for ever: readings that make sense do not count.",
           r"^BirdGuard\.(BetweenReadingsThatMakeNoSenseNoneIsBelieved|NoStreamThatIsGoodIsDoubtedForEver)", MINIBIRD),
    # What birdseyed makes of measurements and frames.
    Mutant("noise-forgotten", "device/birdseyed/core.cpp",
           "      assembler_->expect(noise_);\n", "",
           "A tracker that starts again forgets what its noise was like, and frozen readings pass for those of a bird at rest.",
           SEEDS, OPERATION),
    Mutant("first-pose", "device/birdseyed/core.cpp",
           "if (i == 0) scope_.push(", "if (birds.birds.empty()) scope_.push(",
           "The first bird that has a pose is taken for the scope, not the first bird.", WHOLE, OPERATION),
    Mutant("names", "device/birdseyed/core.cpp",
           "birds.birds.push_back({settings_.bird_names[i], pose});",
           "birds.birds.push_back({settings_.bird_names[birds.birds.size()], pose});",
           "Where a bird has no pose those after it are sent by its name.", WHOLE, OPERATION),
    Mutant("newest-pose", "device/birdseyed/core.cpp",
           "out.info.pose = scope_.at(time.acquired);",
           "out.info.pose = scope_.at(scope_.newest().value_or(time.acquired));",
           "A frame gets the newest pose and not the one of its own time; a stale one is kept.",
           r"^Core\.EachFrameHasThePoseOfItsOwnTime", BIRDSEYED),
    Mutant("latency-unit", "device/birdseyed/core.cpp",
           "/ kSigmasOf95 * 1e-3;", "/ kSigmasOf95;",
           "The latency's sigma is in ms and is taken for seconds.",
           r"^Core\.TheRecordsLatencyIsTakenOffTheFramesTimes", BIRDSEYED),
    Mutant("drops", "device/birdseyed/core.cpp",
           "if (next_sequence_ && frame.sequence > *next_sequence_ &&",
           "if (next_sequence_ && frame.sequence < *next_sequence_ &&",
           "Frames that were dropped are not counted: the comparison is the other way round.", SEEDS, OPERATION),
    Mutant("repeats", "device/birdseyed/core.cpp",
           "    ++frames_repeated_;\n", "",
           "Frames that came before are left out uncounted.",
           r"^Core\.AFrameThatCameBeforeIsCountedAndNotSentAgain", BIRDSEYED),
    Mutant("tracker-clock", "device/birdseyed/core.cpp",
           "  tell(Instrument::tracker, assembler_->take_clock_events());\n", "",
           "What happens to the tracker's clock is told to nobody.",
           r"^Core\.PosesWhoseTimeIsInDoubtAreNotPublished", BIRDSEYED),
    Mutant("camera-clock", "device/birdseyed/core.cpp",
           "  tell(Instrument::camera, frame_clock_.take_events());\n", "",
           "What happens to the camera's clock is told to nobody.",
           r"^Core\.StampsThatJumpAreAnEventOfTheClock", BIRDSEYED),
    Mutant("ahead", "device/birdseyed/frame_clock.cpp",
           "const Duration ahead = frame.acquired - frame.arrived;",
           "const Duration ahead = frame.arrived - frame.acquired;",
           "Stamps from before the arrival are taken for stamps ahead of the clock: a sign.",
           r"^Core\.(StampsAhead|EachFrameHas)", BIRDSEYED),
    Mutant("health-rate", "device/birdseyed/appliance.cpp",
           "kHealthEvery = Duration::from_ms(1000);", "kHealthEvery = Duration::from_ms(10'000);",
           "Health is sent ten times too seldom.", r"^VirtualAppliance\.TenMinutesOfATracker", ("hw_sim_time_test",)),
    Mutant("health-copied", "device/birdseyed/appliance.cpp",
           "health.frames_dropped = counters.frames_lost;", "health.frames_dropped = counters.frames_repeated;",
           "Health tells of the repeated frames where it should tell of those that were dropped.", SEEDS, OPERATION),
    Mutant("silent-tracker", "device/birdseyed/tracker_thread.cpp",
           "kSilent = Duration::from_ms(500);", "kSilent = Duration::from_ms(5000);",
           "A silent tracker is waited for ten times too long.", SEEDS, OPERATION),
    Mutant("silence-untold", "device/birdseyed/tracker_thread.cpp",
           """    const Error lost = stream(**tracker, config, post, stop);
    if (!stop.stop_requested()) {""",
           """    const Error lost = stream(**tracker, config, post, stop);
    if (!stop.stop_requested() && lost.code != Errc::timeout) {""",
           "That the tracker has fallen silent is not told where it can be opened again.", SEEDS, OPERATION),
    Mutant("silent-camera", "device/birdseyed/camera_thread.cpp",
           "Duration::from_seconds(kSilentPeriods / rate_of(camera, settings))",
           "Duration::from_seconds(kSilentPeriods * rate_of(camera, settings))",
           "How long a camera may be silent is frames times rate, 200 s, and not frames by rate.",
           r"^ACamera\.ThatRepeatsAFrameIsSilent", BIRDSEYED),
    Mutant("camera-untold", "device/birdseyed/camera_thread.cpp",
           "stream(**camera, settings, post, lock, stop); !stop.stop_requested()) {",
           "stream(**camera, settings, post, lock, stop); lost.code == Errc::timeout) {",
           "Only of a silent camera it is told why it was lost, not of one that has gone or sends garbage.", SEEDS, OPERATION),
    Mutant("pace", "device/birdseyed/camera_thread.cpp",
           "Duration::from_seconds(1 / (kTimes * rate_of(camera, settings)))",
           "Duration::from_seconds(kTimes / rate_of(camera, settings))",
           "A camera is read at a quarter of its rate, not at four times.", WHOLE, OPERATION),
    Mutant("look-again", "device/birdseyed/instrument_thread.hpp",
           "kLookAgain = Duration::from_ms(400);", "kLookAgain = Duration::from_ms(5000);",
           "An instrument that is not there is looked for too seldom.",
           r"^VirtualAppliance\.ATrackerThatIsUnpluggedIsNamedAndComesBack", ("hw_sim_time_test",)),
    Mutant("full-history", "calibration/time/pose_history.cpp",
           "if (samples_.size() > settings_.capacity) samples_.pop_front();",
           "if (samples_.size() > settings_.capacity) samples_.pop_back();",
           "A full history of poses lets the newest go, not the oldest.",
           r"^PoseHistory\.RefusesSamplesOutOfOrderAndStaysBounded", ("calibration_test",)),
    # The wire.
    Mutant("stamp-fraction", "device/wire/igtl_bytes.cpp",
           "const std::uint64_t ns = ((stamp & 0xFFFFFFFFU) * 1'000'000'000 + (std::uint64_t{1} << 31U)) >> 32U;",
           "const std::uint64_t ns = stamp & 0xFFFFFFFFU;",
           "A stamp's fraction of 2^32 is taken for nanoseconds.", r"^Wire\.BirdsStatusAndHealth", ("device_wire_test",)),
    Mutant("arrival", "device/wire/json.cpp",
           'get_time(in.at("acquired_ns"), info.acquired.ns);', 'get_time(in.at("arrived_ns"), info.acquired.ns);',
           "When a frame arrived is taken for when it was exposed.", r"^Wire\.AFrameComesAsItWasSent", ("device_wire_test",)),
    Mutant("never-asked", "device/wire/client.cpp",
           "if (now < next_question_) return;", "if (next_question_ < now) return;",
           "The appliance is never asked for its time: how old a frame is counts from its arrival.",
           r"^Client\.RelatesTheAppliancesClockToItsOwn", ("device_wire_test",)),
    # What is drawn.
    Mutant("two-limits", "host/overlay/freshness.cpp",
           "} else if (age > limits.most_age) {", "} else if (age > limits.stopped) {",
           "An overlay may be as old as video that has stopped: the wrong one of two limits.",
           r"^Freshness\.", ("host_overlay_test",)),
    Mutant("age-forgotten", "host/overlay/live_picture.cpp",
           """  }
  return fresh.why_too_old;
}""",
           """  }
  return {};
}""",
           "How old a picture is takes away no overlay, unless the video has stopped.",
           r"^LivePicture\.NoStaleOverlayStaysLongerThan150MsUnderAnyFault", ("host_window_test",)),
    Mutant("circle", "host/overlay/trust.cpp",
           "fiducials_mm * fiducials_mm + hand_eye_mm * hand_eye_mm + lens_mm", "fiducials_mm * fiducials_mm + lens_mm",
           "Hand-eye's error is not added to the circle.", r"^TargetMark\.AddsUpWhatIsKnownOfTheTarget",
           ("host_overlay_test",)),
    Mutant("reference", "host/operation/live_workflow.cpp",
           "if (settings_.reference.empty()) use_reference(health->reference);",
           "if (!settings_.reference.empty()) use_reference(health->reference);",
           "The reference that the appliance names is not used: a bumped transmitter takes the overlay along.",
           r"^Referenced\.", ("host_operation_test",)),
    Mutant("scope-held-back", "host/operation/calibration_step.cpp",
           "  found_ = std::move(found);\n", "  found_ = held_back_ ? std::move(held_back_) : std::move(found);\n",
           "A calibration that was held back comes back, whatever scope the new record is of.",
           r"^Operation\.AnotherScopeIsDrawnWithByItsOwnRecord", OPERATION),
    Mutant("fsync", "host/files/write_files.cpp",
           "    if (auto synced = sync_file(part); !synced) return give_up(synced.error());\n", "",
           "A file gets its name before its bytes are on the disk.", r"^WriteFiles\.IsOnTheDiskByItsName",
           ("host_files_test",)),
    Mutant("seldom-synced", "device/birdseyed/recorder.cpp",
           "constexpr Duration kSyncEvery = Duration::from_ms(500);",
           "constexpr Duration kSyncEvery = Duration::from_ms(5000);",
           "A power cut of the appliance loses five seconds of its recording, not one.",
           r"^OperationRecording\.APowerCutOfTheAppliance", OPERATION),
    Mutant("overfull-queue", "calibration/base/bounded_queue.hpp",
           "while (!has_room(lane, waiting_[lane].size(), 0))", "while (!has_room(lane, waiting_[lane].size() - 1, 0))",
           "A queue holds one more than it should.", r"^BoundedQueue\.|^Operation\.AWindowThatStoodStill",
           ("calibration_test",) + OPERATION),
    Mutant("doubt", "host/operation/live_workflow_doubts.cpp",
           "  fiducials_.doubt();\n  pointer_ = {};", "  pointer_ = {};",
           "What speaks against a registration is told, and the overlay goes on.", r"^Referenced\.",
           ("host_operation_test",)),
    # What no campaign can see: no lock is in it, nor the names of an appliance's disk, nor a queue that holds less, and
    # the latency is none.
    Mutant("folder-fsync", "device/birdseyed/record_file.cpp",
           "bool named_ = false;", "bool named_ = true;",
           "A recording's name is never brought onto the disk.", r"^Recorder\.KeepsEverythingItIsGiven", BIRDSEYED, False),
    Mutant("recording-checksum", "device/birdseyed/recording.cpp",
           "if (tail.get<std::uint64_t>() != wire::checksum(all.first(kBlockHead + size))) return damaged();",
           "if (tail.get<std::uint64_t>() == 0) return damaged();",
           "A recording's checksums are read and not compared.", r"^Recording\.IsGoodUpToWhereItWasCutOrDamaged",
           BIRDSEYED, False),
    Mutant("latency-sign", "device/birdseyed/core.cpp",
           "timed.time.acquired = timed.time.acquired - *timed.latency;",
           "timed.time.acquired = timed.time.acquired + *timed.latency;",
           "The latency is added to the frames' times.", r"^Core\.TheRecordsLatencyIsTakenOffTheFramesTimes",
           BIRDSEYED, False),
    Mutant("shared-lock", "drivers/io/serial_port.cpp",
           "LOCK_EX | LOCK_NB", "LOCK_SH | LOCK_NB",
           "The lock on a serial port is one that several may have.", r"^SerialPort\.IsOneProgramsAlone",
           ("drivers_io_test",), False),
    Mutant("full-queue", "calibration/base/bounded_queue.hpp",
           "return values <= bound.capacity &&", "return values < bound.capacity &&",
           "A queue holds one less than it should.", r"^BoundedQueue\.", ("calibration_test",), False),
    Mutant("newest-shed", "device/wire/packet_queue.hpp",
           "    frames_.pop_front();", "    frames_.pop_back();",
           "Of frames that wait for a slow client the newest is shed.",
           r"^ClientLink\.ASlowClientGetsTheFrameThatHasBegunAndThenTheNewest", ("device_wire_test",), False),
    Mutant("former-scope", "host/operation/calibration_step.cpp",
           """one.scope.camera() == other.scope.camera() &&
         one.scope.camera_from_sensor().matrix() == other.scope.camera_from_sensor().matrix();""",
           "one.scope.camera().width_px == other.scope.camera().width_px;",
           "Another scope's record is taken for the same: a deformation by the former's views is drawn on.",
           r"^OperationWithPictures\.ADeformationIsNotTakenUpWithAnotherScope", OPERATION, False),
)
