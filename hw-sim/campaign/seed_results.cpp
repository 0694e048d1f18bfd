#include "hw-sim/campaign/seed_results.hpp"

#include <fmt/format.h>
#include <sqlite3.h>

#include <utility>

namespace birdseye::hw_sim {

namespace {

constexpr const char* kMoveAway = "move this file away, and its seeds are run again";

const char* remedy_of(int sqlite_code) {
  constexpr int kPrimary = 0xFF;
  switch (sqlite_code & kPrimary) {
    case SQLITE_NOTADB:
    case SQLITE_CORRUPT:
    case SQLITE_ERROR:  // it has other tables than a campaign's
      return kMoveAway;
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return "another program writes to it; start the campaign again once that program has ended";
    case SQLITE_FULL:
      return "make room on its disk";
    case SQLITE_PERM:
    case SQLITE_READONLY:
    case SQLITE_CANTOPEN:
    case SQLITE_AUTH:
      return "check the permissions of the file and of its folder";
    default:
      return "check its disk";
  }
}

}  // namespace

struct SeedResults::Database {
  std::string name;
  sqlite3* handle = nullptr;
  ~Database() { sqlite3_close(handle); }

  [[nodiscard]] Error fault() const {
    return {Errc::io, fmt::format("{}: {}; {}", name, sqlite3_errmsg(handle), remedy_of(sqlite3_errcode(handle)))};
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
  /// For other values.
  void again() {
    sqlite3_reset(statement_);
    bound_ = 0;
  }
  [[nodiscard]] std::uint64_t number(int column) const {
    return static_cast<std::uint64_t>(sqlite3_column_int64(statement_, column));
  }
  [[nodiscard]] std::string text(int column) const {
    const unsigned char* const text = sqlite3_column_text(statement_, column);
    return text == nullptr ? "" : reinterpret_cast<const char*>(text);
  }

 private:
  sqlite3_stmt* statement_ = nullptr;
  int bound_ = 0;
};

}  // namespace

SeedResults::SeedResults(std::unique_ptr<Database> database) : database_(std::move(database)) {}

SeedResults::~SeedResults() = default;

Result<std::unique_ptr<SeedResults>> SeedResults::open(const std::filesystem::path& file, const std::string& what) {
  auto database = std::make_unique<Database>();
  database->name = file.string();
  if (sqlite3_open(file.c_str(), &database->handle) != SQLITE_OK) return database->fault();
  constexpr int kPatience_ms = 10'000;
  sqlite3_busy_timeout(database->handle, kPatience_ms);
  {
    Statement check(database->handle, "PRAGMA quick_check(1)");
    if (check.step() != SQLITE_ROW) return database->fault();
    constexpr const char* kSound = "ok";
    if (const std::string found = check.text(0); found != kSound)
      return Error{Errc::bad_format, fmt::format("{}: is damaged ({}); {}", database->name, found, kMoveAway)};
  }
  if (auto made = database->run("CREATE TABLE IF NOT EXISTS campaign (one INTEGER PRIMARY KEY, what TEXT);"
                                "CREATE TABLE IF NOT EXISTS results (seed INTEGER PRIMARY KEY, result TEXT)");
      !made)
    return made.error();
  // Of several programs that begin at once, the first one's counts.
  Statement enter(database->handle, "INSERT OR IGNORE INTO campaign VALUES (1, ?)");
  enter.bind(what);
  if (enter.step() != SQLITE_DONE) return database->fault();
  Statement known(database->handle, "SELECT what FROM campaign");
  if (known.step() != SQLITE_ROW) return database->fault();
  if (known.text(0) != what) {
    return Error{Errc::bad_value,
                 fmt::format("{}: is of {}, not of {}; give another --out", database->name, known.text(0), what)};
  }
  return std::unique_ptr<SeedResults>(new SeedResults(std::move(database)));
}

Result<void> SeedResults::enter(const std::vector<SeedLine>& lines) {
  if (auto begun = database_->run("BEGIN IMMEDIATE"); !begun) return begun;
  Statement enter(database_->handle, "INSERT OR REPLACE INTO results VALUES (?, ?)");
  for (const SeedLine& one : lines) {
    enter.bind(one.seed);
    enter.bind(one.line);
    if (enter.step() != SQLITE_DONE) {
      const Error fault = database_->fault();
      enter.again();
      (void)database_->run("ROLLBACK");
      return fault;
    }
    enter.again();
  }
  auto ended = database_->run("COMMIT");
  if (!ended) (void)database_->run("ROLLBACK");
  return ended;
}

Result<std::set<std::uint64_t>> SeedResults::seeds() const {
  std::set<std::uint64_t> out;
  Statement all(database_->handle, "SELECT seed FROM results");
  int step = all.step();
  for (; step == SQLITE_ROW; step = all.step()) out.insert(all.number(0));
  if (step != SQLITE_DONE) return database_->fault();
  return out;
}

Result<void> SeedResults::for_each(std::uint64_t first, std::uint64_t last,
                                   const std::function<Result<void>(const SeedLine&)>& each) const {
  Statement some(database_->handle, "SELECT seed, result FROM results WHERE seed BETWEEN ? AND ? ORDER BY seed");
  some.bind(first);
  some.bind(last);
  int step = some.step();
  for (; step == SQLITE_ROW; step = some.step()) {
    if (auto done = each({some.number(0), some.text(1)}); !done) return done.with_context(database_->name);
  }
  if (step != SQLITE_DONE) return database_->fault();
  return {};
}

}  // namespace birdseye::hw_sim
