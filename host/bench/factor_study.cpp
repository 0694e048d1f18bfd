#include "host/bench/factor_study.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <utility>

#include "drivers/system/progress.hpp"
#include "host/bench/factor_summary.hpp"
#include "host/bench/factor_trial.hpp"
#include "host/files/write_files.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// The file of trials, one a line.
class TrialFile {
 public:
  /// Keeps what stands there already; a last line that was cut off is dropped.
  static Result<TrialFile> open(const fs::path& path) {
    TrialFile out(path);
    std::ifstream in(path);
    std::string line, whole;
    for (int number = 1; std::getline(in, line) && !in.eof(); ++number) {
      json trial = json::parse(line, nullptr, false);
      if (trial.is_discarded() || !trial.contains("class") || !trial.contains("seed")) {
        return Error{Errc::bad_format, fmt::format("{}: line {} is no trial; take the line out, or give another folder",
                                                   path.string(), number)};
      }
      out.trials_.push_back(std::move(trial));
      whole += line + '\n';
    }
    if (auto written = write_file(path, whole); !written) return written.error();
    return out;
  }
  [[nodiscard]] Result<void> add(json trial) {
    std::ofstream file(path_, std::ios::app);
    file << trial.dump() + '\n' << std::flush;
    if (!file) return Error{Errc::io, fmt::format("{}: cannot be written; is the disk full?", path_.string())};
    trials_.push_back(std::move(trial));
    return {};
  }
  [[nodiscard]] const std::vector<json>& trials() const { return trials_; }

 private:
  explicit TrialFile(fs::path path) : path_(std::move(path)) {}

  fs::path path_;
  std::vector<json> trials_;
};

/// A case to make, and what to register it by.
struct Work {
  const FactorClass* of = nullptr;
  int seed = 0;
  std::vector<std::string> optimisers;
};

class FactorStudy {
 public:
  FactorStudy(const FactorOptions& options, std::vector<const FactorClass*> classes, TrialFile file)
      : options_(options), classes_(std::move(classes)), file_(std::move(file)) {}

  Result<void> run() {
    for (std::vector<Work> todo = round(); !todo.empty(); todo = round()) {
      if (auto done = make(todo); !done) return done;
    }
    return write_tables();
  }

 private:
  [[nodiscard]] bool stands(const FactorClass& of, int seed, const char* key, const std::string& value) const {
    return std::any_of(file_.trials().begin(), file_.trials().end(), [&](const json& trial) {
      return trial["class"] == of.name && trial["size"] == options_.size && trial["seed"] == seed &&
             trial.contains(key) && (value.empty() || trial[key] == value);
    });
  }
  /// The seeds of a class's trials: the first that the simulator does not refuse.
  [[nodiscard]] std::vector<int> seeds_of(const FactorClass& of) const {
    std::vector<int> seeds;
    const int last = options_.first_seed + 2 * options_.trials + 10;
    for (int seed = options_.first_seed; seed < last && std::ssize(seeds) < options_.trials; ++seed) {
      if (!stands(of, seed, "refused", {})) seeds.push_back(seed);
    }
    return seeds;
  }
  /// What is still to do, seed by seed, so that a study that is cut has as many trials of each class.
  [[nodiscard]] std::vector<Work> round() const {
    std::vector<Work> todo;
    for (const FactorClass* of : classes_) {
      for (const int seed : seeds_of(*of)) {
        Work work{of, seed, {}};
        for (const std::string& optimiser : options_.optimisers) {
          if (!stands(*of, seed, "optimiser", optimiser)) work.optimisers.push_back(optimiser);
        }
        if (!work.optimisers.empty()) todo.push_back(std::move(work));
      }
    }
    std::stable_sort(todo.begin(), todo.end(), [](const Work& a, const Work& b) { return a.seed < b.seed; });
    return todo;
  }

  Result<void> make(const std::vector<Work>& todo) {
    const int jobs = options_.jobs > 0 ? options_.jobs : tbb::info::default_concurrency();
    // Else OpenCV would share a case's work with cores that have cases of their own.
    const int threads_before = cv::getNumThreads();
    if (jobs > 1) cv::setNumThreads(1);
    std::optional<Error> failed;
    const auto has_failed = [&] {
      const std::lock_guard lock(mutex_);
      return failed.has_value();
    };
    const auto one = [&](std::size_t i) {
      if (has_failed()) return;
      // By itself, or a thread that waits for its case's work would begin another case in between.
      tbb::task_arena by_itself(1);
      auto done = jobs > 1 ? by_itself.execute([&] { return work_on(todo[i], true); }) : work_on(todo[i], false);
      const std::lock_guard lock(mutex_);
      if (!done && !failed) failed = done.error();
    };
    std::atomic<std::size_t> next = 0;  // in their order, so that those of low seeds come first
    tbb::task_arena arena(jobs);
    arena.execute([&] {
      tbb::parallel_for(
          0, jobs,
          [&](int) {
            for (std::size_t i = next++; i < todo.size(); i = next++) one(i);
          },
          tbb::simple_partitioner());
    });
    cv::setNumThreads(threads_before);
    if (failed) return *failed;
    return {};
  }

  Result<void> work_on(const Work& work, bool one_thread) {
    json named{{"class", work.of->name}, {"size", options_.size}, {"seed", work.seed}};
    const auto made = make_factor_case(*work.of, options_.size, work.seed);
    if (!made && made.error().code == Errc::bad_value) {
      named["refused"] = made.error().what;
      return keep(std::move(named));
    }
    if (!made) return made.error();
    for (const std::string& optimiser : work.optimisers) {
      json trial = named;
      trial.update(factor_trial(*made, optimiser, one_thread));
      if (auto kept = keep(std::move(trial)); !kept) return kept;
    }
    return {};
  }

  Result<void> keep(json trial) {
    const std::lock_guard lock(mutex_);
    progress_.keep(line_of(trial));
    return file_.add(std::move(trial));
  }

  [[nodiscard]] Result<void> write_tables() const {
    json rows = json::array();
    std::vector<json> all;
    for (const std::string& optimiser : options_.optimisers) {
      for (const FactorClass* of : classes_) {
        const std::vector<int> seeds = seeds_of(*of);
        std::vector<json> trials;
        for (const json& trial : file_.trials()) {
          if (trial["class"] == of->name && trial["size"] == options_.size && trial.contains("optimiser") &&
              trial["optimiser"] == optimiser && std::find(seeds.begin(), seeds.end(), trial["seed"]) != seeds.end())
            trials.push_back(trial);
        }
        rows.push_back(factor_row(of->name, optimiser, trials));
        all.insert(all.end(), trials.begin(), trials.end());
      }
    }
    return write_files({{options_.folder / "table.json", text_of(rows)},
                        {options_.folder / "table.md", factor_markdown(rows)},
                        {options_.folder / "calibration.svg", calibration_svg(all)}});
  }

  const FactorOptions& options_;
  std::vector<const FactorClass*> classes_;
  TrialFile file_;
  std::mutex mutex_;
  Progress progress_;
};

}  // namespace

Result<void> factor_study(const FactorOptions& options) {
  std::vector<const FactorClass*> classes;
  std::vector<std::string> names;
  for (const FactorClass& of : factor_classes()) {
    names.push_back(of.name);
    if (options.only.empty() || std::find(options.only.begin(), options.only.end(), of.name) != options.only.end())
      classes.push_back(&of);
  }
  for (const std::string& name : options.only) {
    if (std::find(names.begin(), names.end(), name) == names.end())
      return Error{Errc::bad_value,
                   fmt::format("--only {}: there is no such class; there are: {}", name, fmt::join(names, ", "))};
  }
  auto file = TrialFile::open(options.folder / "trials.jsonl");
  if (!file) return file.error();
  return FactorStudy(options, std::move(classes), *std::move(file)).run();
}

}  // namespace birdseye::host
