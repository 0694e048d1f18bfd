#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "device/wire/messages.hpp"
#include "hw-sim/operation/operation_truth.hpp"

namespace birdseye::hw_sim {

/// Whether somebody has to look whether the patient's registration holds, whatever the window says of it: by what truly
/// happened, by what reached the window, and by where the pointer truly was. It knows the doubts that the window
/// promises (docs/manual/live.md, "A registration in doubt"), of those of which it can be sure:
///
/// - a window was opened: nobody has touched or looked since;
/// - the reference was not in the poses for a while, or slipped in a moment (come_off() says when the window must have
///   seen that);
/// - without a reference, neither video nor poses of the scope came for ten seconds.
///
/// One ends where the pointer was at three fiducials since, or Space was pressed in the landmark check with the pointer
/// at two places that lie apart. Where the window asks for more than that, it may: nothing is drawn meanwhile.
class RegistrationDoubts {
 public:
  /// zero_ns: when the operation's time begins.
  RegistrationDoubts(const OperationTruth& truth, std::int64_t zero_ns) : truth_(truth), zero_ns_(zero_ns) {}

  /// The reference slips from then to then, far and quickly enough to be seen, and nothing hides it. One after the
  /// other.
  void come_off(double begins_s, double ends_s) { slips_.push_back({begins_s, ends_s}); }

  void opened();
  /// As the window takes it.
  void take(const wire::Event& event, double now_s);
  /// The surgeon has pressed Space in the landmark check.
  void pressed(double now_s);
  /// A picture is on the screen. Why it may bear no overlay; empty: it may.
  std::string shown(bool overlaid, double now_s);

  struct OfDoubt {
    std::uint64_t began = 0, judged = 0;  ///< judged: pictures were on the screen before it ended
  };
  [[nodiscard]] const std::map<std::string, OfDoubt>& figures() const { return figures_; }

 private:
  struct Slip {
    double begins_s = 0, ends_s = 0;
  };
  struct Doubt {
    std::string name;
    bool judged = false;
  };
  void follow_birds(const wire::Birds& birds, double now_s);
  void follow_reference(double acquired_s, bool seen);
  void begin(const char* name);
  void end();
  void follow_pointer(double now_s);
  [[nodiscard]] bool referenced() const { return truth_.birds() > 2; }
  /// The fiducials, and then the target. Empty: the pointer is at none.
  [[nodiscard]] std::optional<std::size_t> place_pointed_at(double now_s) const;
  [[nodiscard]] const Eigen::Vector3d& place_mm(std::size_t place) const;

  const OperationTruth& truth_;
  std::int64_t zero_ns_;
  std::vector<Slip> slips_;
  std::size_t next_slip_ = 0;  ///< that the window need not have seen yet
  std::optional<Doubt> doubt_;
  bool drawn_ = false;                       ///< an overlay was, since the last doubt: there is a registration
  std::set<std::size_t> touched_;            ///< fiducials, since an overlay was drawn last
  std::optional<std::size_t> looked_at_;     ///< the first of two places
  std::optional<double> at_place_s_;         ///< when the pointer was at one last
  bool told_of_reference_ = false;           ///< the window was
  std::optional<double> reference_s_;        ///< the newest pose that has it, by its own time
  std::optional<double> reference_since_s_;  ///< without a hole, and known to the window
  std::optional<double> video_s_, scope_s_;  ///< when the newest reached the window
  std::map<std::string, OfDoubt> figures_;
};

}  // namespace birdseye::hw_sim
