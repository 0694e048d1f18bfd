#include "tests/host/operation/lies.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"
#include "tests/support/page_table.hpp"

namespace birdseye::testing {

namespace {

using Vector = Eigen::Vector3d;

constexpr double kMostCircles = 1.5;

std::string line_of(const Row& row, const Outcome& out) {
  std::string said;
  for (const std::string& words : out.said)
    if (!row.say.empty() && words.find(row.say) != std::string::npos) said = words;
  for (const std::string& words : out.said)
    if (said.empty()) said = words;
  if (row.must == Must::withhold || row.must == Must::unseen) said.clear();
  const char* const end = row.must == Must::unseen ? "not seen"
                          : out.goes_on            ? "stays"
                          : out.green == 0         ? "never drawn"
                                                   : "";
  return fmt::format("| {} | {} | {} | {} | {} |", row.lie, said.empty() ? "-" : said,
                     out.green == 0 ? "-" : fmt::format("{:.1f} mm, {:.1f} circles", out.worst_mm, out.worst_circles),
                     *end != '\0' ? end : fmt::format("{:.2f} s", out.ends_s), row.note.empty() ? "-" : row.note);
}

void judge(const Row& row, const Outcome& out) {
  SCOPED_TRACE(row.lie);
  const bool said = row.say.empty() || std::ranges::any_of(out.said, [&](const std::string& words) {
                      return words.find(row.say) != std::string::npos;
                    });
  EXPECT_TRUE(said) << fmt::format("{}", fmt::join(out.said, "; "));
  switch (row.must) {
    case Must::refuse:
      EXPECT_EQ(out.green, 0U);
      break;
    case Must::end:
      EXPECT_FALSE(out.goes_on);
      EXPECT_TRUE(out.off == 0 || out.ends_s < 1) << out.ends_s;
      break;
    case Must::withhold:
      EXPECT_EQ(out.off, 0U) << out.worst_circles;
      break;
    case Must::unseen:
      EXPECT_TRUE(out.goes_on) << "it is seen";
      break;
  }
}

/// What is measured differs by a hair from one compiler to another: the page is held to what was done and said.
std::string unmeasured(const std::string& line) {
  std::string out;
  for (const char c : line.substr(0, line.find(" | ", line.find(" | ") + 1)))
    if (std::isdigit(static_cast<unsigned char>(c)) == 0 && c != '.') out += c;
  return out;
}

}  // namespace

Outcome outcome_of(const Watched& seen) {
  Outcome out;
  out.said = seen.reasons;
  out.green = seen.green.size();
  for (const GreenFrame& frame : seen.green) {
    const double circles = frame.error_mm / frame.radius_mm;
    out.worst_mm = std::max(out.worst_mm, frame.error_mm);
    out.worst_circles = std::max(out.worst_circles, circles);
    if (circles > kMostCircles) ++out.off;
  }
  out.ends_s = std::max(0.0, seen.last_green_s);
  out.goes_on = seen.last_green_s > kWatched_s - 0.2;
  return out;
}

Outcome from_the_start(const Lie& lie) {
  Rehearsal operation(1);
  lie(operation);
  Outcome none;
  if (!operation.begin()) {
    none.said = {operation.workflow().view().note(host::LiveStep::calibrate).line};
    return none;
  }
  if (!operation.register_patient()) {
    const host::OperationView view = operation.workflow().view();
    none.said = {view.fault, view.registration_fault, view.patient_fault, view.note(host::LiveStep::fiducials).line};
    return none;
  }
  if (!operation.check()) {
    none.said = {operation.workflow().view().note(host::LiveStep::check).line};
    return none;
  }
  operation.watch(0.4);
  return outcome_of(operation.watch(kWatched_s));
}

Transform<Tracker, Tracker> bump() {
  return {rotation_exp(Vector(0.02, -0.03, 0.04)), Vector(6, -4, 5)};
}

void move_patient(Rehearsal& o) {
  o.truth.tracker_from_patient = bump() * o.truth.tracker_from_patient;
}

void turn_in_holder(Rehearsal& o) {
  const Transform<Camera, Camera> turn(rotation_exp(Vector(0, 0, 30 * kRadPerDeg)), Vector::Zero());
  o.truth.camera_from_sensor = turn * o.truth.camera_from_sensor;
}

void zoom(Rehearsal& o, double by) {
  o.truth.lens.fx_px *= by;
  o.truth.lens.fy_px *= by;
}

void settle(const std::string& name, const std::vector<Row>& rows) {
  std::vector<std::string> lines{
      "| what was done | what the window says | worst error drawn | the overlay ends after | by what, or what would "
      "see it |",
      "|---|---|---|---|---|"};
  std::size_t green = 0, off = 0;
  for (const Row& row : rows) {
    const Outcome out = row.tell();
    judge(row, out);
    lines.push_back(line_of(row, out));
    if (row.must == Must::unseen) continue;
    green += out.green;
    off += out.off;
  }
  fmt::print("{} rows; {} of {} green frames are off by more than 1.5 circles\n", rows.size(), off, green);
  settle_table("lies.md", "BIRDSEYE_LIES_PAGE", "./run lies", name, lines, unmeasured);
}

}  // namespace birdseye::testing
