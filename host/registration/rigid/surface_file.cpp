#include <fmt/format.h>
#include <itkVTKPolyDataMeshIO.h>

#include <assimp/DefaultIOSystem.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstring>
#include <fstream>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "calibration/base/lower_case.hpp"
#include "calibration/geometry/rigid_matrix.hpp"
#include "host/confine/run_confined_to.hpp"
#include "host/registration/rigid/surface.hpp"
#include "host/registration/rigid/surface_flaw.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

Surface decode_vtk(const fs::path& path) {
  const auto io = itk::VTKPolyDataMeshIO::New();
  io->SetFileName(path.string());
  io->ReadMeshInformation();
  // A number takes two bytes at least: what promises more than the file holds is not waited for.
  const std::uintmax_t most = fs::file_size(path) / 2;
  if (io->GetPointDimension() != 3 || 3 * io->GetNumberOfPoints() > most || io->GetCellBufferSize() > 2 * most)
    return {};
  Surface surface;
  const std::size_t points = io->GetNumberOfPoints();
  surface.vertices_mm.resize(points);
  std::vector<double> doubles;
  if (io->GetPointComponentType() == itk::IOComponentEnum::FLOAT) {
    io->ReadPoints(surface.vertices_mm.data()->data());
  } else if (io->GetPointComponentType() == itk::IOComponentEnum::DOUBLE) {
    doubles.resize(3 * points);
    io->ReadPoints(doubles.data());
    for (std::size_t i = 0; i < points; ++i)
      surface.vertices_mm[i] = Eigen::Map<const Eigen::Vector3d>(doubles.data() + 3 * i).cast<float>();
  } else {
    return {};
  }
  // Each cell: its kind, how many corners, which.
  std::vector<std::uint32_t> cells(io->GetCellBufferSize());
  io->ReadCells(cells.data());
  for (std::size_t i = 0; i + 1 < cells.size();) {
    const std::size_t corners = cells[i + 1];
    if (corners > cells.size() - i - 2) return {};
    for (std::size_t c = 2; c < corners; ++c)
      surface.triangles.push_back({cells[i + 2], cells[i + 1 + c], cells[i + 2 + c]});
    i += 2 + corners;
  }
  return surface;
}

/// Opens the surface's own file alone. Another one that is there and is asked for may hold some of its triangles,
/// unless it is a material.
class OwnFile : public Assimp::DefaultIOSystem {
 public:
  OwnFile(fs::path own, std::string* asked_for) : own_(std::move(own)), asked_for_(asked_for) {}
  using Assimp::DefaultIOSystem::Exists;
  using Assimp::DefaultIOSystem::Open;
  bool Exists(const char* file) const override { return is_own(file) && Assimp::DefaultIOSystem::Exists(file); }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    return is_own(file) ? Assimp::DefaultIOSystem::Open(file, mode) : nullptr;
  }

 private:
  bool is_own(const fs::path& file) const {
    std::error_code ignored;
    if (file == own_ || fs::equivalent(file, own_, ignored)) return true;
    if (lower_case(own_.extension().string()) != ".obj" && fs::is_regular_file(file, ignored))
      *asked_for_ = file.filename().string();
    return false;
  }

  fs::path own_;
  std::string* asked_for_;
};

/// beside: a file that holds some of it; empty: none.
Surface decode_others(const fs::path& path, std::string& beside) {
  Assimp::Importer importer;
  importer.SetIOHandler(new OwnFile(path, &beside));  // and owns it from here
  const aiScene* scene =
      importer.ReadFile(path.string(), aiProcess_Triangulate | aiProcess_JoinIdenticalVertices | aiProcess_SortByPType);
  Surface surface;
  for (unsigned m = 0; scene != nullptr && m < scene->mNumMeshes; ++m) {
    const aiMesh& mesh = *scene->mMeshes[m];
    const auto first = static_cast<std::uint32_t>(surface.vertices_mm.size());
    for (unsigned i = 0; i < mesh.mNumVertices; ++i)
      surface.vertices_mm.emplace_back(mesh.mVertices[i].x, mesh.mVertices[i].y, mesh.mVertices[i].z);
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
      const aiFace& face = mesh.mFaces[i];
      if (face.mNumIndices != 3) continue;  // points and edges
      surface.triangles.push_back({first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
    }
  }
  return surface;
}

template <typename T>
std::vector<T> taken(const Receive& receive) {
  std::uint64_t count = 0;
  if (!receive(&count, sizeof count)) return {};
  return receive_values<T>(receive, count).value_or(std::vector<T>());
}

/// Whether it is a PLY whose header has no end: its reader seeks one for ever.
bool is_endless_ply(const fs::path& path) {
  constexpr std::streamsize kLongestHeader = 1 << 16;
  std::ifstream file(path, std::ios::binary);
  std::string head(kLongestHeader, '\0');
  file.read(head.data(), kLongestHeader);
  head.resize(static_cast<std::size_t>(file.gcount()));
  return head.starts_with("ply") && head.find("end_header") == std::string::npos;
}

}  // namespace

Result<Surface> read_surface(const fs::path& path) {
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored))
    return Error{Errc::not_found, fmt::format("{}: no such file", path.string())};
  if (!std::ifstream(path))
    return Error{Errc::unreadable, fmt::format("{}: cannot be opened; check its permissions", path.string())};
  if (is_endless_ply(path))
    return Error{
        Errc::bad_format,
        fmt::format("{}: is cut short in its header, which has no end_header; export it again", path.string())};
  constexpr Duration kLongest = Duration::from_ms(60'000);
  Surface surface;
  std::string beside, flaw;
  const auto ran = run_confined_to(
      path, {},
      [&path](const Send& send, std::vector<ProcessCopy>&) {
        std::string asked_for;
        const std::string flawed = flaw_of_surface(path);
        Surface decoded;
        if (flawed.empty()) decoded = path.extension() == ".vtk" ? decode_vtk(path) : decode_others(path, asked_for);
        const auto put = [&send](const auto& values) {
          const std::uint64_t count = values.size();
          send(&count, sizeof count);
          send(values.data(), count * sizeof values[0]);
        };
        put(decoded.vertices_mm);
        put(decoded.triangles);
        put(asked_for);
        put(flawed);
      },
      [&surface, &beside, &flaw](const Receive& receive) {
        surface.vertices_mm = taken<Eigen::Vector3f>(receive);
        surface.triangles = taken<std::array<std::uint32_t, 3>>(receive);
        const auto name = taken<char>(receive);
        beside.assign(name.begin(), name.end());
        const auto words = taken<char>(receive);
        flaw.assign(words.begin(), words.end());
      },
      kLongest);
  if (!ran && ran.error().code == Errc::io) return ran.error().with_context(path.string());
  if (!ran && ran.error().code == Errc::timeout) {
    return Error{Errc::timeout,
                 fmt::format("{}: its decoder {} after {:.0f} s; export it again, with fewer triangles, to a disk of "
                             "this machine",
                             path.string(), ran.error().what, kLongest.seconds())};
  }
  if (!ran && ran.error().code == Errc::unsupported) {
    return Error{Errc::unsupported, fmt::format("{}: its decoder {}; export it again, with fewer triangles",
                                                path.string(), ran.error().what)};
  }
  if (ran && !beside.empty()) {
    return Error{Errc::unsupported, fmt::format("{}: is not whole without another file, {}; export it as one file: "
                                                "PLY, STL, OBJ or VTK polygons",
                                                path.string(), beside.substr(0, 255))};
  }
  if (ran && !flaw.empty()) return Error{Errc::bad_format, fmt::format("{}: {}", path.string(), flaw.substr(0, 255))};
  const bool sound = ran && !surface.triangles.empty() &&
                     std::all_of(surface.vertices_mm.begin(), surface.vertices_mm.end(),
                                 [](const Eigen::Vector3f& p) { return p.allFinite(); }) &&
                     std::all_of(surface.triangles.begin(), surface.triangles.end(), [&](const auto& t) {
                       return *std::max_element(t.begin(), t.end()) < surface.vertices_mm.size();
                     });
  if (!sound) {
    const std::string how = ran ? "" : fmt::format(" (its decoder {})", ran.error().what);
    return Error{Errc::bad_format, fmt::format("{}: holds no triangles that can be read{}; export it as PLY, STL, OBJ "
                                               "or VTK polygons",
                                               path.string(), how)};
  }
  const auto is_far = [](const Eigen::Vector3f& p) { return p.cwiseAbs().maxCoeff() > kFarthestMm; };
  if (const auto far = std::ranges::find_if(surface.vertices_mm, is_far); far != surface.vertices_mm.end()) {
    return Error{Errc::bad_value,
                 fmt::format("{}: a corner at {:g}, {:g}, {:g} mm is more than {:g} m from the origin; mend it, or "
                             "export it again, in mm",
                             path.string(), far->x(), far->y(), far->z(), kFarthestMm / 1000)};
  }
  return surface;
}

}  // namespace birdseye::host
