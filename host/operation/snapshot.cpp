#include "host/operation/snapshot.hpp"
#include "drivers/system/json_file.hpp"
#include "host/files/camera_files.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>

#include "drivers/system/durable.hpp"
#include "host/files/picture.hpp"
#include "host/files/text_files.hpp"
#include "host/files/write_files.hpp"
#include "host/operation/identity_json.hpp"
#include "host/volume/stated_geometry.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr const char* kSheet = "snapshot.json";
constexpr const char* kVideo = "video.png";
constexpr const char* kPicture = "picture.png";

std::string number(double value) {
  return fmt::format("{:.17g}", value);
}

/// Paths of folder's own files are given as they are from wherever folder is.
std::vector<std::string> render_arguments(const fs::path& folder, const Snapshot& snapshot) {
  std::error_code ignored;
  const auto whole = [&ignored](const fs::path& path) { return fs::absolute(path, ignored).string(); };
  std::vector<std::string> out{"render", "--volume", whole(snapshot.patient.ct.path)};
  const auto add = [&out](const char* option, const std::string& value) {
    out.emplace_back(option);
    out.push_back(value);
  };
  if (!snapshot.patient.ct.series.empty()) add("--series", snapshot.patient.ct.series);
  if (snapshot.patient.ct.untilt) out.emplace_back("--untilt");
  std::ranges::move(options_of(snapshot.patient.ct.stated), std::back_inserter(out));
  if (!snapshot.patient.shown.empty()) {
    add("--labels", whole(snapshot.patient.labels));
    add("--keep", joined(snapshot.patient.shown, ","));
  }
  if (!snapshot.patient.margins_mm.empty()) {
    if (snapshot.patient.shown.empty()) add("--labels", whole(snapshot.patient.labels));
    add("--margins", fmt::format("{}", fmt::join(snapshot.patient.margins_mm, ",")));
    add("--margin-of", joined(snapshot.patient.targets, ","));
  }
  add("--camera", whole(folder / "camera.yaml"));
  add("--pose", whole(folder / "camera_from_patient.txt"));
  add("--transfer", whole(folder / "transfer.json"));
  add("--over", whole(folder / kVideo));
  if (snapshot.deformed) add("--deformation", whole(folder / "field.mha"));
  add("--step-mm", number(snapshot.look.render.step_mm));
  add("--opacity", number(snapshot.look.opacity * snapshot.shown.strength));
  add("--engine", snapshot.engine);
  if (snapshot.look.surface_in_front) out.emplace_back("--surface-in-front");
  if (snapshot.look.style == OverlayStyle::outlines) out.emplace_back("--outlines");
  if (snapshot.look.hole_radius) add("--hole", number(*snapshot.look.hole_radius));
  if (const auto& clip = snapshot.look.render.clip) {
    out.emplace_back("--clip-plane");
    for (const double value : {clip->normal.x(), clip->normal.y(), clip->normal.z(), clip->offset_mm})
      out.push_back(number(value));
  }
  return out;
}

}  // namespace

Result<void> write_snapshot(const fs::path& folder, const Snapshot& snapshot) {
  if (auto made = make_folder_durably(folder); !made) return made;
  const wire::VideoFrame& frame = snapshot.frame;
  const ShownPicture& shown = snapshot.shown;
  std::vector<FileText> files{
      {folder / kVideo, png_of(RgbView{*frame.rgb, frame.width_px, frame.height_px})},
      {folder / kPicture, png_of(RgbView{snapshot.picture, shown.width_px, shown.height_px})},
  };
  nlohmann::json sheet{{"sequence", frame.info.sequence}, {"acquired_ns", frame.info.acquired.ns},
                       {"age_ms", shown.age_ms},          {"overlaid", shown.overlaid},
                       {"strength", shown.strength},      {"reason", shown.reason}};
  const PictureHardware& with = snapshot.taken_with;
  if (!with.tracker.empty()) sheet["tracker"] = with.tracker;
  if (!with.camera.empty()) sheet["camera"] = with.camera;
  if (!with.scope.empty()) sheet["scope"] = with.scope;
  if (!snapshot.not_signed.empty()) sheet["unsigned"] = snapshot.not_signed;
  if (snapshot.fre_mm) sheet["fre_mm"] = *snapshot.fre_mm;
  if (snapshot.identity) sheet["patient"] = json_of(*snapshot.identity);
  if (shown.overlaid && snapshot.setup && snapshot.camera_from_patient && snapshot.transfer) {
    files.push_back({folder / "camera.yaml", camera_text(snapshot.setup->camera())});
    files.push_back({folder / "camera_from_patient.txt", pose_text(snapshot.camera_from_patient->matrix())});
    files.push_back({folder / "transfer.json", transfer_text(*snapshot.transfer)});
    sheet["drawn_again_by"] = render_arguments(folder, snapshot);
    if (snapshot.deformed) {
      if (auto written = write_field(folder / "field.mha", snapshot.deformed->field); !written) return written;
    }
  }
  files.push_back({folder / kSheet, text_of(sheet)});
  return write_files(files);
}

Result<PictureHardware> read_taken_with(const fs::path& picture) {
  PictureHardware out;
  if (picture.filename() != kVideo && picture.filename() != kPicture) return out;
  const fs::path path = picture.parent_path() / kSheet;
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return out;
  constexpr std::size_t kMostBytes = 1U << 20U;
  const auto sheet = read_json_file(path, kMostBytes);
  if (!sheet) return sheet.error();
  try {
    out.tracker = sheet->value("tracker", out.tracker);
    out.camera = sheet->value("camera", out.camera);
    out.scope = sheet->value("scope", out.scope);
  } catch (const nlohmann::json::exception&) {
    return Error{Errc::bad_format,
                 fmt::format("{}: {}; give the snapshot as the window wrote it", path.string(), kPartMissing)};
  }
  return out;
}

}  // namespace birdseye::host
