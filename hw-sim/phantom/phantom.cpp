#include "hw-sim/phantom/phantom.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "drivers/system/json_file.hpp"
#include "drivers/system/thread.hpp"
#include "hw-sim/phantom/body.hpp"
#include "hw-sim/phantom/dicom_series.hpp"
#include "hw-sim/phantom/image_files.hpp"
#include "hw-sim/phantom/implants.hpp"
#include "hw-sim/phantom/json_file.hpp"
#include "hw-sim/phantom/mesh.hpp"
#include "hw-sim/phantom/own_files.hpp"
#include "hw-sim/phantom/shapes.hpp"

namespace birdseye::hw_sim {

namespace {

using Eigen::Vector3d;

constexpr std::array kSurfaces{"liver", "skin", "portal", "hepatic", "tumour", "markers"};

Result<Vector3d> vector_of(const nlohmann::json& json) {
  if (!json.is_array() || json.size() != 3) return Error{Errc::bad_format, "needs three numbers"};
  return Vector3d(json[0].get<double>(), json[1].get<double>(), json[2].get<double>());
}

Result<void> write_surfaces(const std::filesystem::path& folder, const Body& body, const Implants& implants) {
  const Vector3d low = body.grid.origin_mm;
  const Vector3d high = body.grid.last_mm();
  const auto write = [&](const char* name, const Field& field, const Vector3d& from, const Vector3d& to, double mm) {
    return write_ply(folder / name, closed_surface(field, from, to, mm));
  };
  const auto tree_box = [](const VesselTree& tree) {
    std::pair<Vector3d, Vector3d> box{Vector3d::Constant(1e9), Vector3d::Constant(-1e9)};
    for (const Rod& rod : tree) {
      box.first = box.first.cwiseMin(rod.a.cwiseMin(rod.b));
      box.second = box.second.cwiseMax(rod.a.cwiseMax(rod.b));
    }
    box.first -= Vector3d::Constant(10);
    box.second += Vector3d::Constant(10);
    return box;
  };
  const Vector3d reach = implants.tumour_radii_mm + Vector3d::Constant(5);
  const auto markers = [&](const Vector3d& p) {
    double nearest = std::numeric_limits<double>::max();
    for (const Vector3d& m : implants.markers_mm) nearest = std::min(nearest, (p - m).norm() - kMarkerRadiusMm);
    return nearest;
  };
  // Of a field a surface takes the corners of the cells that it goes through, none of which is as far from it as this.
  constexpr double kVessels_mm = 1, kAtMost_mm = 4 * kVessels_mm;
  const auto vessels = [](const VesselTree& tree) {
    return [&tree](const Vector3d& p) { return distance_mm(tree, p, kAtMost_mm); };
  };
  const auto portal_box = tree_box(implants.portal);
  const auto hepatic_box = tree_box(implants.hepatic);
  for (const Result<void>& written : {
           write("liver.ply", body.liver_mm, low, high, 2.5),
           write("skin.ply", body.skin_mm, low, high, 4.0),
           write("portal.ply", vessels(implants.portal), portal_box.first, portal_box.second, kVessels_mm),
           write("hepatic.ply", vessels(implants.hepatic), hepatic_box.first, hepatic_box.second, kVessels_mm),
           write(
               "tumour.ply",
               [&](const Vector3d& p) { return ellipsoid_mm(p, implants.tumour_centre_mm, implants.tumour_radii_mm); },
               implants.tumour_centre_mm - reach, implants.tumour_centre_mm + reach, 1.0),
           write("markers.ply", markers, low, high, 2.0),
       }) {
    if (!written) return written.error();
  }
  return {};
}

/// A series that no phantom is of may be a patient's. One that was interrupted has no truth.json yet.
Result<void> check_series(const std::filesystem::path& folder) {
  const std::filesystem::path series = folder / "ct";
  std::error_code error;
  const std::filesystem::directory_iterator first(series, error);
  if (error || first == std::filesystem::directory_iterator() || read_phantom_truth(folder) ||
      only_slices_of_ours(series))
    return {};
  return Error{Errc::bad_value,
               fmt::format("{}: is not empty, and no truth.json of a phantom is beside it; choose another --out",
                           series.string())};
}

/// All but the series, which is known as ours by its slices.
OwnFiles own_files(const std::filesystem::path& folder) {
  return {folder,
          "birdseye-sim phantom",
          "birdseye-sim-phantom.json",
          {"surfaces"},
          fmt::format(R"(segmentation\.nii\.gz|truth\.json|surfaces/({})\.ply)", fmt::join(kSurfaces, "|"))};
}

/// Files that no phantom is of may be somebody's own. Versions to 0.2.0 kept no list of theirs, and wrote truth.json
/// last.
Result<void> check_files(const OwnFiles& own) {
  std::error_code ignored;
  const bool listed = std::filesystem::exists(own.folder / own.list, ignored);
  return !listed && read_phantom_truth(own.folder) ? Result<void>() : check_free(own);
}

}  // namespace

Result<void> write_phantom(const PhantomSettings& settings) {
  const OwnFiles own = own_files(settings.folder);
  if (auto free = check_series(settings.folder); !free) return free;
  if (auto free = check_files(own); !free) return free;
  std::error_code error;
  std::filesystem::create_directories(settings.folder, error);
  if (error) {
    return Error{Errc::unreadable, fmt::format("{}: cannot be made; choose another --out", settings.folder.string())};
  }
  Result<Body> body = settings.ct.empty() ? Result<Body>(procedural_body(settings.seed))
                                          : body_from_ct(settings.ct, settings.labels, settings.liver_label);
  if (!body) return body.error();
  const Result<Implants> implants = choose_implants(*body, settings.seed);
  if (!implants) {
    return implants.error().with_context(settings.ct.string());
  }
  const std::vector<std::uint8_t> labels = implant(*body, *implants, settings.seed);
  std::vector<std::string> names{"segmentation.nii.gz", "truth.json"};
  for (const char* surface : kSurfaces) names.push_back(fmt::format("surfaces/{}.ply", surface));
  if (auto begun = begin_files(own, names); !begun) return begun;

  // The series is one file after another through one codec; the surfaces are sums. They take each other's time.
  Result<void> series;
  OwnedThread writer([&](const std::stop_token&) {
    series = write_dicom_series(settings.folder / "ct", body->grid, body->hu, settings.seed);
    if (series) series = write_labels(settings.folder / "segmentation.nii.gz", body->grid, labels);
  });
  Result<void> surfaces = write_surfaces(settings.folder / "surfaces", *body, *implants);
  writer.join();
  if (!series) return series;
  if (!surfaces) return surfaces;

  nlohmann::json truth;
  truth["seed"] = settings.seed;
  truth["frame"] = "patient LPS, mm";
  truth["liver_centre_mm"] = json_of(implants->liver_centre_mm);
  truth["tumour_centre_mm"] = json_of(implants->tumour_centre_mm);
  truth["tumour_radii_mm"] = json_of(implants->tumour_radii_mm);
  truth["labels"] = {{"liver", kLiver}, {"portal", kPortal}, {"hepatic", kHepatic}, {"tumour", kTumour}};
  for (const Vector3d& marker : implants->markers_mm) truth["fiducials_mm"].push_back(json_of(marker));
  return write_json(settings.folder / "truth.json", truth);
}

Result<PhantomTruth> read_phantom_truth(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / "truth.json";
  const auto json = read_json_file(path);
  if (!json && json.error().code == Errc::not_found) {
    return Error{Errc::not_found,
                 fmt::format("{}: no phantom here; make one with `birdseye-sim phantom`", path.string())};
  }
  if (!json) return json.error();
  try {
    PhantomTruth truth;
    const auto liver = vector_of(json->at("liver_centre_mm"));
    const auto tumour = vector_of(json->at("tumour_centre_mm"));
    if (!liver || !tumour)
      return Error{Errc::bad_format, fmt::format("{}: a point needs three numbers", path.string())};
    truth.liver_centre_mm = *liver;
    truth.tumour_centre_mm = *tumour;
    for (const auto& item : json->at("fiducials_mm")) {
      const auto point = vector_of(item);
      if (!point) return Error{Errc::bad_format, fmt::format("{}: a point needs three numbers", path.string())};
      truth.fiducials_mm.push_back(*point);
    }
    return truth;
  } catch (const nlohmann::json::exception&) {
    return Error{Errc::bad_format, fmt::format("{}: {}", path.string(), kPartMissing)};
  }
}

}  // namespace birdseye::hw_sim
