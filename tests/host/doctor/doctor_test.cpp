// What the doctor makes of a machine, of folders that stand for one, and of what others say of themselves.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "calibration/record/identity.hpp"
#include "calibration/record/record_words.hpp"
#include "drivers/system/wait.hpp"
#include "host/doctor/appliance.hpp"
#include "host/doctor/cameras.hpp"
#include "host/doctor/configured.hpp"
#include "host/doctor/display.hpp"
#include "host/doctor/first_run.hpp"
#include "host/doctor/lines.hpp"
#include "host/doctor/service.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// A folder that stands for a machine.
class Folder {
 public:
  Folder() {
    machine_.root = scratch_.path();
    machine_.may_use = [](const fs::path&) { return true; };
    file("/proc/locks", "");
  }
  void file(const std::string& path, const std::string& text, mode_t mode = 0660) const {
    const fs::path at = machine_.at(path);
    fs::create_directories(at.parent_path());
    std::ofstream(at) << text;
    ::chmod(at.c_str(), mode);
  }
  void serial_port(const std::string& tty) const {
    file("/dev/" + tty, "");
    fs::create_directories(machine_.at("/sys/class/tty/" + tty + "/device"));
  }
  /// The program has the device open.
  void holder(int process, const std::string& program, const std::string& device) const {
    file(fmt::format("/proc/{}/comm", process), program + "\n");
    fs::create_directories(machine_.at(fmt::format("/proc/{}/fd", process)));
    fs::create_symlink(device, machine_.at(fmt::format("/proc/{}/fd/5", process)));
  }
  void ftdi(const std::string& place, const std::string& serial) const {
    const std::string folder = "/sys/bus/usb/devices/" + place;
    file(folder + "/idVendor", "0403\n");
    file(folder + "/idProduct", "6001\n");
    file(folder + "/product", "FT232R USB UART\n");
    file(folder + "/serial", serial + "\n");
    file(folder + "/busnum", "1\n");
    file(folder + "/devnum", "4\n");
    file("/dev/bus/usb/001/004", "");
  }
  void refuse() {
    machine_.may_use = [](const fs::path&) { return false; };
  }
  [[nodiscard]] const Machine& machine() const { return machine_; }

 private:
  testing::Scratch scratch_;
  Machine machine_;
};

Check only(const std::vector<Check>& checks) {
  EXPECT_EQ(checks.size(), 1U);
  return checks.empty() ? Check{} : checks.front();
}

TEST(DoctorLines, WithoutALineOneIsMissing) {
  const Folder folder;
  const Check check = only(ask_all(line_questions(folder.machine())));
  EXPECT_EQ(check.state, CheckState::missing);
  EXPECT_THAT(check.remedy, HasSubstr("--server"));
}

TEST(DoctorLines, PortsThatTheKernelOnlyKeepsReadyAreNone) {
  const Folder folder;
  folder.serial_port("ttyS0");
  folder.file("/sys/class/tty/ttyS0/type", "4\n");
  folder.serial_port("ttyS1");
  folder.file("/sys/class/tty/ttyS1/type", "0\n");
  folder.file("/sys/class/tty/tty1/uevent", "");
  EXPECT_THAT(serial_ports(folder.machine()), ElementsAre("/dev/ttyS0"));
}

TEST(DoctorLines, ALineThatIsFreeAndQuickIsGood) {
  const Folder folder;
  folder.serial_port("ttyUSB0");
  folder.file("/sys/class/tty/ttyUSB0/device/latency_timer", "1\n");
  const Check check = only(ask_all(line_questions(folder.machine())));
  EXPECT_EQ(check.state, CheckState::good) << check.found;
  EXPECT_THAT(check.found, HasSubstr("free"));
  EXPECT_THAT(check.remedy, IsEmpty());
}

TEST(DoctorLines, AnAdapterThatKeepsBytesBackIsTold) {
  const Folder folder;
  folder.serial_port("ttyUSB0");
  folder.file("/sys/class/tty/ttyUSB0/device/latency_timer", "16\n");
  const Check check = only(ask_all(line_questions(folder.machine())));
  EXPECT_EQ(check.state, CheckState::could_be_better);
  EXPECT_THAT(check.found, HasSubstr("16 ms"));
  EXPECT_THAT(check.remedy, HasSubstr("60-birdseye.rules"));
}

TEST(DoctorLines, WhoHasTheLineIsNamed) {
  const Folder folder;
  folder.serial_port("ttyUSB0");
  folder.serial_port("ttyUSB1");
  folder.holder(812, "minicom", "/dev/ttyUSB0");
  const auto checks = ask_all(line_questions(folder.machine()));
  ASSERT_EQ(checks.size(), 2U);
  EXPECT_EQ(checks[0].state, CheckState::could_be_better);
  EXPECT_THAT(checks[0].found, HasSubstr("minicom (process 812)"));
  EXPECT_EQ(checks[1].state, CheckState::good);
}

TEST(DoctorLines, ALockTellsOfAProgramWhoseFilesAreNotShown) {
  const Folder folder;
  folder.serial_port("ttyUSB0");
  folder.file("/proc/77/comm", "birdseyed\n");
  struct stat node {};
  ASSERT_EQ(::stat(folder.machine().at("/dev/ttyUSB0").c_str(), &node), 0);
  const auto lock = [&](ino_t inode) {
    return fmt::format("1: FLOCK  ADVISORY  WRITE 77 {:02x}:{:02x}:{} 0 EOF\n", node.st_dev >> 8U & 0xfffU,
                       node.st_dev & 0xffU, inode);
  };
  folder.file("/proc/locks", lock(node.st_ino));
  EXPECT_THAT(holders_of(folder.machine(), "/dev/ttyUSB0").programs, ElementsAre("birdseyed (process 77)"));
  folder.file("/proc/locks", lock(node.st_ino + 1));
  EXPECT_THAT(holders_of(folder.machine(), "/dev/ttyUSB0").programs, IsEmpty());
}

TEST(DoctorRights, WhatToDoDependsOnWhatStandsInTheWay) {
  Folder folder;
  folder.serial_port("ttyUSB0");
  folder.refuse();
  struct stat node {};
  ASSERT_EQ(::stat(folder.machine().at("/dev/ttyUSB0").c_str(), &node), 0);
  folder.file("/etc/passwd", fmt::format("anna:x:{}:100::/home/anna:/bin/sh\n", ::geteuid()));
  folder.file("/etc/group", fmt::format("audio:x:65000:anna\ndialout:x:{}:otto\n", node.st_gid));
  const Check check = only(ask_all(line_questions(folder.machine())));
  EXPECT_EQ(check.state, CheckState::bad);
  EXPECT_THAT(check.found, HasSubstr("group dialout, mode 0660"));
  EXPECT_THAT(check.remedy, HasSubstr("usermod -aG dialout anna"));
  // Who has been put into the group has to log in again.
  folder.file("/etc/group", fmt::format("dialout:x:{}:otto,anna\n", node.st_gid));
  EXPECT_THAT(refusal(folder.machine(), "/dev/ttyUSB0")->remedy, HasSubstr("log in again"));
  EXPECT_THAT(refusal(folder.machine(), "/dev/ttyUSB0")->remedy, Not(HasSubstr("usermod")));
  // No group helps where the group may not.
  folder.file("/dev/ttyUSB0", "", 0600);
  EXPECT_THAT(refusal(folder.machine(), "/dev/ttyUSB0")->remedy, HasSubstr("KERNEL==\"ttyUSB0\", GROUP=\"dialout\""));
  folder.file("/dev/video0", "", 0600);
  EXPECT_THAT(refusal(folder.machine(), "/dev/video0")->remedy, HasSubstr("60-birdseye.rules"));
}

TEST(DoctorRights, APortOfTheBoardMayHaveNothingOnIt) {
  Folder folder;
  folder.serial_port("ttyS0");
  folder.refuse();
  const Check check = only(ask_all(line_questions(folder.machine())));
  EXPECT_EQ(check.state, CheckState::could_be_better);
  EXPECT_THAT(check.remedy, HasSubstr("only if the tracker is on it: "));
}

TEST(DoctorLines, AnAdapterWithoutAKernelDriverIsFound) {
  Folder folder;
  folder.ftdi("1-2", "A9XYZ");
  folder.file("/sys/bus/usb/devices/1-2:1.0/bInterfaceClass", "ff\n");
  const Check check = only(ask_all(line_questions(folder.machine())));
  EXPECT_EQ(check.name, "usb:0403:6001:A9XYZ");
  EXPECT_EQ(check.state, CheckState::good);
  EXPECT_THAT(check.found, HasSubstr("FT232R USB UART"));
  folder.refuse();
  EXPECT_EQ(only(ask_all(line_questions(folder.machine()))).state, CheckState::bad);
}

TEST(DoctorLines, ModemManagerIsToldUnlessTheRulesKeepItOff) {
  const Folder folder;
  folder.serial_port("ttyUSB0");
  folder.file("/proc/9/comm", "ModemManager\n");
  auto checks = ask_all(line_questions(folder.machine()));
  ASSERT_EQ(checks.size(), 2U);
  EXPECT_EQ(checks[1].state, CheckState::could_be_better);
  folder.file("/usr/lib/udev/rules.d/60-birdseye.rules", "");
  EXPECT_EQ(ask_all(line_questions(folder.machine())).size(), 1U);
}

TEST(DoctorCameras, WhatIsNoCameraIsBadAndNodesStandByNumber) {
  const Folder folder;
  for (const char* node : {"video10", "video2", "video", "videos3", "video1x"})
    folder.file(std::string("/dev/") + node, "");
  EXPECT_THAT(camera_nodes(folder.machine()), ElementsAre("/dev/video2", "/dev/video10"));
  const auto checks = ask_all(camera_questions(folder.machine()));
  ASSERT_EQ(checks.size(), 2U);
  EXPECT_EQ(checks[0].state, CheckState::bad);
  EXPECT_THAT(checks[0].found, HasSubstr("is no Video4Linux device"));
}

TEST(DoctorCameras, TheSecondNodeOfAWebcamIsNotTold) {
  const Folder folder;
  folder.file("/dev/video1", "");
  folder.file("/sys/class/video4linux/video1/index", "1\n");
  EXPECT_THAT(ask_all(camera_questions(folder.machine())), IsEmpty());
}

TEST(DoctorPins, AreMissingBadOrNotAllowed) {
  Folder folder;
  EXPECT_EQ(only(ask_all(pin_questions(folder.machine()))).state, CheckState::missing);
  folder.file("/dev/gpiochip0", "");
  EXPECT_EQ(only(ask_all(pin_questions(folder.machine()))).state, CheckState::bad);
  folder.refuse();
  EXPECT_EQ(only(ask_all(pin_questions(folder.machine()))).state, CheckState::could_be_better);
}

TEST(DoctorService, SaysFromWhereTheApplianceCanBeReached) {
  const Folder folder;
  const auto row = [](const char* local, const char* state) {
    return fmt::format("   0: {} 00000000:0000 {} 00000000:00000000 00:00000000 00000000\n", local, state);
  };
  const std::string head = "  sl  local_address rem_address   st tx_queue\n";
  folder.file("/proc/net/tcp",
              head + row("0100007F:4A00", "0A") + row("0201A8C0:4A00", "01") + row("00000000:4A01", "0A"));
  EXPECT_THAT(listening_at(folder.machine(), 18944), ElementsAre("127.0.0.1"));
  folder.file("/proc/net/tcp", head + row("0201A8C0:4A00", "0A"));
  EXPECT_THAT(listening_at(folder.machine(), 18944), ElementsAre("192.168.1.2"));
  folder.file("/proc/net/tcp", "garbage\n\n");
  EXPECT_THAT(listening_at(folder.machine(), 18944), IsEmpty());
}

TEST(DoctorConfigured, NamesWhatIsNotThereAndWhatIsInstead) {
  const Folder folder;
  folder.serial_port("ttyUSB0");
  folder.file("/dev/video4", "");
  folder.file("/c.toml", "[tracker]\ndevice = \"/dev/ttyUSB1\"\n[camera]\nsource = \"v4l2:/dev/video4\"\n");
  const auto checks = check_configured(folder.machine(), folder.machine().at("/c.toml"));
  ASSERT_EQ(checks.size(), 2U);
  EXPECT_EQ(checks[0].state, CheckState::bad);
  EXPECT_THAT(checks[0].found, HasSubstr("/dev/ttyUSB0"));
  EXPECT_EQ(checks[1].state, CheckState::good) << checks[1].found;
}

TEST(DoctorConfigured, AdaptersAreLookedUpAndServersNotCalled) {
  const Folder folder;
  folder.ftdi("1-2", "A9XYZ");
  const auto states = [&](const std::string& line) {
    folder.file("/c.toml", "[tracker]\ndevice = \"" + line + "\"\n");
    return only(check_configured(folder.machine(), folder.machine().at("/c.toml"))).state;
  };
  EXPECT_EQ(states("usb:0403:6001:A9XYZ"), CheckState::good);
  EXPECT_EQ(states("usb:0403:6001:OTHER"), CheckState::bad);
  EXPECT_EQ(states("tcp:10.0.0.9:4001"), CheckState::not_known);
}

TEST(DoctorQuestions, WhatHangsIsNotKnownAndTheRestIsAsked) {
  const auto done = std::make_shared<std::atomic<bool>>(false);
  const Question hangs{.area = "a", .name = "hangs", .within = Duration::from_ms(30), .ask = [done] {
                         while (!*done) sleep_for(Duration::from_ms(5));
                         return std::vector<Check>{};
                       }};
  const Question throws{
      .area = "a", .name = "throws", .ask = []() -> std::vector<Check> { throw std::runtime_error("no luck"); }};
  const Question answers{.area = "a", .name = "answers", .ask = [] {
                           return std::vector<Check>{{"a", "answers", CheckState::good, "here", ""}};
                         }};
  std::vector<std::string> heard;
  const auto checks = ask_all({hangs, throws, answers}, [&heard](const Check& check) { heard.push_back(check.name); });
  *done = true;
  EXPECT_THAT(heard, ElementsAre("hangs", "throws", "answers"));
  ASSERT_EQ(checks.size(), 3U);
  EXPECT_EQ(checks[0].state, CheckState::not_known);
  EXPECT_THAT(checks[0].found, HasSubstr("0.03 s"));
  EXPECT_EQ(checks[1].state, CheckState::not_known);
  EXPECT_EQ(checks[1].found, "no luck");
  EXPECT_EQ(checks[2].state, CheckState::good);
  EXPECT_FALSE(any_bad(checks));
}

TEST(DoctorDisplay, JudgesWhatAWindowHas) {
  DisplayFacts facts;
  facts.problem = "window: there is no display; set DISPLAY";
  EXPECT_EQ(only(display_checks(facts)).state, CheckState::missing);
  facts.named = true;
  EXPECT_EQ(only(display_checks(facts)).state, CheckState::bad);
  facts = {true, "", "4.6 NVIDIA 535", "NVIDIA RTX A2000", 1920, 1080, 1};
  for (const Check& check : display_checks(facts)) EXPECT_EQ(check.state, CheckState::good) << check.name;
  facts.renderer = "LLVMpipe (LLVM 15.0.6, 256 bits)";
  EXPECT_EQ(display_checks(facts)[1].state, CheckState::could_be_better);
  facts.scale = 2;
  EXPECT_EQ(display_checks(facts)[2].state, CheckState::could_be_better);
  EXPECT_THAT(display_checks(facts)[2].remedy, HasSubstr("2560x1440"));
  facts.width_px = 0;
  EXPECT_EQ(display_checks(facts)[2].state, CheckState::not_known);
}

const Check& named(const std::vector<Check>& checks, const std::string& name) {
  static const Check none;
  for (const Check& check : checks) {
    if (check.name == name) return check;
  }
  ADD_FAILURE() << "nothing is said of " << name;
  return none;
}

TEST(DoctorAppliance, EachInstrumentIsJudgedByItsState) {
  ApplianceTold told;
  told.status = wire::Status{false, "degraded: camera silent"};
  told.health.emplace();
  told.health->instruments = {{"tracker", "running", "miniBIRD 800", 0, {}},
                              {"camera", "silent", "/dev/video0 sends no frames", 0, {}},
                              {"gpio", "starting", "", 0, {}}};
  told.calibration = wire::Calibration{false, "the camera is another one", ""};
  const auto checks = appliance_checks("cart:18944", told);
  for (const Check& check : appliance_checks("a", {wire::Status{true, ""}, {}, {}, ""})) EXPECT_NE(check.found, "");
  EXPECT_EQ(named(checks, "connection").state, CheckState::good);
  EXPECT_EQ(named(checks, "status").state, CheckState::bad);
  EXPECT_EQ(named(checks, "tracker").state, CheckState::good);
  EXPECT_EQ(named(checks, "camera").state, CheckState::bad);
  EXPECT_THAT(named(checks, "camera").found, HasSubstr("sends no frames"));
  EXPECT_EQ(named(checks, "gpio").state, CheckState::could_be_better);
  EXPECT_EQ(named(checks, "calibration record").state, CheckState::missing);
  EXPECT_THAT(named(checks, "calibration record").found, HasSubstr("another one"));
  EXPECT_EQ(named(checks, "clock").state, CheckState::not_known);
}

TEST(DoctorAppliance, ARecordBoundToNothingNamesTheCommandThatBindsIt) {
  ApplianceTold told;
  const std::string why =
      fmt::format("calibration of scope \"\" is not used: {}", calibration::misfit("tracker", {}, {}));
  told.status = wire::Status{false, why};
  told.calibration = wire::Calibration{false, why, ""};
  const std::string command = "birdseye calibrate record FILE --bind cart:18944";
  auto checks = appliance_checks("cart:18944", told);
  EXPECT_EQ(named(checks, "status").remedy, command);
  EXPECT_EQ(named(checks, "calibration record").remedy, command);
  told.status->text = fmt::format("degraded: camera silent; {}", why);
  checks = appliance_checks("cart:18944", told);
  EXPECT_EQ(named(checks, "status").remedy, command + "; see the instruments below, too");
  // Of another tracker: the instruments are well.
  told.status->text = "calibration of scope \"\" is not used: the record is of tracker model a; this one's is b";
  told.calibration->why_not = told.status->text;
  checks = appliance_checks("cart:18944", told);
  EXPECT_EQ(named(checks, "status").remedy, "see the calibration record below");
  EXPECT_THAT(named(checks, "calibration record").remedy, HasSubstr("[calibration] record"));
  told.calibration->why_not =
      fmt::format("calibration: r.json: {} [camera] delay_ms = 0", calibration::kOfAnotherDelay);
  checks = appliance_checks("cart:18944", told);
  EXPECT_THAT(named(checks, "calibration record").remedy, HasSubstr("--server cart:18944 --record FILE"));
}

TEST(DoctorAppliance, AFewLineErrorsAreNoTroubleAndASteadyTrickleIs) {
  ApplianceTold told;
  told.health.emplace();
  told.health->measurements = 100'000;
  told.health->line_errors = 9;
  EXPECT_EQ(named(appliance_checks("a", told), "losses").state, CheckState::good);
  told.health->line_errors = 2000;
  EXPECT_EQ(named(appliance_checks("a", told), "losses").state, CheckState::could_be_better);
}

TEST(DoctorAppliance, SaysWhoAnswersAndWhetherOthersMayReadAndChangeWhatComes) {
  ApplianceTold told;
  told.health.emplace();
  told.machine = "cart-1";
  const Check known = appliance_checks("cart:18944", told).front();
  EXPECT_EQ(known.state, CheckState::good);
  EXPECT_THAT(known.found, HasSubstr("cart:18944 is cart-1, by its key"));
  EXPECT_THAT(known.found, ::testing::Not(HasSubstr("without TLS")));
  told.machine.clear();
  told.plain = true;
  const Check plain = appliance_checks("plain:cart:18944", told).front();
  EXPECT_EQ(plain.state, CheckState::could_be_better);
  EXPECT_THAT(plain.found, HasSubstr("without TLS: others on the network may read and change"));
  EXPECT_THAT(plain.remedy, HasSubstr("birdseye pair"));
}

TEST(DoctorAppliance, AMachineThatIsNotPairedIsToBePairedAndOneThatDoesNotAnswerIsToBeLookedFor) {
  const Check stranger = connection_fault(
      {Errc::bad_value, "cart:18944: its key is not known here; pair the two machines: birdseye pair cart"});
  EXPECT_EQ(stranger.found, "cart:18944: its key is not known here");
  EXPECT_EQ(stranger.remedy, "pair the two machines: birdseye pair cart");
  EXPECT_THAT(connection_fault({Errc::bad_value, "\"::\" is no address of an appliance"}).remedy,
              HasSubstr("192.168.1.20:18944"));
  EXPECT_THAT(connection_fault({Errc::timeout, "cart:18944: nobody answers; does birdseyed run there"}).remedy,
              HasSubstr("cable"));
}

TEST(DoctorAppliance, WhatSaysNothingOfBirdseyedIsNone) {
  EXPECT_EQ(only(appliance_checks("a", {})).state, CheckState::bad);
  ApplianceTold other;
  other.peer = "an OpenIGTLink server";
  EXPECT_EQ(only(appliance_checks("a", other)).state, CheckState::good);
}

TEST(DoctorFirstRun, SaysWhatThisMachineHasForWhatWasNotNamed) {
  const Folder folder;
  const auto rows = [&](const FirstRun& given) { return ask_all(first_run_questions(folder.machine(), given)); };
  for (const char* name : {"Tracker and camera", "CT"}) EXPECT_EQ(named(rows({}), name).state, CheckState::missing);
  EXPECT_THAT(named(rows({}), "Tracker and camera").found, HasSubstr("no tracker and no camera"));
  folder.serial_port("ttyUSB0");
  folder.file("/dev/video0", "");
  EXPECT_THAT(named(rows({}), "Tracker and camera").found, HasSubstr("/dev/ttyUSB0, /dev/video0"));
  folder.file("/proc/net/tcp", "   0: 0100007F:4A00 00000000:0000 0A 00000000:00000000\n");
  EXPECT_THAT(named(rows({}), "Tracker and camera").remedy, HasSubstr("--server 127.0.0.1:18944"));
}

TEST(DoctorFirstRun, WhatWasNamedIsLookedAt) {
  const Folder folder;
  FirstRun given{"cart:18944", folder.machine().at("/proc/locks"), "liver.nii.gz", false, "chessboard:14x10:3mm"};
  auto rows = ask_all(first_run_questions(folder.machine(), given));
  EXPECT_EQ(named(rows, "Tracker and camera").state, CheckState::not_known);  // it is not called
  EXPECT_EQ(named(rows, "CT").state, CheckState::good);
  EXPECT_EQ(named(rows, "Organs in the CT").state, CheckState::bad);
  EXPECT_THAT(named(rows, "Organs in the CT").remedy, HasSubstr("--organ"));
  EXPECT_EQ(named(rows, "Calibration board").state, CheckState::good);
  given.ct = folder.machine().at("/no/such/ct");
  given.organ_named = true;
  rows = ask_all(first_run_questions(folder.machine(), given));
  EXPECT_EQ(named(rows, "CT").state, CheckState::bad);
  EXPECT_EQ(named(rows, "Organs in the CT").state, CheckState::good);
}

TEST(DoctorFirstRun, TheDisplaysRowIsItsWorstCheckInSentences) {
  const DisplayFacts facts{true, "", "4.5", "llvmpipe", 1920, 1080, 1};
  const Check row = display_row(display_checks(facts));
  EXPECT_EQ(row.state, CheckState::could_be_better);
  EXPECT_EQ(row.found, "The processor draws, by llvmpipe.");
  EXPECT_EQ(display_row({}).state, CheckState::not_known);
}

/// What a theatre nurse cannot read: options, paths, and the programs' names.
void expect_for_the_room(const std::vector<Check>& rows) {
  for (const Check& row : rows) {
    EXPECT_FALSE(row.in_the_room.empty()) << row.found;
    for (const char* word : {"--", "/", "_", "birdseyed", "HOST", "DICOM", "llvmpipe"})
      EXPECT_THAT(row.in_the_room, Not(HasSubstr(word)));
  }
}

TEST(DoctorFirstRun, EachRowSaysToThePeopleInTheRoomWhatTheyDo) {
  const Folder folder;
  FirstRun given;
  const auto rows = [&] { return ask_all(first_run_questions(folder.machine(), given)); };
  expect_for_the_room(rows());
  EXPECT_EQ(named(rows(), "Tracker and camera").in_the_room,
            "Neither a tracker nor a camera is plugged in here. Switch both on, and check their cables.");
  folder.serial_port("ttyUSB0");
  expect_for_the_room(rows());
  EXPECT_THAT(named(rows(), "Tracker and camera").in_the_room, HasSubstr("Nothing reads the tracker and the camera."));
  folder.file("/proc/net/tcp", "   0: 0100007F:4A00 00000000:0000 0A 00000000:00000000\n");
  expect_for_the_room(rows());
  EXPECT_THAT(named(rows(), "Tracker and camera").in_the_room, HasSubstr("this window was started without it"));
  given = {"cart:18944", folder.machine().at("/no/such/ct"), "liver.nii.gz", false, "chessboard:14x10:3mm"};
  expect_for_the_room(rows());
  EXPECT_THAT(named(rows(), "CT").in_the_room, HasSubstr("is not where it should be"));
  EXPECT_THAT(named(rows(), "Organs in the CT").in_the_room, HasSubstr("which one the camera shows is not named"));
  given.organ_named = true;
  given.ct = folder.machine().at("/proc/net/tcp");
  expect_for_the_room(rows());
  EXPECT_EQ(named(rows(), "CT").in_the_room, "The patient's CT is there.");
}

TEST(DoctorFirstRun, TheScreensRowSaysToThePeopleInTheRoomWhatTheyDo) {
  const auto row = [](const DisplayFacts& facts) { return display_row(display_checks(facts)); };
  expect_for_the_room({row({true, "", "4.5", "a card", 1920, 1080, 1}),
                       row({true, "", "4.5", "llvmpipe", 1920, 1080, 1}),
                       row({true, "", "4.5", "a card", 1024, 600, 1}), row({true, "", "4.5", "a card", 0, 0, 1})});
  EXPECT_THAT(row({true, "", "4.5", "a card", 1024, 600, 1}).in_the_room, HasSubstr("Take a larger screen"));
}

TEST(DoctorText, ALineStaysOneLineAndNumbersAreAllThere) {
  const std::vector<Check> checks{{"cameras", "ev\nil", CheckState::bad, "\x1b[2Jcard\r\n", "go\non"},
                                  {"cameras", "b", CheckState::good, "fine", ""}};
  EXPECT_EQ(lines_of(checks[0]), "  bad              ev il:  [2Jcard  \n                   do: go on\n");
  EXPECT_EQ(sum_of(checks), "1 good, 1 bad");
  const nlohmann::json json = check_json(checks);
  EXPECT_EQ(json["checks"].size(), 2U);
  EXPECT_EQ(json["checks"][0]["state"], "bad");
  EXPECT_FALSE(json["checks"][1].contains("do"));
  EXPECT_EQ(json["counts"]["missing"], 0);
}

}  // namespace
}  // namespace birdseye::host
