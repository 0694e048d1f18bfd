#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "host/app/commands.hpp"
#include "host/bench/similarity_study.hpp"
#include "host/files/write_files.hpp"

namespace birdseye::host {

namespace {

struct BenchSimilarityOptions {
  std::filesystem::path json;
  int rounds = 15;
};

Result<ExitCode> bench_similarity(const BenchSimilarityOptions& options) {
  const auto table = similarity_study(options.rounds);
  if (!table) return table.error();
  double ratio = 0;
  for (const nlohmann::json& row : (*table)["rows"]) {
    fmt::print("{:22}  {:8.4f} ms  value {:.4f}\n", row["measure"].get<std::string>(),
               row["value_ms_median"].get<double>(), row["value"].get<double>());
    ratio = row.value("opencv_ratio", ratio);
  }
  fmt::print("mi is {:.1f} times as fast as OpenCV's histogram\n", ratio);
  if (auto written = write_files({{options.json, text_of(*table)}}); !written) return written.error();
  return (*table)["verdict"] == "pass" ? ExitCode::success : ExitCode::verdict_fail;
}

}  // namespace

void add_bench_similarity(CLI::App& bench, CommandStatus& status) {
  const auto options = std::make_shared<BenchSimilarityOptions>();
  CLI::App& similarity = *bench.add_subcommand("similarity", "measures of how alike two pictures are, and OpenCV's");
  similarity.add_option("--json", options->json, "write the table to this file");
  similarity.add_option("--rounds", options->rounds, "rounds of 41 calls, of which the fastest counts (default 15)")
      ->check(CLI::Range(1, 1000));
  similarity.callback([options, &status] {
    const auto done = bench_similarity(*options);
    done ? void(status.code = *done) : status.refuse(done.error());
  });
}

}  // namespace birdseye::host
