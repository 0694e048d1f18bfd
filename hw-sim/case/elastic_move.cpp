#include "hw-sim/case/elastic_move.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "hw-sim/case/elastic_body.hpp"

namespace birdseye::hw_sim {

namespace {

using Eigen::Vector3d;

constexpr double kCellMm = 8;

/// Nodes that reach well beyond the CT, so that what flows about the organ is smooth up to its edge.
Grid lattice_about(const Grid& ct) {
  constexpr double kBeyondMm = 24;
  Grid nodes;
  nodes.spacing_mm = Vector3d::Constant(kCellMm);
  nodes.origin_mm = ct.origin_mm - Vector3d::Constant(kBeyondMm);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    nodes.size[axis] = static_cast<int>(std::ceil((ct.last_mm()[a] + kBeyondMm - nodes.origin_mm[a]) / kCellMm)) + 1;
  }
  return nodes;
}

/// The share of each cell that is the organ, and a little where only its surface is.
std::vector<double> filled_cells(const OrganShape& organ, const Grid& nodes) {
  constexpr double kLeast = 0.05;
  const std::array<int, 3> cells = {nodes.size[0] - 1, nodes.size[1] - 1, nodes.size[2] - 1};
  const auto cell_of = [&](const Vector3d& p) {
    const Vector3d at = (p - nodes.origin_mm) / kCellMm;
    return (static_cast<std::size_t>(at.z()) * static_cast<std::size_t>(cells[1]) + static_cast<std::size_t>(at.y())) *
               static_cast<std::size_t>(cells[0]) +
           static_cast<std::size_t>(at.x());
  };
  const auto count =
      static_cast<std::size_t>(cells[0]) * static_cast<std::size_t>(cells[1]) * static_cast<std::size_t>(cells[2]);
  std::vector<double> filled(count, 0), voxels(count, 0);
  const Grid& ct = organ.grid;
  for (int k = 0; k < ct.size[2]; ++k) {
    for (int j = 0; j < ct.size[1]; ++j) {
      for (int i = 0; i < ct.size[0]; ++i) {
        const std::size_t cell = cell_of(ct.point(i, j, k));
        const int label = organ.labels[ct.index(i, j, k)];
        voxels[cell] += 1;
        if (std::count(organ.organ_labels.begin(), organ.organ_labels.end(), label) > 0) filled[cell] += 1;
      }
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (filled[i] > 0) filled[i] = std::max(kLeast, filled[i] / voxels[i]);
  }
  for (const Eigen::Vector3f& v : organ.surface.vertices) {
    double& share = filled[cell_of(v.cast<double>())];
    share = std::max(share, kLeast);
  }
  return filled;
}

/// The part of the surface that each vertex stands for, mm^2.
std::vector<double> vertex_areas(const Mesh& mesh) {
  std::vector<double> areas(mesh.vertices.size(), 0);
  for (const auto& [a, b, c] : mesh.triangles) {
    const double area = 0.5 * (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).norm();
    for (const std::uint32_t v : {a, b, c}) areas[v] += area / 3;
  }
  return areas;
}

/// A smooth patch of a surface.
struct Patch {
  Vector3d centre_mm;
  double radius_mm;
  [[nodiscard]] double at(const Vector3d& p) const {
    return std::exp(-0.5 * (p - centre_mm).squaredNorm() / (radius_mm * radius_mm));
  }
};

void add_numbers(DrawnMove& to, const std::string& name, const Patch& patch) {
  const Vector3d& c = patch.centre_mm;
  to.numbers.push_back({name + "_mm", {c.x(), c.y(), c.z()}});
  to.numbers.push_back({name + "_radius_mm", {patch.radius_mm}});
}

/// Two or three on the side away from the scope, where an organ is tied to its surroundings.
std::vector<Patch> draw_holds(const Mesh& mesh, const Vector3d& towards_scope, Draw& draw) {
  const std::size_t count = 2 + draw.index(2);
  std::vector<Patch> holds;
  while (holds.size() < count) {
    const std::size_t v = draw.index(mesh.vertices.size());
    if (mesh.normals[v].cast<double>().dot(towards_scope) > 0.2) continue;
    holds.push_back({mesh.vertices[v].cast<double>(), draw.uniform(15, 28)});
  }
  return holds;
}

/// The furthest move of a vertex of the surface.
double most_moved_mm(const Mesh& mesh, const NodeField& field) {
  double most2 = 0;
  for (const Eigen::Vector3f& v : mesh.vertices) most2 = std::max(most2, field.at(v.cast<double>()).squaredNorm());
  return std::sqrt(most2);
}

}  // namespace

Result<DrawnMove> elastic(const OrganShape& organ, Draw& draw) {
  constexpr double kBedPerMm = 5e-4;     // everywhere: what lies about the organ
  constexpr std::size_t kTractions = 3;  // and gravity
  const Mesh& mesh = organ.surface;
  const std::vector<double> areas = vertex_areas(mesh);
  DrawnMove out;
  const double poisson = draw.uniform(0.35, 0.45);
  const Grid nodes = lattice_about(organ.grid);
  ElasticBody body(nodes, filled_cells(organ, nodes), poisson);
  out.numbers = {{"poisson", {poisson}}, {"cell_mm", {kCellMm}}, {"cells", {static_cast<double>(body.cells())}}};

  const std::vector<Patch> holds = draw_holds(mesh, organ.towards_scope, draw);
  const double hold_per_mm = draw.uniform(0.03, 0.1);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Vector3d p = mesh.vertices[v].cast<double>();
    double stiffness = kBedPerMm;
    for (const Patch& hold : holds) stiffness += hold_per_mm * hold.at(p);
    body.hold(p, areas[v] * stiffness);
  }
  for (std::size_t i = 0; i < holds.size(); ++i) add_numbers(out, "hold_" + std::to_string(i + 1), holds[i]);

  std::vector<ElasticBody::Load> loads(1, body.no_load());
  const Vector3d down = draw.direction();
  body.weigh(loads[0], down);
  out.numbers.push_back({"gravity", {down.x(), down.y(), down.z()}});
  for (std::size_t i = 0; i < kTractions; ++i) {
    const std::size_t centre = draw.index(mesh.vertices.size());
    const Patch patch{mesh.vertices[centre].cast<double>(), draw.uniform(20, 40)};
    const Vector3d pull = draw.about(-mesh.normals[centre].cast<double>(), 1);
    loads.push_back(body.no_load());
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      const Vector3d p = mesh.vertices[v].cast<double>();
      body.push(loads.back(), p, areas[v] * patch.at(p) * pull);
    }
    add_numbers(out, "traction_" + std::to_string(i + 1), patch);
    out.numbers.push_back({"traction_" + std::to_string(i + 1) + "_direction", {pull.x(), pull.y(), pull.z()}});
  }

  std::vector<std::optional<Result<Eigen::VectorXd>>> settled(loads.size());
  tbb::parallel_for(std::size_t{0}, loads.size(), [&](std::size_t i) { settled[i] = body.settle(loads[i]); });
  Eigen::VectorXd sum = body.no_load();
  for (const auto& one : settled) {
    if (!one->has_value()) return one->error();
    // Each load alone would move the organ by about as much as the others.
    const double weight = draw.normal();
    const Eigen::VectorXd& displacement_mm = **one;
    sum += weight / displacement_mm.lpNorm<Eigen::Infinity>() * displacement_mm;
  }
  std::vector<Vector3d> moves = body.over_lattice(sum);
  const double most_mm = most_moved_mm(mesh, NodeField(nodes, moves));
  for (Vector3d& move : moves) move /= most_mm;
  const auto field = std::make_shared<const NodeField>(nodes, std::move(moves));
  out.move_mm = [field](const Vector3d& rest, double size_mm) -> Vector3d { return size_mm * field->at(rest); };
  return out;
}

}  // namespace birdseye::hw_sim
