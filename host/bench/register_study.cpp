#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "drivers/system/progress.hpp"
#include "host/bench/bench_machine.hpp"
#include "host/bench/bench_trials.hpp"
#include "host/bench/register_study.hpp"
#include "host/files/result_folder.hpp"
#include "host/files/write_files.hpp"
#include "host/registration/views/patch_field.hpp"
#include "host/registration/views/rendered_views.hpp"
#include "host/report/line_plot.hpp"

namespace birdseye::host {

namespace {

using nlohmann::json;

constexpr double kLamps_mm[] = {0, 30, 90};
/// Of the curves: the lamp's place, and whether nothing lies behind the organ, as in a rendering.
constexpr std::pair<double, bool> kScenes[] = {{0, false}, {30, false}, {90, false}, {0, true}};

/// What the methods are tried under; all else is as in the main table.
struct StudyCondition {
  SimulatedCase wanted;
  std::vector<Method> methods;
  std::vector<int> views_kept{5};  ///< of each case, the first so many
};

std::vector<StudyCondition> conditions(const StudyOptions& options) {
  const auto wants = [&](const char* sweep) {
    return std::find(options.sweeps.begin(), options.sweeps.end(), sweep) != options.sweeps.end();
  };
  const std::vector<Method> both{{"simplex"}, {"gradient"}};
  std::vector<Method> every;
  for (const std::string& measure : similarity_names()) every.push_back({"simplex", measure});
  every.push_back({"gradient"});
  // All sweeps pass through this one.
  std::vector<StudyCondition> out{{options.usual, wants("light") ? every : both}};
  if (wants("views")) out.front().views_kept = {5, 3, 2, 1};
  const auto add = [&](const std::vector<Method>& methods, const auto& change) {
    StudyCondition condition{options.usual, methods};
    change(condition.wanted);
    out.push_back(std::move(condition));
  };
  for (const double mm : kLamps_mm) {
    if (wants("light") && mm != 0) add(every, [&](SimulatedCase& c) { c.light_offset_mm = mm; });
  }
  for (const double noise : {4.0, 16.0}) {
    if (wants("noise")) add(both, [&](SimulatedCase& c) { c.noise = noise; });
  }
  for (const double mm : {2.0, 5.0, 20.0}) {
    if (wants("error")) add(both, [&](SimulatedCase& c) { c.amplitude_mm = mm; });
  }
  for (const double mm : {2.0, 5.0, 10.0, 20.0}) {
    if (!wants("error")) continue;
    add({{"gradient"}}, [&](SimulatedCase& c) {
      c.inner = 3;
      c.amplitude_mm = mm;
    });
  }
  return out;
}

/// Similarity along a line through the truth: the only control point is pushed on and held back along its own way.
Result<json> cost_curves(SimulatedCase wanted) {
  json rows = json::array();
  for (const auto& [lamp_mm, plain] : kScenes) {
    wanted.light_offset_mm = lamp_mm;
    wanted.plain_background = plain;
    const auto c = simulate(wanted);
    if (!c) return c.error();
    const auto transfer = load_transfer_function(c->transfer);
    if (!transfer) return transfer.error();
    constexpr double kSpacing_mm = 2;
    const auto tissue = tissue_of(c->ct, c->labels ? &*c->labels : nullptr, c->label_values, *transfer, kSpacing_mm);
    if (!tissue) return tissue.error();
    const ControlGrid control({1, 1, 1});
    // The point itself, from how it moves the box's middle: by an eighth.
    const Eigen::Vector3d middle_mm =
        c->truth->patch.displacement(Eigen::Vector3d::Constant(0.5)).cwiseProduct(c->truth->box_mm);
    for (const std::string& measure : similarity_names()) {
      auto views = RenderedViews::make(c->views, *tissue, measure);
      if (!views) return views.error();
      std::vector<double> along_mm, values;
      constexpr int kSteps = 15;
      constexpr double kStep_mm = 0.8;
      for (int step = -kSteps; step <= kSteps; ++step) {
        const double at_mm = step * kStep_mm;
        const Eigen::Vector3d point_mm = 8 * (middle_mm + at_mm * middle_mm.normalized());
        constexpr int kLevel = 4;
        along_mm.push_back(at_mm);
        values.push_back(
            views->similarity(driven_field(control, {point_mm.x(), point_mm.y(), point_mm.z()}, *tissue, kLevel)));
      }
      const auto top = static_cast<std::size_t>(std::max_element(values.begin(), values.end()) - values.begin());
      int peaks = 0;
      for (std::size_t i = 1; i + 1 < values.size(); ++i)
        peaks += values[i] > values[i - 1] && values[i] >= values[i + 1] ? 1 : 0;
      rows.push_back({{"similarity", measure},
                      {"light_offset_mm", lamp_mm},
                      {"plain_background", plain},
                      {"peak_mm", along_mm[top]},
                      {"local_maxima", peaks},
                      {"moved_mm", middle_mm.norm()},
                      {"along_mm", along_mm},
                      {"values", values}});
      fmt::print("cost curve, lamp {:2.0f} mm beside the lens{}, {:8}: highest {:+.1f} mm from the truth, {} maxima\n",
                 lamp_mm, plain ? ", nothing behind" : "", measure, along_mm[top], peaks);
      std::fflush(stdout);
    }
  }
  return rows;
}

/// Each curve between its own least and greatest value, for measures have other units.
std::string cost_plot(const json& rows) {
  std::vector<Panel> panels;
  for (const auto& [lamp_mm, plain] : kScenes) {
    Panel panel{plain          ? "Lamp at the lens, nothing behind"
                : lamp_mm == 0 ? "Lamp at the lens, as drawn"
                               : fmt::format("Lamp {} mm beside the lens", lamp_mm),
                "mm past the truth",
                "similarity, least to most",
                {}};
    for (const json& row : rows) {
      if (row["light_offset_mm"] != lamp_mm || row["plain_background"] != plain) continue;
      const auto values = row["values"].get<std::vector<double>>();
      const auto [least, most] = std::minmax_element(values.begin(), values.end());
      Curve curve{row["similarity"], {}};
      for (std::size_t i = 0; i < values.size(); ++i)
        curve.points.emplace_back(row["along_mm"][i].get<double>(), (values[i] - *least) / (*most - *least));
      panel.curves.push_back(std::move(curve));
    }
    panels.push_back(std::move(panel));
  }
  return plot_svg(panels, 2);
}

std::string name_of(const json& row) {
  const auto optimiser = row["optimiser"].get<std::string>();
  if (optimiser == "gradient") return row["dof"] == 3 ? "ours, 3 DOF" : "ours, 81 DOF";
  return optimiser + " " + row["similarity"].get<std::string>();
}

/// Rows that differ from the usual in `key` alone.
Panel sweep_panel(const json& rows, const std::string& title, const char* key, const std::string& x_label,
                  bool every_measure, bool every_dof) {
  const json usual{{"light_offset_mm", 0.0}, {"noise", 1.0}, {"views", 5}, {"amplitude_mm", 10.0}};
  Panel panel{title, x_label, "error left, mm", {}};
  for (const json& row : rows) {
    const bool belongs = std::all_of(usual.items().begin(), usual.items().end(), [&](const auto& item) {
      return item.key() == key || row[item.key()] == item.value();
    });
    if (!belongs || (!every_measure && row["similarity"] != "mi") || (!every_dof && row["dof"] != 3)) continue;
    const std::string name = name_of(row);
    auto curve = std::find_if(panel.curves.begin(), panel.curves.end(), [&](const Curve& c) { return c.name == name; });
    if (curve == panel.curves.end()) curve = panel.curves.insert(curve, {name, {}});
    curve->points.emplace_back(row[key].get<double>(), row["tre_after_mm_mean"].get<double>());
  }
  for (Curve& curve : panel.curves) std::sort(curve.points.begin(), curve.points.end());
  return panel;
}

std::string sweep_plot(const json& rows, const StudyOptions& options) {
  std::vector<Panel> panels;
  for (const std::string& sweep : options.sweeps) {
    if (sweep == "light") {
      panels.push_back(
          sweep_panel(rows, "Measure and light", "light_offset_mm", "lamp beside the lens, mm", true, false));
    }
    if (sweep == "noise") panels.push_back(sweep_panel(rows, "Noise", "noise", "times the usual", false, false));
    if (sweep == "views") panels.push_back(sweep_panel(rows, "Views", "views", "views", false, false));
    if (sweep == "error") {
      panels.push_back(
          sweep_panel(rows, "Initial error", "amplitude_mm", "greatest motion of the surface, mm", false, true));
    }
  }
  constexpr int kMostColumns = 2;
  return plot_svg(panels, std::min(kMostColumns, static_cast<int>(panels.size())));
}

/// The rows of one condition: for each number of views, each method.
Result<json> rows_of(const StudyCondition& condition, int trials, Progress& progress) {
  const SimulatedCase& w = condition.wanted;
  const std::size_t methods = condition.methods.size();
  std::vector<std::vector<Trial>> of(condition.views_kept.size() * methods);
  auto done = for_cases(w, trials, [&](const RegistrationCase& whole, int seed) -> Result<void> {
    RegistrationCase c = whole;
    for (std::size_t v = 0; v < condition.views_kept.size(); ++v) {
      c.views = whole.views;
      c.views.resize(std::min(c.views.size(), static_cast<std::size_t>(condition.views_kept[v])));
      for (std::size_t m = 0; m < methods; ++m) {
        progress(fmt::format("{} views, noise {}, lamp {} mm, {} mm: seed {}", c.views.size(), w.noise,
                             w.light_offset_mm, w.amplitude_mm, seed));
        auto trial = try_once(c, condition.methods[m]);
        if (!trial) return trial.error();
        of[v * methods + m].push_back(*trial);
      }
    }
    return {};
  });
  if (!done) return done.error();
  json rows = json::array();
  for (std::size_t n = 0; n < of.size(); ++n) {
    const Method& method = condition.methods[n % methods];
    json row = summary_of(of[n]);
    row.update({{"optimiser", method.optimiser},
                {"similarity", method.similarity},
                {"dof", 3 * w.inner * w.inner * w.inner},
                {"views", condition.views_kept[n / methods]},
                {"noise", w.noise},
                {"light_offset_mm", w.light_offset_mm},
                {"amplitude_mm", w.amplitude_mm}});
    fmt::print("{} views, noise {:2.0f}, lamp {:2.0f} mm, moved {:2.0f} mm, {:18}: {:.2f} to {:.2f} mm, {:3.0f} %\n",
               condition.views_kept[n / methods], w.noise, w.light_offset_mm, w.amplitude_mm, name_of(row),
               row["tre_before_mm_mean"].get<double>(), row["tre_after_mm_mean"].get<double>(),
               100 * row["success_rate"].get<double>());
    std::fflush(stdout);
    rows.push_back(std::move(row));
  }
  return rows;
}

ResultFolder folder_of(const StudyOptions& options) {
  return {.path = options.folder,
          .command = "bench register --study",
          .sheet = "study.json",
          .names = R"((cost-curves|sweeps)\.svg)",
          .key = "sweeps",
          .option = "--study"};
}

}  // namespace

Result<void> register_study(const StudyOptions& options) {
  const ResultFolder folder = folder_of(options);
  if (auto made = make_empty(folder, {}); !made) return made.error();
  json all = {{"trials", options.trials},       {"sweeps", options.sweeps}, {"phantom", options.usual.phantom},
              {"viewport", options.usual.size}, {"rows", json::array()},    {"machine", bench_machine()}};
  std::vector<FileText> files;
  if (std::find(options.sweeps.begin(), options.sweeps.end(), "light") != options.sweeps.end()) {
    auto curves = cost_curves(options.usual);
    if (!curves) return curves.error();
    files.push_back({options.folder / "cost-curves.svg", cost_plot(*curves)});
    all["cost_curves"] = *std::move(curves);
    if (auto written = write_files(files); !written) return written.error();
  }
  Progress progress;
  for (const StudyCondition& condition : conditions(options)) {
    const auto rows = rows_of(condition, options.trials, progress);
    if (!rows) return rows.error();
    for (const json& row : *rows) all["rows"].push_back(row);
    // It takes a while: what there is, is kept.
    std::vector<FileText> now = files;
    now.push_back({options.folder / "sweeps.svg", sweep_plot(all["rows"], options)});
    all["files"] = json::array();
    for (const FileText& file : now) all["files"].push_back(file.path.filename().string());
    now.push_back({options.folder / folder.sheet, text_of(all)});
    if (auto written = write_files(now); !written) return written.error();
  }
  return {};
}

}  // namespace birdseye::host
