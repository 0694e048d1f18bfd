#include "tests/host/operation/read_lies.hpp"

#include <fmt/format.h>

#include <array>
#include <string_view>

#include "calibration/record/field_map_file.hpp"
#include "device/birdseyed/core.hpp"
#include "host/operation/replay_hardware.hpp"
#include "host/volume/import.hpp"
#include "host/volume/labels.hpp"
#include "tests/support/core_session.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::testing {

namespace {

/// A cube of 40 voxels of 5 mm, in NRRD. begins_mm: along each axis.
std::string cube(const std::string& type, std::size_t bytes, double begins_mm) {
  std::string text = fmt::format(
      "NRRD0004\ntype: {0}\ndimension: 3\nspace: left-posterior-superior\nsizes: 40 40 40\n"
      "space directions: (5,0,0) (0,5,0) (0,0,5)\nkinds: domain domain domain\nendian: little\nencoding: raw\n"
      "space origin: ({1},{1},{1})\n\n",
      type, begins_mm);
  text.append(bytes * 40 * 40 * 40, '\1');
  return text;
}

}  // namespace

std::string of_labels_of_another_ct() {
  const Scratch scratch;
  const auto ct = host::import_volume({scratch.file("ct.nrrd", cube("int16", 2, 0))});
  if (!ct) return ct.error().what;
  const auto labels = host::import_labels(scratch.file("labels.nrrd", cube("uint8", 1, 37)), *ct);
  if (labels) return {};
  // The folder is another in each run.
  std::string said = labels.error().what;
  const std::string folder = scratch.path().string();
  for (auto at = said.find(folder); at != std::string::npos; at = said.find(folder))
    said.replace(at, folder.size(), "OUT");
  return said;
}

std::string of_a_recording_of_another_camera() {
  const calibration::Identity tracker{{"model", "miniBIRD 800"}, {"unit_serial", "4711"}};
  host::ReplayHardware hardware({{"the calibration record",
                                  {tracker, {{"card", "Storz"}, {"serial", "A1"}}},
                                  host::DependsOn::tracker_and_camera,
                                  "give a record that holds for these frames (--calibration)"}},
                                {tracker, {{"card", "Storz"}, {"serial", "B2"}}}, false);
  return hardware.why_not();
}

std::string of_another_carts_field_map() {
  calibration::FieldMapData data;
  data.functions.low_mm = {100, -300, -100};
  data.functions.high_mm = {700, 300, 200};
  data.position_mm.assign(4, Eigen::Vector3d(1, 2, 3));
  data.sigma_mm.assign(9 * 9 * 9, 0.7);
  device::CoreSettings settings;
  settings.field = *calibration::FieldMap::from(std::move(data));
  settings.field_of = {{"model", "miniBIRD 800"}, {"unit_serial", "4711"}};
  device::Core core(settings);
  auto events = session(3, 1);
  for (device::RawEvent& event : events) {
    auto* changed = std::get_if<device::InstrumentChanged>(&event);
    if (changed != nullptr && changed->instrument == device::Instrument::tracker)
      changed->identity = {{"model", "miniBIRD 800"}, {"unit_serial", "4712"}};
  }
  for (const auto& birds : only<wire::Birds>(told(core, events)))
    if (!birds.birds.empty()) return {};
  return core.status_text();
}

}  // namespace birdseye::testing
