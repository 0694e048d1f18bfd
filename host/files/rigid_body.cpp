#include "host/files/rigid_body.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "calibration/base/lower_case.hpp"
#include "calibration/points/point_fit.hpp"
#include "host/files/column_names.hpp"
#include "host/files/pose_collector.hpp"
#include "host/files/text_rows.hpp"

namespace birdseye::host {

namespace {

using Points = std::vector<Eigen::Vector3d>;
using Order = std::vector<std::size_t>;

constexpr std::size_t kMostPoints = 1000;
/// All orders of more are too many to try.
constexpr std::size_t kMostToReorder = 9;
/// So much larger is no fault of measuring.
constexpr double kOtherUnit = 2;
constexpr const char* kLines = "give x,y,z a line, with a name before them or none";

std::optional<Eigen::Vector3d> place_of(const std::vector<std::string>& fields, std::size_t first, double mm_per_unit) {
  Eigen::Vector3d out;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const ReadNumber number = read_number(fields[first + axis]);
    if (!number.problem.empty()) return std::nullopt;
    out[static_cast<int>(axis)] = mm_per_unit * number.value;
  }
  return out;
}

/// Of the points that were seen: those of the body, and where they were.
std::pair<Points, Points> seen_pairs(const Points& body, const SeenPoints& seen) {
  std::pair<Points, Points> out;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!seen[i]) continue;
    out.first.push_back(body[i]);
    out.second.push_back(*seen[i]);
  }
  return out;
}

std::optional<double> rms_of_fit(const Points& body, const Points& seen) {
  const auto fit = calibration::fit_points<Tracker, Sensor>(seen, body);
  if (!fit) return std::nullopt;
  return fit->fre_rms_mm;
}

Points mirrored(Points points) {
  for (Eigen::Vector3d& p : points) p.z() = -p.z();
  return points;
}

Points in_order(const Points& points, const Order& order) {
  Points out;
  for (const std::size_t i : order) out.push_back(points[i]);
  return out;
}

/// The order of the body's points in which their distances from each other come nearest to those of the seen ones.
Order best_order(const Points& body, const Points& seen) {
  const std::size_t n = body.size();
  Order order(n), best;
  std::iota(order.begin(), order.end(), 0U);
  double least = INFINITY;
  do {
    double sum = 0;
    for (std::size_t i = 0; i < n && sum < least; ++i) {
      for (std::size_t k = i + 1; k < n; ++k) {
        const double off = (body[order[i]] - body[order[k]]).norm() - (seen[i] - seen[k]).norm();
        sum += off * off;
      }
    }
    if (sum < least) {
      least = sum;
      best = order;
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return best;
}

double spread_of(const Points& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / static_cast<double>(points.size());
  double sum = 0;
  for (const Eigen::Vector3d& p : points) sum += (p - mean).squaredNorm();
  return std::sqrt(sum);
}

Points scaled(Points points, double by) {
  for (Eigen::Vector3d& p : points) p *= by;
  return points;
}

/// Of which two units a ratio of lengths is: " (metres and mm?)"; empty where of none.
std::string units_of(double ratio) {
  struct Units {
    double ratio;
    const char* words;
  };
  constexpr double kAlike = 0.03;
  for (const Units& units : {Units{1000, "metres and mm"}, Units{100, "metres and cm"}, Units{25.4, "inches and mm"},
                             Units{39.37, "metres and inches"}, Units{10, "cm and mm"}, Units{2.54, "inches and cm"}}) {
    if (std::abs(std::max(ratio, 1 / ratio) / units.ratio - 1) < kAlike) return fmt::format(" ({}?)", units.words);
  }
  return {};
}

/// Three digits, and all before the point of larger numbers.
std::string three_digits(double value) {
  return value < 100 ? fmt::format("{:.3g}", value) : fmt::format("{:.0f}", value);
}

/// Words on a recording of a body of another size.
std::string of_another_size(double size) {
  const std::string units = units_of(size);
  const double factor = std::max(size, 1 / size);
  const std::string number = three_digits(factor);
  return fmt::format(
      "the recording's points lie {} as far apart as the body's: {}{}", size > 1 ? number + " times" : "1/" + number,
      units.empty() && factor < kOtherUnit ? "measure the body's points anew, or have the tracker calibrated"
                                           : "give both in one unit",
      units);
}

std::string names_in(const RigidBody& body, const Order& order) {
  std::vector<std::string> out;
  for (const std::size_t i : order) out.push_back(body.names.empty() ? fmt::format("{}", i + 1) : body.names[i]);
  return fmt::format("{}", fmt::join(out, ","));
}

Result<void> check_names(const RigidBody& body) {
  if (body.names.empty()) return {};
  if (body.names.size() != body.points_mm.size())
    return Error{Errc::bad_format, "some of its points have names and some have none: name all, or none"};
  std::set<std::string> known;
  for (const std::string& name : body.names) {
    if (!known.insert(lower_case(name)).second)
      return Error{Errc::bad_format, fmt::format("two of its points are called {}: {}", name, kLines)};
  }
  return {};
}

}  // namespace

Result<RigidBody> read_rigid_body(const std::filesystem::path& path, double mm_per_unit) {
  auto rows = TextRows::open(path);
  if (!rows) return rows.error();
  RigidBody body;
  bool first = true;
  while (auto row = rows->next()) {
    if (row->remark) continue;
    drop_empty_ends(row->fields, 3);
    const std::size_t columns = row->fields.size();
    const std::size_t at = columns == 4 ? 1 : 0;
    const auto place = columns == 3 || columns == 4 ? place_of(row->fields, at, mm_per_unit) : std::nullopt;
    const bool header = first && !place && !read_number(row->fields.back()).problem.empty();
    first = false;
    if (header) continue;
    if (!place || !place->allFinite())
      return Error{Errc::bad_format, fmt::format("{}: line {}: is no point but {} numbers or words; {}", path.string(),
                                                 row->line, columns, kLines)};
    if (at == 1) body.names.push_back(row->fields[0]);
    body.points_mm.push_back(*place);
    if (body.points_mm.size() > kMostPoints)
      return Error{Errc::bad_format,
                   fmt::format("{}: has more than {} points; is it the recording?", path.string(), kMostPoints)};
  }
  if (body.points_mm.size() < 3)
    return Error{Errc::bad_value, fmt::format("{}: has {} points; a body's pose needs three, not on a line: {}",
                                              path.string(), body.points_mm.size(), kLines)};
  if (const auto named = check_names(body); !named) return named.error().with_context(path.string());
  return body;
}

Result<void> check_size(const RigidBody& body, double mm_per_unit, bool unit_said) {
  constexpr double kSmallest_mm = 20, kLargest_mm = 1500;
  double size_mm = 0;
  for (const Eigen::Vector3d& a : body.points_mm) {
    for (const Eigen::Vector3d& b : body.points_mm) size_mm = std::max(size_mm, (a - b).norm());
  }
  if (size_mm <= kLargest_mm && (unit_said || size_mm >= kSmallest_mm)) return {};
  std::vector<std::string> units, options;
  for (const char* unit : {"mm", "cm", "in", "m"}) {
    const double per = mm_per(unit).value_or(1), as_mm = size_mm / mm_per_unit * per;
    if (as_mm < kSmallest_mm || as_mm > kLargest_mm) continue;
    units.push_back(name_of_mm(per));
    options.push_back(fmt::format("--unit {}", unit));
  }
  return Error{Errc::bad_value,
               fmt::format("its points are at most {} mm apart, which no body is that a tracker follows: {}",
                           three_digits(size_mm),
                           units.empty() ? std::string("see in which unit it was written")
                                         : fmt::format("if its lengths and the recording's are in {}, say so: {}",
                                                       fmt::join(units, " or "), fmt::join(options, " or ")))};
}

std::string explain_misfit(const RigidBody& body, const SeenPoints& seen) {
  const auto pairs = seen_pairs(body.points_mm, seen);
  const Points &own = pairs.first, &places = pairs.second;
  const auto as_given = rms_of_fit(own, places);
  if (!as_given) return {};
  // A fifth is less than chance makes of points that do not belong together.
  const double good_mm = *as_given / 5;
  const double size = spread_of(places) / spread_of(own);
  if (size > 30 || size < 1.0 / 30) return of_another_size(size);
  const auto fits = [&](const Points& points) {
    const auto rms = rms_of_fit(points, places);
    return rms && *rms < good_mm;
  };
  if (fits(scaled(own, size))) return of_another_size(size);
  if (fits(mirrored(own))) return "the body is mirrored: its points fit with z negated";
  if (own.size() != body.points_mm.size() || own.size() > kMostToReorder) return {};
  const Order order = best_order(own, places);
  const Points ordered = in_order(own, order);
  const bool straight = fits(ordered);
  if (!straight && !fits(mirrored(ordered))) return {};
  return fmt::format("the body's points are in another order than the recording's: they fit in the order {}{}",
                     names_in(body, order), straight ? "" : ", mirrored");
}

}  // namespace birdseye::host
