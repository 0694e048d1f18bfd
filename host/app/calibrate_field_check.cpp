#include "host/app/calibrate_field_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/system/clock.hpp"
#include "drivers/system/program.hpp"
#include "host/app/results.hpp"
#include "host/calibrate/field_pictures.hpp"
#include "host/files/field_files.hpp"
#include "host/files/write_files.hpp"

namespace birdseye::host {

namespace {

using calibration::CheckedPlace;
using calibration::FieldCheck;

/// The history is one of days: a slip of the hand would stand in it for good.
std::string is_day(const std::string& when) {
  static const std::regex kDay("([0-9]{4})-([0-9]{2})-([0-9]{2})(T([01][0-9]|2[0-3]):[0-5][0-9])?");
  std::smatch part;
  if (std::regex_match(when, part, kDay)) {
    const std::chrono::year_month_day day{std::chrono::year(std::stoi(part[1])),
                                          std::chrono::month(static_cast<unsigned>(std::stoi(part[2]))),
                                          std::chrono::day(static_cast<unsigned>(std::stoi(part[3])))};
    if (day.ok()) return "";
  }
  return fmt::format("\"{}\" is no day: give it as 2026-11-29, or with the time, 2026-11-29T08:30", when);
}

constexpr std::size_t kDateLength = std::string_view("2026-11-29").size();

struct CalibrateFieldCheckOptions {
  std::filesystem::path plate, measured, history, field;
  std::string when;
  ResultPaths results;
};

/// The map that corrects the places. The day is checked also by one that nobody known signed, which the verdict says.
Result<AdmittedField> field_of(const CalibrateFieldCheckOptions& options) {
  if (options.field.empty()) return AdmittedField();
  const auto authors = Authors::of_this_machine(true);
  if (authors) return read_field_map(options.field, *authors);
  auto read = read_field_map(options.field);  // without a key of its own a machine knows nobody
  if (!read) return read.error();
  return AdmittedField{std::move(read->map), "of an author who cannot be told: " + authors.error().what};
}

using Places = std::vector<std::pair<std::string, Eigen::Vector3d>>;

/// Of two places of one name nobody can tell which is meant.
Result<void> check_names(const Places& places, const std::filesystem::path& path) {
  std::set<std::string> names;
  for (const auto& [name, place] : places) {
    if (!names.insert(name).second)
      return Error{Errc::bad_value, fmt::format("{}: has \"{}\" twice; give each place once, by a name of its own",
                                                path.string(), name)};
  }
  return {};
}

Result<std::vector<CheckedPlace>> places_of(const CalibrateFieldCheckOptions& options,
                                            const std::optional<calibration::FieldMap>& map) {
  const auto plate = read_places(options.plate);
  if (!plate) return plate.error();
  auto measured = read_places(options.measured);
  if (!measured) return measured.error();
  if (const auto sound = check_names(*plate, options.plate); !sound) return sound.error();
  if (const auto sound = check_names(*measured, options.measured); !sound) return sound.error();
  std::vector<CheckedPlace> out;
  for (const auto& [name, place] : *measured) {
    const auto known =
        std::find_if(plate->begin(), plate->end(), [&name = name](const auto& one) { return one.first == name; });
    if (known == plate->end())
      return Error{Errc::bad_value, fmt::format("{}: \"{}\" is no place of {}; give both the same names",
                                                options.measured.string(), name, options.plate.string())};
    CheckedPlace one{name, known->second, place};
    if (map) {
      const auto correction = map->correction_mm(place);
      if (!correction)
        return Error{Errc::bad_value, fmt::format("{}: {}: {}; put the plate where the field was mapped",
                                                  options.measured.string(), name, map->why_not(place))};
      one.measured_mm += *correction;
    }
    out.push_back(std::move(one));
  }
  return out;
}

nlohmann::json json_of(const FieldCheck& check, const std::vector<CheckedPlace>& places,
                       const std::vector<FieldCheck>& history) {
  nlohmann::json json{{"when", check.when},
                      {"rms_mm", check.rms_mm},
                      {"worst_mm", check.worst_mm},
                      {"worst", check.worst_place},
                      {"scale_percent", check.scale_percent},
                      {"days", history.size()},
                      {"places", nlohmann::json::array()}};
  for (std::size_t i = 0; i < places.size(); ++i)
    json["places"].push_back({{"name", places[i].name}, {"off_mm", check.off_mm[i]}});
  if (const auto chart = calibration::control_chart(history)) {
    const auto limits = [](const calibration::ControlLimits& l) {
      return nlohmann::json{
          {"mean", l.mean}, {"sigma", l.sigma}, {"low", l.mean - 3 * l.sigma}, {"high", l.mean + 3 * l.sigma}};
    };
    json["limits"] = {{"rms_mm", limits(chart->rms_mm)}, {"scale_percent", limits(chart->scale_percent)}};
  }
  return json;
}

HtmlPage page_of(const FieldCheck& check, const std::vector<CheckedPlace>& places,
                 const std::vector<FieldCheck>& history) {
  HtmlPage page("The tracker's field, checked");
  page.paragraph(fmt::format("{}: {} places, {:.2f} mm RMS, the largest {:.2f} mm at {}; distances {:+.2f} %.",
                             check.when, places.size(), check.rms_mm, check.worst_mm, check.worst_place,
                             check.scale_percent));
  page.heading("Day by day");
  page.svg(field_chart_svg(history),
           "Red: more than 3 sigma from the mean of the first eight days, those to the left of the dashed line.");
  page.heading("Today's places");
  std::vector<std::vector<std::string>> rows{{"place", "off"}};
  for (std::size_t i = 0; i < places.size(); ++i)
    rows.push_back({places[i].name, fmt::format("{:.2f} mm", check.off_mm[i])});
  page.table(rows);
  return page;
}

void run(const CalibrateFieldCheckOptions& options, CommandStatus& status) {
  auto history = read_history(options.history);
  if (!history) return status.refuse(history.error());
  const auto field = field_of(options);
  if (!field) return status.refuse(field.error());
  const auto places = places_of(options, field->map);
  if (!places) return status.refuse(places.error());
  const std::string when = options.when.empty() ? local_time_now() : options.when;
  const auto known = std::ranges::find_if(*history, [&](const FieldCheck& day) { return day.when == day_name(when); });
  if (!options.when.empty() && known != history->end()) {
    return status.refuse({Errc::bad_value, fmt::format("{}: has a day {} already: give another --when, or take that "
                                                       "line out",
                                                       options.history.string(), known->when)});
  }
  // Places that are touched again are no other day.
  const auto is_today = [&when](const FieldCheck& day) { return day.when.starts_with(when.substr(0, kDateLength)); };
  if (options.when.empty() && std::erase_if(*history, is_today) > 0)
    print_line(fmt::format("in {} this check replaces today's former", options.history.string()));
  const auto check = calibration::check_field(when, *places);
  if (!check) return status.refuse(check.error().with_context(options.measured.string()));
  history->push_back(*check);
  Verdict verdict = calibration::verdict_of(*history);
  tell_doubts({}, *field, verdict);
  // A bad day belongs into the history like any other.
  finish_calibration(options.results, "", json_of(*check, *places, *history), page_of(*check, *places, *history),
                     verdict, status, {}, {options.history, history_text(*history)});
}

}  // namespace

CLI::App* add_calibrate_field_check(CLI::App& field, CommandStatus& status) {
  auto options = std::make_shared<CalibrateFieldCheckOptions>();
  CLI::App* check = field.add_subcommand("check", "a plate's places, touched each day, against those of other days");
  check->add_option("--plate", options->plate, "the places as they are: name,x,y,z, mm (CSV)")
      ->required()
      ->type_name("FILE");
  check->add_option("--measured", options->measured, "the pointer's tip in them today, in the tracker's frame")
      ->required()
      ->type_name("FILE");
  check->add_option("--history", options->history, "one line a day; today's is added (CSV)")
      ->required()
      ->type_name("FILE");
  check->add_option("--field", options->field, "the map that the appliance uses, where --measured was taken without it")
      ->type_name("FILE");
  check->add_option("--when", options->when, "the day, as 2026-11-29; now, if left out")->check(is_day);
  check->add_option("--json", options->results.json, "figures, verdict and reasons")->type_name("FILE");
  check->add_option("--report", options->results.report, "a page with the chart (HTML)")->type_name("FILE");
  check->callback([options, &status] { run(*options, status); });
  return check;
}

}  // namespace birdseye::host
