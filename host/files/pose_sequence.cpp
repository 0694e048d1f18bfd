#include "host/files/pose_sequence.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <fstream>
#include <string_view>

#include "host/files/pose_collector.hpp"
#include "host/files/sequence_header.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

Result<SequenceHeader> read_header(const fs::path& path) {
  auto header = read_sequence_header(path);
  if (header && header->transforms.empty()) {
    return Error{Errc::bad_format, fmt::format("{}: holds no transforms of frames (Seq_Frame0000_..Transform) in its "
                                               "header; record it with the tracker's transforms",
                                               path.string())};
  }
  return header;
}

/// The name as the sequence has it, whether or not it was given with "Transform" at its end.
Result<std::string> find_transform(const SequenceHeader& sequence, const fs::path& path, std::string name,
                                   const std::string& reference, const std::string& option_prefix) {
  const std::string held = fmt::format("it holds {}", fmt::join(sequence.transforms, ", "));
  if (name.ends_with(kTransformField)) name.resize(name.size() - kTransformField.size());
  if (sequence.transforms.contains(name)) return name;
  if (!name.empty())
    return Error{Errc::bad_value, fmt::format("{}: has no transform {}; {}", path.string(), name, held)};
  auto others = sequence.transforms;
  others.erase(reference);
  if (others.size() == 1) return *others.begin();
  return Error{Errc::bad_value, fmt::format("{}: say by name which transform is the sensor's (--{}transform); {}",
                                            path.string(), option_prefix, held)};
}

ReadPose pose_of(const SequenceHeader::Fields& frame, const std::string& transform, const PoseReading& how) {
  const std::string key = transform + std::string(kTransformField);
  const std::string_view status = value_of(frame, transform + std::string(kTransformStatusField));
  // A sequence without states has only what was seen.
  if (!status.empty() && status != kStatusOk) return {{}, std::string(status)};
  if (!frame.contains(key)) return {{}, "missing"};
  return corrected(read_matrix(value_of(frame, key), how.mm_per_unit), how);
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

Result<PoseSet> read_sequence(const fs::path& path, const PoseReading& how) {
  std::string transform = how.transform, reference = how.reference;
  const auto sequence = read_header(path);
  if (!sequence) return sequence.error();
  const bool relative = !reference.empty();
  if (relative) {
    auto found = find_transform(*sequence, path, reference, {}, how.option_prefix);
    if (!found) return found.error();
    reference = *found;
  }
  auto found = find_transform(*sequence, path, transform, reference, how.option_prefix);
  if (!found) return found.error();
  transform = *found;
  if (relative && transform == reference) {
    return Error{Errc::bad_value,
                 fmt::format("{}: {} against itself stands still; name two transforms", path.string(), transform)};
  }
  if (transform.starts_with("TrackerTo") && !how.inverted) {
    return Error{Errc::bad_value, fmt::format("{}: {} by its name takes the tracker's points to the sensor: say so by "
                                              "--poses-are sensor_from_tracker, or name the transform to the tracker",
                                              path.string(), transform)};
  }
  const bool timed = std::any_of(sequence->frames.begin(), sequence->frames.end(),
                                 [](const auto& item) { return item.second.contains(kTimestampField); });
  PoseCollector collector(timed, how.most_error_mm);
  for (const auto& [number, frame] : sequence->frames) {
    const std::string name = fmt::format("frame {}", number);
    const ReadPose pose =
        relative ? against(pose_of(frame, transform, how), transform, pose_of(frame, reference, how), reference)
                 : pose_of(frame, transform, how);
    ReadNumber time =
        timed ? read_number(value_of(frame, kTimestampField)) : ReadNumber{static_cast<double>(number), {}};
    ReadNumber unfiltered =
        frame.contains(kUnfilteredTimestampField) ? read_number(value_of(frame, kUnfilteredTimestampField)) : time;
    collector.set_next_index(number);
    if (pose.problem.empty() && !(time.problem + unfiltered.problem).empty()) {
      collector.reject(name, "has no time");
    } else {
      collector.add(name, time.value, unfiltered.value, pose);
    }
  }
  auto set = std::move(collector).finish(path);
  if (set) set->direction_known = true;
  return set;
}

}  // namespace birdseye::host
