#include "hw-sim/campaign/operation_results.hpp"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <utility>

namespace birdseye::hw_sim {

namespace {

using Count = std::uint64_t OperationResult::*;
using Worst = double OperationResult::*;

constexpr std::array<std::pair<const char*, Count>, 11> kCounts{{{"laws_broken", &OperationResult::laws_broken},
                                                                 {"faults", &OperationResult::faults},
                                                                 {"faults_alone", &OperationResult::faults_alone},
                                                                 {"poses", &OperationResult::poses},
                                                                 {"frames", &OperationResult::frames},
                                                                 {"shown", &OperationResult::shown},
                                                                 {"overlaid", &OperationResult::overlaid},
                                                                 {"green", &OperationResult::green},
                                                                 {"beyond", &OperationResult::beyond},
                                                                 {"registrations", &OperationResult::registrations},
                                                                 {"checks", &OperationResult::checks}}};
constexpr std::array<std::pair<const char*, Worst>, 5> kWorst{{{"worst_pose", &OperationResult::worst_pose},
                                                               {"worst_age_ms", &OperationResult::worst_age_ms},
                                                               {"worst_circles", &OperationResult::worst_circles},
                                                               {"slowest_named_s", &OperationResult::slowest_named_s},
                                                               {"slowest_over_s", &OperationResult::slowest_over_s}}};

}  // namespace

std::string line_of(const OperationResult& result) {
  nlohmann::ordered_json json{{"seed", result.seed}, {"minutes", result.minutes}, {"hash", result.hash}};
  for (const auto& [name, count] : kCounts) json[name] = result.*count;
  for (const auto& [name, worst] : kWorst) json[name] = result.*worst;
  json["broken"] = result.broken;
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

Result<OperationResult> result_of(const std::string& line) {
  try {
    const nlohmann::json json = nlohmann::json::parse(line);
    OperationResult out;
    json.at("seed").get_to(out.seed);
    json.at("minutes").get_to(out.minutes);
    json.at("hash").get_to(out.hash);
    json.at("broken").get_to(out.broken);
    for (const auto& [name, count] : kCounts) json.at(name).get_to(out.*count);
    for (const auto& [name, worst] : kWorst) json.at(name).get_to(out.*worst);
    return out;
  } catch (const nlohmann::json::exception& wrong) {
    return Error{Errc::bad_format, fmt::format("is no result of an operation ({}): {}", wrong.what(), line)};
  }
}

struct OperationResults::Database {
  std::string name;
  sqlite3* handle = nullptr;
  ~Database() { sqlite3_close(handle); }

  [[nodiscard]] Error fault() const {
    return {Errc::io, fmt::format("{}: {}; check the folder's permissions and the space on its disk", name,
                                  sqlite3_errmsg(handle))};
  }
  [[nodiscard]] Result<void> run(const char* text) const {
    if (sqlite3_exec(handle, text, nullptr, nullptr, nullptr) == SQLITE_OK) return {};
    return fault();
  }
};

namespace {

/// A statement of SQL that ends with this object.
class Statement {
 public:
  Statement(sqlite3* database, const std::string& text) {
    sqlite3_prepare_v2(database, text.c_str(), -1, &statement_, nullptr);
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  void bind(std::uint64_t value) { sqlite3_bind_int64(statement_, ++bound_, static_cast<sqlite3_int64>(value)); }
  void bind(const std::string& value) {
    sqlite3_bind_text(statement_, ++bound_, value.c_str(), static_cast<int>(value.size()), SQLITE_TRANSIENT);
  }
  /// SQLITE_ROW, SQLITE_DONE, or what is wrong.
  int step() { return sqlite3_step(statement_); }
  [[nodiscard]] std::uint64_t number() const { return static_cast<std::uint64_t>(sqlite3_column_int64(statement_, 0)); }
  [[nodiscard]] std::string text() const {
    const unsigned char* const text = sqlite3_column_text(statement_, 0);
    return text == nullptr ? "" : reinterpret_cast<const char*>(text);
  }

 private:
  sqlite3_stmt* statement_ = nullptr;
  int bound_ = 0;
};

}  // namespace

OperationResults::OperationResults(std::unique_ptr<Database> database) : database_(std::move(database)) {}

OperationResults::~OperationResults() = default;

Result<std::unique_ptr<OperationResults>> OperationResults::open(const std::filesystem::path& file, double minutes) {
  auto database = std::make_unique<Database>();
  database->name = file.string();
  if (sqlite3_open(file.c_str(), &database->handle) != SQLITE_OK) return database->fault();
  constexpr int kPatience_ms = 10'000;
  sqlite3_busy_timeout(database->handle, kPatience_ms);
  if (auto made = database->run("CREATE TABLE IF NOT EXISTS campaign (minutes TEXT);"
                                "CREATE TABLE IF NOT EXISTS operations (seed INTEGER PRIMARY KEY, laws_broken INTEGER, "
                                "hash TEXT, result TEXT)");
      !made)
    return made.error();
  const std::string length = fmt::format("{}", minutes);
  Statement known(database->handle, "SELECT minutes FROM campaign");
  if (known.step() == SQLITE_ROW) {
    if (known.text() != length) {
      return Error{Errc::bad_value,
                   fmt::format("{}: is of operations of {} minutes, not {}; give another --out, or --minutes {}",
                               database->name, known.text(), length, known.text())};
    }
  } else {
    Statement enter(database->handle, "INSERT INTO campaign VALUES (?)");
    enter.bind(length);
    if (enter.step() != SQLITE_DONE) return database->fault();
  }
  return std::unique_ptr<OperationResults>(new OperationResults(std::move(database)));
}

Result<void> OperationResults::enter(const OperationResult& result) {
  Statement enter(database_->handle, "INSERT OR REPLACE INTO operations VALUES (?, ?, ?, ?)");
  enter.bind(result.seed);
  enter.bind(result.laws_broken);
  enter.bind(result.hash);
  enter.bind(line_of(result));
  if (enter.step() != SQLITE_DONE) return database_->fault();
  return {};
}

Result<std::set<std::uint64_t>> OperationResults::seeds() const {
  std::set<std::uint64_t> out;
  Statement all(database_->handle, "SELECT seed FROM operations");
  int step = all.step();
  for (; step == SQLITE_ROW; step = all.step()) out.insert(all.number());
  if (step != SQLITE_DONE) return database_->fault();
  return out;
}

Result<OperationResult> OperationResults::sum(std::uint64_t first, std::uint64_t last) const {
  OperationResult out;
  Statement some(database_->handle, "SELECT result FROM operations WHERE seed BETWEEN ? AND ? ORDER BY seed");
  some.bind(first);
  some.bind(last);
  int step = some.step();
  for (; step == SQLITE_ROW; step = some.step()) {
    const auto one = result_of(some.text());
    if (!one) return one.error().with_context(database_->name);
    out.minutes += one->minutes;
    for (const auto& [name, count] : kCounts) out.*count += (*one).*count;
    for (const auto& [name, worst] : kWorst) out.*worst = std::max(out.*worst, (*one).*worst);
    if (!one->broken.empty()) out.broken += fmt::format("seed {}: {}\n", one->seed, one->broken);
  }
  if (step != SQLITE_DONE) return database_->fault();
  return out;
}

}  // namespace birdseye::hw_sim
