#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tests/support/rehearsal.hpp"

/// Lies that the window is told, and what must come of each.
namespace birdseye::testing {

using Lie = std::function<void(Rehearsal&)>;

inline constexpr double kWatched_s = 8;

/// What came of a lie.
struct Outcome {
  std::vector<std::string> said;  ///< by the window
  std::size_t green = 0;          ///< frames with a whole overlay, once the lie was told
  std::size_t off = 0;            ///< of them, those that are further off than 1.5 circles
  double worst_mm = 0;            ///< the largest error among them
  double worst_circles = 0;       ///< the same over the circle that was stated
  double ends_s = 0;              ///< from the lie to the last green frame
  bool goes_on = false;           ///< green to the end
};

/// What must come of it.
enum class Must {
  refuse,    ///< there is no green frame
  end,       ///< the overlay goes away: within a second, or before it is wrong
  withhold,  ///< where there is an overlay, it is right
  unseen,    ///< nothing can see it: the row says what would
};

struct Row {
  std::string lie;
  Must must = Must::refuse;
  std::string say;   ///< part of what the window says; empty: nothing
  std::string note;  ///< for the page
  std::function<Outcome()> tell;
};

Outcome outcome_of(const Watched& seen);
/// From the first: what a surgeon who follows the manual gets to see.
Outcome from_the_start(const Lie& lie);

/// What the window says where video and poses do not agree.
inline constexpr const char* kVideo = "video and poses do not agree";

Transform<Tracker, Tracker> bump();
void move_patient(Rehearsal& o);
void turn_in_holder(Rehearsal& o);
void zoom(Rehearsal& o, double by);

/// Tells all of a table's lies, and writes the table, or holds it against the page.
void settle(const std::string& name, const std::vector<Row>& rows);

}  // namespace birdseye::testing
