#include "host/app/calibrate/pose_sequence.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <string_view>

#include "host/app/calibrate/pose_collector.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kTransform = "Transform";
/// A header's lines are short; one that is longer is pixels.
constexpr std::size_t kLongestLine = 1 << 16;

/// What the header says of one frame: by the field's name, as "StylusToTrackerTransformStatus".
using Frame = std::map<std::string, std::string, std::less<>>;

struct Sequence {
  std::map<std::size_t, Frame> frames;
  std::set<std::string> transforms;  ///< without the "Transform" at the end
};

/// A line of a MetaImage's header, "key = value", or of an NRRD's, "key:=value".
std::optional<std::pair<std::string_view, std::string_view>> field_of(std::string_view line) {
  const auto equals = line.find('=');
  if (equals == std::string_view::npos || equals == 0) return std::nullopt;
  const auto bare = [](std::string_view text) {
    const auto first = text.find_first_not_of(" \t\r");
    if (first == std::string_view::npos) return std::string_view();
    return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
  };
  return std::pair{bare(line.substr(0, line[equals - 1] == ':' ? equals - 1 : equals)), bare(line.substr(equals + 1))};
}

void take_line(std::string_view line, Sequence& sequence) {
  constexpr std::string_view kFrame = "Seq_Frame";
  if (!line.starts_with(kFrame)) return;
  const auto field = field_of(line);
  if (!field) return;
  std::string_view key = field->first.substr(kFrame.size());
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), number);
  if (error != std::errc() || end == key.data() + key.size() || *end != '_') return;
  key.remove_prefix(static_cast<std::size_t>(end - key.data()) + 1);
  if (key.ends_with(kTransform)) sequence.transforms.emplace(key.substr(0, key.size() - kTransform.size()));
  sequence.frames[number].insert_or_assign(std::string(key), std::string(field->second));
}

Result<Sequence> read_header(const fs::path& path) {
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored))
    return Error{Errc::not_found, fmt::format("{}: no such file", path.string())};
  std::ifstream in(path, std::ios::binary);
  if (!in) return Error{Errc::unreadable, fmt::format("{}: cannot be opened; check its permissions", path.string())};
  Sequence sequence;
  std::string line;
  for (bool nrrd = false, first = true; std::getline(in, line) && line.size() < kLongestLine; first = false) {
    if (first) nrrd = line.starts_with("NRRD");
    take_line(line, sequence);
    // Here the header ends and the pixels begin.
    if (line.starts_with("ElementDataFile") || (nrrd && (line.empty() || line == "\r"))) break;
  }
  if (sequence.transforms.empty()) {
    return Error{Errc::bad_format, fmt::format("{}: holds no transforms of frames (Seq_Frame0000_..Transform) in its "
                                               "header; record it with the tracker's transforms",
                                               path.string())};
  }
  return sequence;
}

/// The name as the sequence has it, whether or not it was given with "Transform" at its end.
Result<std::string> find_transform(const Sequence& sequence, const fs::path& path, std::string name,
                                   const std::string& reference) {
  const std::string held = fmt::format("it holds {}", fmt::join(sequence.transforms, ", "));
  if (name.ends_with(kTransform)) name.resize(name.size() - kTransform.size());
  if (sequence.transforms.contains(name)) return name;
  if (!name.empty())
    return Error{Errc::bad_value, fmt::format("{}: has no transform {}; {}", path.string(), name, held)};
  auto others = sequence.transforms;
  others.erase(reference);
  if (others.size() == 1) return *others.begin();
  return Error{Errc::bad_value,
               fmt::format("{}: say by name which transform is the sensor's (--transform); {}", path.string(), held)};
}

std::string_view value_of(const Frame& frame, const std::string& key) {
  const auto found = frame.find(key);
  return found == frame.end() ? std::string_view() : std::string_view(found->second);
}

ReadPose pose_of(const Frame& frame, const std::string& transform, double mm_per_unit) {
  const std::string key = transform + std::string(kTransform);
  const std::string_view status = value_of(frame, key + "Status");
  // A sequence without states has only what was seen.
  if (!status.empty() && status != "OK") return {{}, std::string(status)};
  if (!frame.contains(key)) return {{}, "missing"};
  return read_matrix(value_of(frame, key), mm_per_unit);
}

/// reference_from_sensor, or which of both is not there.
ReadPose relative_pose_of(const Frame& frame, const std::string& transform, const std::string& reference,
                          double mm_per_unit) {
  ReadPose sensor = pose_of(frame, transform, mm_per_unit);
  if (!sensor.problem.empty()) return {{}, transform + " " + sensor.problem};
  const ReadPose base = pose_of(frame, reference, mm_per_unit);
  if (!base.problem.empty()) return {{}, reference + " " + base.problem};
  const auto tracker_from_reference = Transform<Tracker, Marker>::from_matrix(base.tracker_from_sensor.matrix());
  const Transform<Marker, Sensor> relative = tracker_from_reference.inverse() * sensor.tracker_from_sensor;
  sensor.tracker_from_sensor = Transform<Tracker, Sensor>(relative.rotation(), relative.translation());
  return sensor;
}

}  // namespace

bool is_sequence(const fs::path& path) {
  const std::string extension = path.extension().string();
  if (extension == ".mha" || extension == ".mhd" || extension == ".nrrd" || extension == ".nhdr") return true;
  std::ifstream in(path, std::ios::binary);
  std::string first(10, '\0');
  in.read(first.data(), static_cast<std::streamsize>(first.size()));
  return first.starts_with("ObjectType") || first.starts_with("NRRD000");
}

Result<PoseSet> read_sequence(const fs::path& path, std::string transform, std::string reference, double mm_per_unit) {
  const auto sequence = read_header(path);
  if (!sequence) return sequence.error();
  const bool relative = !reference.empty();
  if (relative) {
    auto found = find_transform(*sequence, path, reference, {});
    if (!found) return found.error();
    reference = *found;
  }
  auto found = find_transform(*sequence, path, transform, reference);
  if (!found) return found.error();
  transform = *found;
  if (relative && transform == reference) {
    return Error{Errc::bad_value,
                 fmt::format("{}: {} against itself stands still; name two transforms", path.string(), transform)};
  }
  const bool timed = std::any_of(sequence->frames.begin(), sequence->frames.end(),
                                 [](const auto& item) { return item.second.contains("Timestamp"); });
  PoseCollector collector(timed);
  for (const auto& [number, frame] : sequence->frames) {
    const std::string name = fmt::format("frame {}", number);
    const ReadPose pose =
        relative ? relative_pose_of(frame, transform, reference, mm_per_unit) : pose_of(frame, transform, mm_per_unit);
    ReadNumber time = timed ? read_number(value_of(frame, "Timestamp")) : ReadNumber{static_cast<double>(number), {}};
    ReadNumber unfiltered =
        frame.contains("UnfilteredTimestamp") ? read_number(value_of(frame, "UnfilteredTimestamp")) : time;
    collector.set_next_index(number);
    if (pose.problem.empty() && !(time.problem + unfiltered.problem).empty()) {
      collector.reject(name, "has no time");
    } else {
      collector.add(name, time.value, unfiltered.value, pose);
    }
  }
  return std::move(collector).finish(path);
}

Result<PoseSet> read_relative_pose_set(const fs::path& path, const std::string& transform, const std::string& reference,
                                       double mm_per_unit) {
  if (reference.empty())
    return Error{Errc::bad_value, fmt::format("{}: name the reference's transform (--reference)", path.string())};
  return read_sequence(path, transform, reference, mm_per_unit);
}

Result<std::vector<std::string>> sequence_transforms(const fs::path& path) {
  const auto sequence = read_header(path);
  if (!sequence) return sequence.error();
  return std::vector<std::string>(sequence->transforms.begin(), sequence->transforms.end());
}

}  // namespace birdseye::host
