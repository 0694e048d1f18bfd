#include <fmt/format.h>
#include <itkVTKPolyDataMeshIO.h>

#include <assimp/BaseImporter.h>
#include <assimp/DefaultIOSystem.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
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

/// Opens the surface's own file alone: the material that an OBJ names is no part of a surface.
class OwnFile : public Assimp::DefaultIOSystem {
 public:
  explicit OwnFile(fs::path own) : own_(std::move(own)) {}
  using Assimp::DefaultIOSystem::Exists;
  using Assimp::DefaultIOSystem::Open;
  bool Exists(const char* file) const override { return is_own(file) && Assimp::DefaultIOSystem::Exists(file); }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    return is_own(file) ? Assimp::DefaultIOSystem::Open(file, mode) : nullptr;
  }

 private:
  bool is_own(const fs::path& file) const {
    std::error_code ignored;
    return file == own_ || fs::equivalent(file, own_, ignored);
  }

  fs::path own_;
};

/// Leaves the importer the reader of one form: of the others, some move, turn or scale what they read, and which reads
/// a file its content decides too.
void keep_reader(Assimp::Importer& importer, const std::string& extension) {
  for (std::size_t i = importer.GetImporterCount(); i-- > 0;) {
    if (extension == importer.GetImporterInfo(i)->mFileExtensions) continue;
    const std::unique_ptr<Assimp::BaseImporter> other(importer.GetImporter(i));
    importer.UnregisterLoader(other.get());
  }
}

/// A PLY, STL or OBJ; extension: which, as "ply".
Surface decode_others(const fs::path& path, const std::string& extension) {
  Assimp::Importer importer;
  keep_reader(importer, extension);
  importer.SetIOHandler(new OwnFile(path));  // and owns it from here
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

constexpr const char* kForms = "export it as PLY, STL, OBJ or VTK polygons";

/// "ply" of skin.PLY; empty where there is none.
std::string extension_of(const fs::path& path) {
  const std::string dotted = lower_case(path.extension().string());
  return dotted.empty() ? dotted : dotted.substr(1);
}

/// Of a file's first bytes, as many as the longest header of a PLY may have.
std::string head_of(const fs::path& path) {
  constexpr std::streamsize kLongestHeader = 1 << 16;
  std::ifstream file(path, std::ios::binary);
  std::string head(kLongestHeader, '\0');
  file.read(head.data(), kLongestHeader);
  head.resize(static_cast<std::size_t>(file.gcount()));
  return head;
}

/// Whether a binary STL may begin so: its header is followed by a count, the highest byte of which is no letter.
bool may_be_stl(const std::string& head) {
  constexpr std::size_t kHeadBytes = 84;
  const std::size_t word = std::min(head.find_first_not_of(" \t\r\n"), head.size());
  return lower_case(head.substr(word, 5)) == "solid" ||
         (head.size() >= kHeadBytes && static_cast<unsigned char>(head[kHeadBytes - 1]) < ' ');
}

/// What is wrong with a file that is none of the four forms, by its name or by its first bytes. Empty where nothing is.
std::string wrong_form(const std::string& extension, const std::string& head) {
  if (extension != "stl" && extension != "ply" && extension != "obj" && extension != "vtk")
    return fmt::format("is no STL, PLY, OBJ or VTK by its name; {}", kForms);
  const bool right = extension == "stl"   ? may_be_stl(head)
                     : extension == "ply" ? head.starts_with("ply\n") || head.starts_with("ply\r")
                     : extension == "vtk" ? head.starts_with("# vtk DataFile")
                                          : true;  // an OBJ may begin by anything
  if (right) return {};
  return fmt::format("is named .{} and does not begin as one does; {}", extension, kForms);
}

/// Where in a file's first bytes its triangles begin: what stands before it is for people, and of an OBJ all may be.
std::size_t end_of_remarks(const std::string& extension, const std::string& head) {
  const std::size_t line = head.find('\n');
  if (extension == "ply") return head.find("end_header");
  if (extension == "stl") return line == std::string::npos ? line : std::max(line, std::size_t{80});
  if (extension == "vtk" && line != std::string::npos) return head.find('\n', line + 1);
  return std::string::npos;
}

bool is_of_a_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_';
}

/// Whether a word names the axes of a frame, as "RAS" or "left-anterior-superior".
bool names_axes(const std::string& word) {
  const auto has_one_of = [&word](const char* letters) { return word.find_first_of(letters) != std::string::npos; };
  if (word.size() == 3) return has_one_of("rl") && has_one_of("ap") && has_one_of("si");
  return word.find("anterior") != std::string::npos || word.find("posterior") != std::string::npos;
}

/// The frame of a surface that 3D Slicer wrote, as "RAS" of the remark "SPACE=RAS", where it is not LPS. Empty where it
/// is, or where the file says none.
std::string other_space(const std::string& remarks) {
  constexpr std::string_view kSays = "SPACE=";
  for (std::size_t at = 0; (at = remarks.find(kSays, at)) != std::string::npos;) {
    const bool begins = at == 0 || !is_of_a_word(remarks[at - 1]);
    at += kSays.size();
    const auto first = remarks.begin() + static_cast<std::ptrdiff_t>(at);
    std::string space(first, std::find_if_not(first, remarks.end(), is_of_a_word));
    const std::string word = lower_case(space);
    if (begins && names_axes(word) && word != "lps" && word != "left-posterior-superior") return space;
  }
  return {};
}

}  // namespace

Result<Surface> read_surface(const fs::path& path) {
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored))
    return Error{Errc::not_found, fmt::format("{}: no such file", path.string())};
  if (!std::ifstream(path))
    return Error{Errc::unreadable, fmt::format("{}: cannot be opened; check its permissions", path.string())};
  const std::string extension = extension_of(path);
  const std::string head = head_of(path);
  if (const std::string wrong = wrong_form(extension, head); !wrong.empty())
    return Error{Errc::unsupported, fmt::format("{}: {}", path.string(), wrong)};
  if (extension == "ply" && head.find("end_header") == std::string::npos) {  // its reader would seek one for ever
    return Error{
        Errc::bad_format,
        fmt::format("{}: is cut short in its header, which has no end_header; export it again", path.string())};
  }
  if (const std::string space = other_space(head.substr(0, end_of_remarks(extension, head))); !space.empty()) {
    return Error{Errc::unsupported,
                 fmt::format("{}: says SPACE={}, and a surface is read in LPS; save it again in LPS (3D Slicer: "
                             "coordinate system LPS, in the options of Save)",
                             path.string(), space.substr(0, 40))};
  }
  constexpr Duration kLongest = Duration::from_ms(60'000);
  Surface surface;
  std::string flaw;
  const auto ran = run_confined_to(
      path, {},
      [&path, &extension](const Send& send, std::vector<ProcessCopy>&) {
        const std::string flawed = flaw_of_surface(path);
        Surface decoded;
        if (flawed.empty()) decoded = extension == "vtk" ? decode_vtk(path) : decode_others(path, extension);
        const auto put = [&send](const auto& values) {
          const std::uint64_t count = values.size();
          send(&count, sizeof count);
          send(values.data(), count * sizeof values[0]);
        };
        put(decoded.vertices_mm);
        put(decoded.triangles);
        put(flawed);
      },
      [&surface, &flaw](const Receive& receive) {
        surface.vertices_mm = taken<Eigen::Vector3f>(receive);
        surface.triangles = taken<std::array<std::uint32_t, 3>>(receive);
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
  if (ran && !flaw.empty()) return Error{Errc::bad_format, fmt::format("{}: {}", path.string(), flaw.substr(0, 255))};
  const bool sound = ran && !surface.triangles.empty() &&
                     std::all_of(surface.vertices_mm.begin(), surface.vertices_mm.end(),
                                 [](const Eigen::Vector3f& p) { return p.allFinite(); }) &&
                     std::all_of(surface.triangles.begin(), surface.triangles.end(), [&](const auto& t) {
                       return *std::max_element(t.begin(), t.end()) < surface.vertices_mm.size();
                     });
  if (!sound) {
    const std::string how = ran ? "" : fmt::format(" (its decoder {})", ran.error().what);
    return Error{Errc::bad_format,
                 fmt::format("{}: holds no triangles that can be read{}; {}", path.string(), how, kForms)};
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
