#include "hw-sim/operation/operation_scene.hpp"

#include <bit>
#include <cstddef>
#include <utility>

#include "calibration/picture/field_edge.hpp"
#include "host/files/picture.hpp"
#include "hw-sim/operation/bench_path.hpp"
#include "hw-sim/phantom/mesh.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr double kSurface_mm = 2;  // between the vertices of the organ's surface
constexpr double kField = 0.45;    // of the picture's width: more of the field's edge is seen than of the usual scope's
constexpr double kWall_mm = 130;   // the cavity's, about the target: behind the scope and behind the organ
const Eigen::Vector3d kReach_mm = Eigen::Vector3d::Constant(70);  // of the organ, about its middle

std::size_t bytes_of_picture(const CameraModel& lens) {
  return std::size_t{3} * static_cast<std::size_t>(lens.width_px) * static_cast<std::size_t>(lens.height_px);
}

}  // namespace

Result<std::unique_ptr<OperationScene>> OperationScene::create(const OperationTruth& truth, std::uint64_t seed) {
  const Eigen::Vector3d& middle = OperationTruth::organ_middle_mm();
  Cavity cavity;
  cavity.organ = closed_surface(OperationTruth::organ_mm, middle - kReach_mm, middle + kReach_mm, kSurface_mm);
  cavity.wall_centre_mm = truth.target_mm();
  cavity.wall_radius_mm = kWall_mm;
  Scopes scopes;
  for (std::size_t i = 0; i < truth.scopes_used(); ++i) {
    auto scope = Laparoscope::create({.lens = truth.lens_of(i), .seed = seed, .field = kField});
    if (!scope) return std::move(scope).error();
    (*scope)->set_cavity(cavity);
    (*scope)->set_bench(BenchPath::board());
    scopes[i] = *std::move(scope);
  }
  return std::unique_ptr<OperationScene>(new OperationScene(truth, std::move(scopes)));
}

/// The scope looks straight at the middle of the board.
std::optional<RoundField> OperationScene::round_field(std::size_t scope) {
  constexpr std::size_t kPictures = 5;
  constexpr double kAbove_mm = 100;
  const CameraModel& lens = truth_.lens_of(scope);
  const Chessboard board = BenchPath::board();
  const Eigen::Vector3d middle_mm = board.square_mm / 2 * Eigen::Vector3d(board.columns - 1, board.rows - 1, 0);
  const Transform<Camera, Marker> camera_from_marker(Eigen::Matrix3d::Identity(),
                                                     kAbove_mm * Eigen::Vector3d::UnitZ() - middle_mm);
  std::vector<RoundField> found;
  for (std::size_t i = 0; i < kPictures; ++i) {
    const auto rgb = scopes_[scope]->look_at_bench(camera_from_marker, i);
    const auto grey = host::grey_of(RgbView{rgb, lens.width_px, lens.height_px});
    if (const auto edge = calibration::find_round_field({grey, lens.width_px, lens.height_px})) found.push_back(*edge);
  }
  return calibration::agreed_round_field(found, kPictures);
}

std::vector<std::uint8_t> OperationScene::look(double at_s) {
  const auto noise = std::bit_cast<std::uint64_t>(at_s);
  Laparoscope& scope = *scopes_[truth_.scope_in_use(at_s)];
  scope.zoom(truth_.zoom(at_s));
  scope.change_organ(truth_.organ(at_s));
  if (truth_.at_board(at_s)) return scope.look_at_bench(truth_.camera_from_marker(at_s), noise);
  if (truth_.carried(at_s))
    return std::vector<std::uint8_t>(bytes_of_picture(truth_.lens(at_s)));  // nothing near is lit
  return scope.look_into_cavity(truth_.camera_from_patient(at_s), noise);
}

}  // namespace birdseye::hw_sim
