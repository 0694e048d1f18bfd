#pragma once

#include <Eigen/Core>
#include <bitset>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "calibration/base/queue_fill.hpp"
#include "calibration/time/clock.hpp"
#include "device/wire/messages.hpp"
#include "host/operation/live_workflow.hpp"
#include "hw-sim/faults/fault_script.hpp"
#include "hw-sim/operation/operation_faults.hpp"
#include "hw-sim/operation/operation_truth.hpp"
#include "hw-sim/operation/registration_doubts.hpp"

namespace birdseye::hw_sim {

/// A law that did not hold.
struct BrokenLaw {
  double at_s = 0;   ///< of the operation
  std::string law;   ///< its name
  std::string what;  ///< in words, with figures
};

/// What must hold of an operation at any moment, whatever befalls it.
///
/// - pose: no pose is given as good that is off by more than 6 sigma of what it says of itself, nor one of a bird that
///   is turned by more than 6 sigma of the tracker's noise.
/// - age: no overlay is on the screen whose frame was exposed more than 150 ms ago.
/// - setup: no overlay is drawn with the calibration of a scope that is not the one in use, nor by a registration that
///   nobody has confirmed, that something speaks against, or that is held back: by the window's own word, and by what
///   RegistrationDoubts knows of it, which asks no window.
/// - circle: no overlay is shown as whole that is off by more than three circles, and of a thousand one at most by more
///   than one and a half. This is not asked of frames that are exposed while the scope turns in its holder or the lens
///   is zoomed, and 0.1 s after; nor, without a reference, while transmitter or patient move. Where these move while no
///   overlay of a registered patient is whole, nothing is watched that could show it: not before the window asks for a
///   landmark, or the patient is registered anew.
/// - turned: where the video shows something, no overlay is whole later than 3 s after the scope has turned in its
///   holder by 20 degrees or the lens was zoomed by 15 %, as long as that lasts. The circle is about the target, which
///   lies near the axis of both.
/// - named: a fault that befalls alone is named within 2 s, where anybody can see it.
/// - over: within 2 s of the end of a fault that befalls alone, poses of each bird and frames with poses are there
///   again.
/// - accused: later than 10 s after the last fault's end the window does not begin to say that video and poses differ.
/// - kept: a window that is opened again takes up what the one before had as it was last neither writing nor said that
///   something was not kept, or what it had later: the registration, which has the patient where it had him, with its
///   deformation and all that is known of that, and the calibration over the board. It draws nothing before a landmark
///   has been checked. What was taken back, and nothing else was kept, it does not take up. A window that cannot keep
///   something says so within 2 s.
/// - recorded: OperationRecording has it, and judges it.
/// - queues: none holds more than its bound, in values or in bytes.
/// - memory: it does not grow later than two minutes after the beginning, and 30 s after the first matching of the CT
///   with the video begins.
class OperationLaws {
 public:
  /// exposed_ns: of a frame by its number, as the camera knows it. zero_ns: when the operation's time begins.
  using ExposedNs = std::function<std::optional<std::int64_t>(std::uint64_t sequence)>;
  OperationLaws(const OperationTruth& truth, const FaultScript& faults, ExposedNs exposed_ns, std::int64_t zero_ns);

  /// The video shows what the scope sees, and the window watches it.
  void watch_pictures() { pictures_ = true; }
  /// An event as it reached the host.
  void take(const wire::Event& event, HostTime now);
  /// The window was opened.
  void opened(std::size_t checks);
  /// The window stands still: what it has to do within a time begins anew.
  void stood_still();
  /// What the window says. checks: how often a landmark has been checked.
  void take(const host::OperationView& view, std::size_t checks, HostTime now);
  /// The same, of a disk on which so many syncs have failed so far. powerless: it keeps nothing more.
  void take_kept(const host::OperationView& view, std::uint64_t failed_syncs, bool powerless, HostTime now);
  /// Of the programs' queues.
  void take(std::span<const QueueFill> queues, HostTime now);
  /// What all programs together hold.
  void take_memory(std::size_t bytes, HostTime now);
  /// The surgeon has pressed Space in the landmark check.
  void pressed(HostTime now) { doubts_.pressed(at_s(now.ns)); }
  /// What is on the screen.
  void take(const host::ShownPicture& shown, const host::LivePicture& picture, HostTime now);
  /// At the end: until_s is when the operation ended.
  void finish(double until_s);

  /// Of faults of one kind on one target.
  struct OfFault {
    std::uint64_t befell = 0, judged = 0;            ///< judged: those that befell alone
    double slowest_named_s = 0, slowest_over_s = 0;  ///< from where the fault itself began and ended
  };
  struct Figures {
    /// judged: of the green ones, those whose place the law of circles is asked of.
    std::uint64_t poses = 0, frames = 0, frames_posed = 0, shown = 0, overlaid = 0, green = 0, judged = 0, beyond = 0;
    double worst_pose = 0;     ///< of a pose, in parts of what it may be off
    double worst_age_ms = 0;   ///< of an overlay
    double worst_circles = 0;  ///< of a green overlay
    double fullest_queue = 0;  ///< in parts of its bound
    std::uint64_t faults = 0, faults_judged = 0;
    std::uint64_t moved = 0, moved_unwatched = 0;    ///< how often transmitter or patient were, without a reference
    double slowest_named_s = 0, slowest_over_s = 0;  ///< less what the fault's signs allow
    /// By target and kind, as "camera unplug". And of what spoke against the registration, as "doubt no_video": how
    /// often, and how often pictures were on the screen meanwhile.
    std::map<std::string, OfFault> by_fault;
  };
  [[nodiscard]] const Figures& figures() const { return figures_; }
  [[nodiscard]] const std::vector<BrokenLaw>& broken() const { return broken_; }

 private:
  struct Span {
    Fault fault;
    FaultTarget of;
    FaultSigns signs;
    double begins_s = 0, ends_s = 0;
    double own_end_s = 0;  ///< when the fault itself ends; ends_s is when its effects may last until
    bool alone = true;
    std::optional<double> named_s, poses_again_s, frames_again_s;
    std::bitset<3> birds_again{};  ///< those that have had a pose since its end
  };
  struct Move {
    double begins_s = 0, ends_s = 0;
    bool of_patient = false;  ///< of patient or transmitter against each other; else of scope or lens
  };
  /// How a patient is registered, and the organ deformed.
  struct Found {
    double fre_mm = 0;
    std::shared_ptr<const host::DeformedOrgan> deformed;  ///< null: the CT is shown as it was taken
    bool with_care = false;                               ///< the window says so of the deformation
    std::size_t scope = 0;                                ///< by whose record
    bool operator==(const Found&) const = default;
  };
  [[nodiscard]] double at_s(std::int64_t ns) const { return static_cast<double>(ns - zero_ns_) * 1e-9; }
  void break_law(double at_s, const char* law, std::string what);
  static std::string name_of(const Span& span);
  void judge_pose(const char* of, std::size_t bird, const Transform<Tracker, Sensor>& told, double true_s, double now_s,
                  double own_mm, double time_s);
  /// Whether a fault of the world begins or ends about then.
  static bool changes_about(const Span& span, double at_s);
  void judge_turn(const wire::Bird& bird, double true_s, double now_s);
  void take(const wire::Birds& birds, double now_s);
  void take(const wire::VideoFrame& frame, double now_s);
  void take(const wire::Health& health, double now_s);
  void name(double now_s, const std::string& words);
  void judge(const Span& span, double until_s);
  void judge_scope(double exposed_s, double now_s);
  void judge_accusation(bool accused, double now_s);
  void note_motion(bool whole, double now_s);
  /// Empty: the patient is not registered.
  [[nodiscard]] std::optional<Found> found_in(const host::OperationView& view, double now_s);
  [[nodiscard]] bool is_kept(const Found& found) const;
  void judge_registration_kept(const host::OperationView& view, double now_s);
  void judge_place_kept(const Transform<Tracker, Patient>& tracker_from_patient, double now_s);
  void judge_calibration_kept(const host::OperationView& view, double now_s);
  [[nodiscard]] bool moves_at(double exposed_s) const;
  /// Nothing else befalls then that could keep the window from seeing what slips.
  [[nodiscard]] bool is_quiet(const Span& span, double at_s) const;
  void expect_slips();
  void judge_setup(const host::LivePicture& picture, double exposed_s, double now_s);

  static constexpr double kLinger_s = 0.5;  ///< after a fault's end poses may still be made of samples that it touched
  static constexpr double kPromisedCircles = 1.5;

  const OperationTruth& truth_;
  ExposedNs exposed_ns_;
  std::int64_t zero_ns_;
  std::vector<Span> spans_;
  RegistrationDoubts doubts_;
  std::optional<wire::Health> before_;
  std::optional<double> ready_since_s_;
  std::vector<Move> moves_;               ///< that the video alone shows, in their order
  std::size_t next_move_ = 0;             ///< that has not begun yet
  std::optional<double> whole_s_;         ///< when an overlay was last whole
  std::optional<double> unwatched_to_s_;  ///< nothing could show a motion that ended then, and the window has not asked
  std::size_t most_bytes_ = 0;            ///< that were held until it settled
  double settles_s_ = 120;                ///< until then, what is done for the first time may take more memory
  std::uint64_t failed_syncs_ = 0;
  std::size_t scope_ = 0;                 ///< whose record the window had last
  std::optional<double> unsaid_since_s_;  ///< a sync failed then, and the window has not said so
  /// What was kept last, and what was found since. Empty: nothing was kept, or it may have been taken back.
  std::vector<Found> kept_;
  std::optional<double> fre_mm_;  ///< of the registration that the window has
  /// Where each registration that was drawn by had the patient, by its FRE: no two have the same.
  std::vector<std::pair<double, Eigen::Matrix4d>> places_;
  bool nothing_kept_ = true;      ///< there is no registration on the disk: none was found, or it was taken back
  bool none_to_take_up_ = false;  ///< this window was opened so, and nothing was touched since
  bool in_doubt_ = false;         ///< the registration is in doubt, or held back
  std::optional<double> may_calibrate_since_s_;    ///< all is there for it
  std::optional<std::size_t> checks_when_opened_;  ///< of a window that takes up; empty: one was checked since
  Figures figures_;
  std::vector<BrokenLaw> broken_;
  bool begins_at_board_;           ///< the appliance has no record: what calibrates is the board
  bool pictures_ = false;          ///< the video shows something
  bool accused_ = false;           ///< the window says that video and poses do not agree
  bool registered_ = false;        ///< the window says that the patient is
  bool has_matched_ = false;       ///< the CT with the video
  bool to_take_up_ = false;        ///< the window has still to say what it took up
  bool board_kept_ = false;        ///< a calibration over the board
  bool board_to_take_up_ = false;  ///< the window has still to say that it took that up
  bool whole_picture_ = false;     ///< the newest frame has the size that the lens is calibrated at
};

}  // namespace birdseye::hw_sim
