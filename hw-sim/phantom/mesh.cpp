#include "hw-sim/phantom/mesh.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <fstream>
#include <limits>
#include <sstream>

namespace birdseye::hw_sim {

static_assert(std::endian::native == std::endian::little, "the PLY codec writes memory as it lies");

namespace {

constexpr std::uint32_t kNoVertex = std::numeric_limits<std::uint32_t>::max();

/// The mean of the points where the cell's twelve edges cross zero, in cell units from its low corner.
bool crossing_mean(const std::array<float, 8>& corner, Eigen::Vector3f& mean) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  int crossings = 0;
  for (int a = 0; a < 8; ++a) {
    for (int axis = 0; axis < 3; ++axis) {
      const int b = a | (1 << axis);
      if (b == a) continue;
      const float fa = corner[static_cast<std::size_t>(a)];
      const float fb = corner[static_cast<std::size_t>(b)];
      if ((fa < 0) == (fb < 0)) continue;
      Eigen::Vector3f at(static_cast<float>(a & 1), static_cast<float>((a >> 1) & 1), static_cast<float>(a >> 2));
      at[axis] = fa / (fa - fb);
      sum += at;
      ++crossings;
    }
  }
  if (crossings == 0) return false;
  mean = sum / static_cast<float>(crossings);
  return true;
}

}  // namespace

void compute_normals(Mesh& mesh) {
  mesh.normals.assign(mesh.vertices.size(), Eigen::Vector3f::Zero());
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3f area =
        (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]);
    for (const std::uint32_t v : t) mesh.normals[v] += area;
  }
  for (Eigen::Vector3f& n : mesh.normals) n.normalize();
}

std::pair<Eigen::Vector3d, Eigen::Vector3d> bounds(const Mesh& mesh) {
  Eigen::Vector3f low = mesh.vertices.front();
  Eigen::Vector3f high = low;
  for (const Eigen::Vector3f& v : mesh.vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  return {low.cast<double>(), high.cast<double>()};
}

Mesh surface_of(const ScalarGrid& field) {
  const Grid& grid = field.grid;
  Mesh mesh;
  std::vector<std::uint32_t> vertex_of_cell(grid.voxels(), kNoVertex);
  for (int k = 0; k + 1 < grid.size[2]; ++k) {
    for (int j = 0; j + 1 < grid.size[1]; ++j) {
      for (int i = 0; i + 1 < grid.size[0]; ++i) {
        std::array<float, 8> corner;
        for (int c = 0; c < 8; ++c) {
          corner[static_cast<std::size_t>(c)] = field.values[grid.index(i + (c & 1), j + ((c >> 1) & 1), k + (c >> 2))];
        }
        Eigen::Vector3f mean;
        if (!crossing_mean(corner, mean)) continue;
        vertex_of_cell[grid.index(i, j, k)] = static_cast<std::uint32_t>(mesh.vertices.size());
        mesh.vertices.emplace_back(
            (grid.point(i, j, k) + mean.cast<double>().cwiseProduct(grid.spacing_mm)).cast<float>());
      }
    }
  }
  // Each grid edge that crosses zero is ringed by four cells: their vertices make a quad, turned to face outwards.
  for (int k = 1; k + 1 < grid.size[2]; ++k) {
    for (int j = 1; j + 1 < grid.size[1]; ++j) {
      for (int i = 1; i + 1 < grid.size[0]; ++i) {
        const bool inside = field.values[grid.index(i, j, k)] < 0;
        for (int axis = 0; axis < 3; ++axis) {
          std::array<int, 3> step{};
          step[static_cast<std::size_t>(axis)] = 1;
          if (inside == (field.values[grid.index(i + step[0], j + step[1], k + step[2])] < 0)) continue;
          std::array<int, 3> u{}, v{};
          u[static_cast<std::size_t>((axis + 1) % 3)] = 1;
          v[static_cast<std::size_t>((axis + 2) % 3)] = 1;
          const std::uint32_t q[4] = {vertex_of_cell[grid.index(i - u[0] - v[0], j - u[1] - v[1], k - u[2] - v[2])],
                                      vertex_of_cell[grid.index(i - v[0], j - v[1], k - v[2])],
                                      vertex_of_cell[grid.index(i, j, k)],
                                      vertex_of_cell[grid.index(i - u[0], j - u[1], k - u[2])]};
          if (inside) {
            mesh.triangles.push_back({q[0], q[1], q[2]});
            mesh.triangles.push_back({q[0], q[2], q[3]});
          } else {
            mesh.triangles.push_back({q[0], q[2], q[1]});
            mesh.triangles.push_back({q[0], q[3], q[2]});
          }
        }
      }
    }
  }
  compute_normals(mesh);
  return mesh;
}

Mesh closed_surface(const Field& field, const Eigen::Vector3d& low_mm, const Eigen::Vector3d& high_mm,
                    double spacing_mm) {
  ScalarGrid sampled = ScalarGrid::sample(field, Grid::around(low_mm, high_mm, spacing_mm));
  const Grid& grid = sampled.grid;
  // A border that is outside closes the surface.
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        const bool border =
            i < 2 || j < 2 || k < 2 || i > grid.size[0] - 3 || j > grid.size[1] - 3 || k > grid.size[2] - 3;
        float& value = sampled.values[grid.index(i, j, k)];
        if (border) value = std::max(value, static_cast<float>(spacing_mm));
      }
    }
  }
  return surface_of(sampled);
}

Result<void> write_ply(const std::filesystem::path& path, const Mesh& mesh) {
  std::ofstream out(path, std::ios::binary);
  out << "ply\nformat binary_little_endian 1.0\ncomment patient LPS, mm\nelement vertex " << mesh.vertices.size()
      << "\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float "
         "nz\nelement face "
      << mesh.triangles.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    out.write(reinterpret_cast<const char*>(mesh.vertices[i].data()), 12);
    out.write(reinterpret_cast<const char*>(mesh.normals[i].data()), 12);
  }
  for (const auto& triangle : mesh.triangles) {
    out.put(3);
    out.write(reinterpret_cast<const char*>(triangle.data()), 12);
  }
  out.close();
  if (!out) return Error{Errc::unreadable, fmt::format("{}: cannot be written; is the disk full?", path.string())};
  return {};
}

Result<Mesh> read_ply(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in)
    return Error{Errc::not_found,
                 fmt::format("{}: no such surface; make it with `birdseye-sim phantom`", path.string())};
  std::size_t vertices = 0;
  std::size_t faces = 0;
  std::string line;
  while (std::getline(in, line) && line != "end_header") {
    std::istringstream words(line);
    std::string element, name;
    std::size_t count = 0;
    if (words >> element >> name >> count && element == "element") (name == "vertex" ? vertices : faces) = count;
  }
  constexpr std::size_t kMost = 50'000'000;
  Mesh mesh;
  if (vertices > 0 && vertices < kMost && faces < kMost) {
    mesh.vertices.resize(vertices);
    mesh.normals.resize(vertices);
    for (std::size_t i = 0; i < vertices && in; ++i) {
      in.read(reinterpret_cast<char*>(mesh.vertices[i].data()), 12);
      in.read(reinterpret_cast<char*>(mesh.normals[i].data()), 12);
    }
    mesh.triangles.resize(faces);
    for (auto& triangle : mesh.triangles) {
      in.get();
      in.read(reinterpret_cast<char*>(triangle.data()), 12);
      for (const std::uint32_t v : triangle) {
        if (v >= vertices) in.setstate(std::ios::failbit);
      }
      if (!in) break;
    }
  }
  if (!in || mesh.vertices.empty()) {
    return Error{Errc::bad_format,
                 fmt::format("{}: is not a surface that birdseye-sim wrote; make it again", path.string())};
  }
  return mesh;
}

}  // namespace birdseye::hw_sim
