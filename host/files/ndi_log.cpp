#include "host/files/ndi_log.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "calibration/base/lower_case.hpp"
#include "calibration/base/units.hpp"
#include "host/files/pose_collector.hpp"
#include "host/files/text_rows.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;
using Fields = std::vector<std::string>;

constexpr std::size_t kLinesToHeader = 10;
constexpr std::size_t kFieldsOfMarker = 4;  ///< State,Tx,Ty,Tz
constexpr std::array<std::string_view, 7> kToolNumbers{"q0", "qx", "qy", "qz", "tx", "ty", "tz"};

/// Lower case, without units behind them: "Tx (mm)" is tx.
Fields plain_names(const Fields& fields) {
  Fields out;
  for (const std::string& field : fields) {
    const std::string name = lower_case(field);
    out.emplace_back(trimmed(std::string_view(name).substr(0, name.find_first_of("[("))));
  }
  return out;
}

bool is_state(const std::string& name) {
  return name.find("state") != std::string::npos || name.find("status") != std::string::npos;
}

bool is_ndi_header(const Fields& fields) {
  const Fields names = plain_names(fields);
  return std::find(names.begin(), names.end(), "q0") != names.end() &&
         std::any_of(names.begin(), names.end(), is_state);
}

/// Where a tool's columns are, counted from its first one.
struct ToolColumns {
  std::size_t first = 0;           ///< in the header
  std::vector<std::size_t> names;  ///< its port, handle, name or serial number
  std::size_t state = 0;
  std::array<std::size_t, 7> numbers{};
  std::optional<std::size_t> error, markers, time_s, time_ns;
  std::size_t count = 0;  ///< up to its error or count of markers, both counted
  std::string title;      ///< of its first column of names: "Port 1"
};

/// The columns of the tool whose Q0 is at q0; those of the tool before end at `from`, of the next one begin after `to`.
std::optional<ToolColumns> tool_columns(const Fields& header, const Fields& names, std::size_t from, std::size_t q0,
                                        std::size_t to) {
  ToolColumns out;
  std::optional<std::size_t> state;
  // Backwards: markers of the tool before may lie in between.
  std::size_t first = q0;
  for (std::size_t i = q0; i-- > from;) {
    const std::string& name = names[i];
    if (is_state(name) && state) break;  // of a marker
    const bool of_marker = name == "tx" || name == "ty" || name == "tz";
    if (of_marker || name.ends_with("tools") || name.ends_with("toolcount")) break;
    first = i;
    if (is_state(name)) state = i;
    if (name == "timespec_s") out.time_s = i;
    if (name == "timespec_ns") out.time_ns = i;
    if (name.starts_with("port") || name.starts_with("tool") || name.starts_with("handle") || name.starts_with("name"))
      out.names.insert(out.names.begin(), i);
  }
  if (!state) return std::nullopt;
  out.first = first;
  out.state = *state - first;
  for (std::size_t n = 0; n < kToolNumbers.size(); ++n) {
    const auto found = std::find(names.begin() + static_cast<std::ptrdiff_t>(q0),
                                 names.begin() + static_cast<std::ptrdiff_t>(to), kToolNumbers.at(n));
    if (found == names.begin() + static_cast<std::ptrdiff_t>(to)) return std::nullopt;
    out.numbers.at(n) = static_cast<std::size_t>(found - names.begin()) - first;
  }
  out.count = *std::max_element(out.numbers.begin(), out.numbers.end()) + 1;
  const auto next_is = [&](const char* word) {
    const std::size_t at = first + out.count;
    return at < to && names[at].find(word) != std::string::npos;
  };
  if (next_is("error")) out.error = out.count++;
  if (next_is("marker")) out.markers = out.count++;
  if (!out.names.empty()) out.title = header[out.names.front()];
  for (auto* at : {&out.time_s, &out.time_ns}) {
    if (*at) **at -= first;
  }
  for (std::size_t& at : out.names) at -= first;
  return out;
}

Result<std::vector<ToolColumns>> tools_of(const Fields& header) {
  const Fields names = plain_names(header);
  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == kToolNumbers[0]) starts.push_back(i);
  }
  std::vector<ToolColumns> out;
  for (std::size_t k = 0; k < starts.size(); ++k) {
    const std::size_t from = out.empty() ? 0 : out.back().first + out.back().count;
    const std::size_t to = k + 1 < starts.size() ? starts[k + 1] : names.size();
    const auto tool = tool_columns(header, names, from, starts[k], to);
    if (!tool) {
      return Error{Errc::bad_format,
                   fmt::format("the columns of its tool {} are not State,Q0,Qx,Qy,Qz,Tx,Ty,Tz", k + 1)};
    }
    out.push_back(*tool);
  }
  return out;
}

/// What a row says of a tool.
struct ToolRecord {
  std::size_t line = 0;
  Fields names;  ///< as the row has them
  std::string state;
  std::array<std::string, 7> numbers;
  std::string error, time_s, time_ns;
};

std::string field_at(const Fields& row, std::size_t at) {
  return at < row.size() ? row[at] : std::string();
}

ToolRecord record_of(const TextRow& row, const ToolColumns& tool, std::size_t start) {
  ToolRecord out;
  out.line = row.line;
  const auto at = [&](const std::optional<std::size_t>& column) {
    return column ? field_at(row.fields, start + *column) : std::string();
  };
  for (const std::size_t name : tool.names) {
    if (std::string text = at(name); !text.empty()) out.names.push_back(std::move(text));
  }
  out.state = at(tool.state);
  for (std::size_t n = 0; n < out.numbers.size(); ++n) out.numbers.at(n) = at(tool.numbers.at(n));
  out.error = at(tool.error);
  out.time_s = at(tool.time_s);
  out.time_ns = at(tool.time_ns);
  return out;
}

/// Where each tool begins in a row. A row that is longer than the header has more markers than the header names, or
/// more tools: then each tool begins where the markers of the one before end.
std::vector<std::size_t> starts_in(const Fields& row, std::size_t header_size, const std::vector<ToolColumns>& tools) {
  std::vector<std::size_t> out;
  if (row.size() <= header_size) {
    for (const ToolColumns& tool : tools) out.push_back(tool.first);
    return out;
  }
  for (std::size_t start = tools[0].first; start + tools[0].count <= row.size();) {
    out.push_back(start);
    const ReadNumber markers = tools[0].markers ? read_number(row[start + *tools[0].markers]) : ReadNumber{};
    const bool sound = markers.problem.empty() && markers.value >= 0 && markers.value < 1000;
    start += tools[0].count + (sound ? kFieldsOfMarker * static_cast<std::size_t>(markers.value) : 0);
  }
  return out;
}

/// One tool and all that the log says of it.
struct LoggedTool {
  std::string title;            ///< for messages: "Port 1 (8700339)"
  std::set<std::string> names;  ///< by which it may be asked for, lower case
  std::vector<ToolRecord> records;
};

/// "port:1" is "port 1" too, and each name is known by what stands behind its colon.
void add_names(LoggedTool& tool, const std::string& text) {
  std::string name = lower_case(text);
  tool.names.insert(name);
  const auto colon = name.find(':');
  if (colon == std::string::npos) return;
  tool.names.insert(std::string(trimmed(std::string_view(name).substr(colon + 1))));
  std::replace(name.begin(), name.end(), ':', ' ');
  tool.names.insert(name);
}

class NdiLog {
 public:
  static Result<NdiLog> read(const fs::path& path) {
    auto rows = TextRows::open(path);
    if (!rows) return rows.error();
    NdiLog log;
    Fields header;
    while (auto row = rows->next()) {
      drop_empty_ends(row->fields, 1);
      if (is_ndi_header(row->fields)) {
        if (!header.empty()) continue;  // repeated
        header = row->fields;
        auto tools = tools_of(header);
        if (!tools) return tools.error().with_context(path.string());
        log.columns_ = *std::move(tools);
      } else if (!header.empty() && !row->remark) {
        log.take(*row, header.size());
      }
    }
    log.decimal_commas_ = rows->decimal_commas();
    log.name_tools();
    return log;
  }

  /// By its number from 1, its title or one of its names; where there is one only, it need not be named.
  [[nodiscard]] Result<const LoggedTool*> find(const std::string& wanted, const std::string& option_prefix) const {
    std::vector<std::string> titles;
    for (std::size_t k = 0; k < tools_.size(); ++k) {
      const LoggedTool& tool = tools_[k];
      titles.push_back(tool.title);
      if (wanted.empty() ? tools_.size() == 1 : tool.names.contains(lower_case(wanted))) return &tool;
    }
    for (std::size_t k = 0; k < tools_.size(); ++k) {
      if (wanted == fmt::format("{}", k + 1)) return &tools_[k];
    }
    if (wanted.empty()) {
      return Error{Errc::bad_value, fmt::format("say by name which tool is the sensor (--{}tool); it holds {}",
                                                option_prefix, fmt::join(titles, ", "))};
    }
    return Error{Errc::bad_value, fmt::format("has no tool {}; it holds {}", wanted, fmt::join(titles, ", "))};
  }
  /// Whether all tools have a record in each row.
  [[nodiscard]] bool side_by_side() const {
    return std::all_of(tools_.begin(), tools_.end(),
                       [&](const LoggedTool& tool) { return tool.records.size() == tools_[0].records.size(); }) &&
           side_by_side_ > 1;
  }
  [[nodiscard]] bool empty() const { return tools_.empty(); }
  [[nodiscard]] bool decimal_commas() const { return decimal_commas_; }

 private:
  void take(const TextRow& row, std::size_t header_size) {
    const auto starts = starts_in(row.fields, header_size, columns_);
    side_by_side_ = std::max(side_by_side_, starts.size());
    for (std::size_t k = 0; k < starts.size(); ++k)
      records_[k].push_back(record_of(row, columns_[std::min(k, columns_.size() - 1)], starts[k]));
  }

  /// Tools that stand side by side are told apart by their place in the row, others by what the rows call them.
  void name_tools() {
    if (side_by_side_ > 1) {
      for (auto& [k, records] : records_)
        tools_.push_back(tool_of(k < columns_.size() ? columns_[k].title : fmt::format("tool {}", k + 1), records));
      return;
    }
    std::map<Fields, std::vector<ToolRecord>> by_names;
    for (ToolRecord& record : records_[0]) by_names[record.names].push_back(record);
    if (records_[0].empty()) return;
    if (by_names.size() > 1) by_names.erase(Fields{});  // a row that names no tool tells of none
    for (auto& [names, records] : by_names) tools_.push_back(tool_of(columns_[0].title, records));
  }

  static LoggedTool tool_of(const std::string& title, std::vector<ToolRecord>& records) {
    LoggedTool tool;
    const auto named = std::find_if(records.begin(), records.end(), [](const auto& r) { return !r.names.empty(); });
    if (!title.empty()) add_names(tool, title);
    tool.title = title;
    if (named != records.end()) {
      for (const std::string& name : named->names) add_names(tool, name);
      tool.title = fmt::format("{}{}({})", title, title.empty() ? "" : " ", fmt::join(named->names, ", "));
    }
    tool.records = std::move(records);
    return tool;
  }

  std::vector<ToolColumns> columns_;
  std::map<std::size_t, std::vector<ToolRecord>> records_;  ///< by their place in the row
  std::size_t side_by_side_ = 0;
  std::vector<LoggedTool> tools_;
  bool decimal_commas_ = false;
};

ReadPose pose_of_tool(const ToolRecord& record) {
  const std::string state = lower_case(record.state);
  if (state.empty()) return {{}, "missing"};
  if (state != "ok" && state != "valid") return {{}, record.state};
  std::array<double, 7> v{};
  for (std::size_t n = 0; n < v.size(); ++n) {
    const ReadNumber number = read_number(record.numbers.at(n));
    if (!number.problem.empty()) return {{}, number.problem};
    v.at(n) = number.value;
  }
  ReadPose pose = checked_pose(Eigen::Quaterniond(v[0], v[1], v[2], v[3]), Eigen::Vector3d(v[4], v[5], v[6]), 1);
  if (const ReadNumber error = read_number(record.error); error.problem.empty()) pose.error_mm = error.value;
  return pose;
}

std::optional<double> time_of(const ToolRecord& record) {
  const ReadNumber s = read_number(record.time_s), ns = read_number(record.time_ns);
  if (!s.problem.empty() || !ns.problem.empty()) return std::nullopt;
  return s.value + ns.value / kNsPerSecond;
}

/// The pose of a record; with a reference, against that of the reference in the same row.
ReadPose pose_in_row(const LoggedTool& tool, const LoggedTool* reference, std::size_t row, const PoseReading& how) {
  ReadPose pose = corrected(pose_of_tool(tool.records[row]), how);
  if (reference == nullptr) return pose;
  return against(pose, tool.title, corrected(pose_of_tool(reference->records[row]), how), reference->title);
}

/// "Port 1 (8700339): of 500 records 460 are OK, 33 Missing, 7 Disabled".
std::string count_of_states(const LoggedTool& tool) {
  std::map<std::string, std::size_t> states;
  for (const ToolRecord& record : tool.records) ++states[record.state.empty() ? "without a state" : record.state];
  std::vector<std::string> words;
  words.reserve(states.size());
  for (const auto& [state, count] : states) words.push_back(fmt::format("{} {}", count, state));
  return fmt::format("{}: {} records, {}", tool.title, tool.records.size(), fmt::join(words, ", "));
}

}  // namespace

bool is_ndi_log(const fs::path& path) {
  auto rows = TextRows::open(path);
  for (std::size_t i = 0; rows && i < kLinesToHeader; ++i) {
    const auto row = rows->next();
    if (!row) return false;
    if (is_ndi_header(row->fields)) return true;
  }
  return false;
}

Result<PoseSet> read_ndi_log(const fs::path& path, const PoseReading& how) {
  const auto log = NdiLog::read(path);
  if (!log) return log.error();
  if (log->empty()) return Error{Errc::bad_format, fmt::format("{}: holds no poses", path.string())};
  const auto found = log->find(how.transform, how.option_prefix);
  if (!found) return found.error().with_context(path.string());
  const LoggedTool& tool = **found;
  const LoggedTool* reference = nullptr;
  if (!how.reference.empty()) {
    const auto other = log->find(how.reference, how.option_prefix);
    if (!other) return other.error().with_context(path.string());
    reference = *other;
    if (!log->side_by_side() || reference == &tool) {
      return Error{Errc::bad_value, fmt::format("{}: {} against {} needs two tools that stand in one row",
                                                path.string(), tool.title, reference->title)};
    }
  }
  const bool timed = std::all_of(tool.records.begin(), tool.records.end(), [](const auto& r) { return time_of(r); });
  PoseCollector collector(timed, how.most_error_mm);
  for (std::size_t i = 0; i < tool.records.size(); ++i) {
    const double time_s = timed ? *time_of(tool.records[i]) : static_cast<double>(i);
    collector.add(fmt::format("line {}", tool.records[i].line), time_s, time_s, pose_in_row(tool, reference, i, how));
  }
  collector.note(count_of_states(tool));
  if (log->decimal_commas()) collector.note("its numbers have decimal commas, and are read so");
  if (!timed) collector.note("it has no times: its poses count by their order, row by row");
  auto set = std::move(collector).finish(path);
  if (set) set->direction_known = true;
  return set;
}

}  // namespace birdseye::host
