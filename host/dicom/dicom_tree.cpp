#include "host/dicom/dicom_tree.hpp"

#include <algorithm>
#include <array>

#include "calibration/base/lower_case.hpp"
#include "host/dicom/refused.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostFiles = 100'000;  // of one patient's export: a tenth of that is much

/// Files that lie beside the slices of many series, and those of viewers that exports bring along.
bool is_bystander(const fs::path& path) {
  const std::string name = path.filename().string();
  constexpr std::array kExtensions{".txt", ".md",  ".json", ".xml",  ".csv", ".pdf",  ".png", ".jpg", ".jpeg",
                                   ".gif", ".bmp", ".ico",  ".html", ".htm", ".css",  ".js",  ".zip", ".exe",
                                   ".dll", ".bat", ".jar",  ".cab",  ".chm", ".inf",  ".ini", ".cfg", ".db",
                                   ".log", ".nii", ".gz",   ".mha",  ".mhd", ".nrrd", ".raw", ".stl", ".obj"};
  return name.starts_with('.') || name == "DICOMDIR" || name == "LICENSE" || name == "README" ||
         std::find(kExtensions.begin(), kExtensions.end(), lower_case(path.extension().string())) != kExtensions.end();
}

}  // namespace

Result<DicomTree> read_dicom_tree(const fs::path& folder, const Announce& announce) {
  std::vector<fs::path> paths;
  std::error_code error;
  fs::recursive_directory_iterator at(folder, fs::directory_options::skip_permission_denied, error);
  for (; !error && at != fs::recursive_directory_iterator(); at.increment(error)) {
    std::error_code ignored;
    if (!at->is_regular_file(ignored) || is_bystander(at->path())) continue;
    paths.push_back(at->path());
    if (paths.size() > kMostFiles) {
      return refused(Errc::unsupported, folder,
                     fmt::format("holds over {} files; give the folder of one patient", kMostFiles));
    }
  }
  if (error) return refused(Errc::unreadable, folder, "cannot be listed; check its permissions");
  std::sort(paths.begin(), paths.end());
  DicomTree tree;
  for (const fs::path& path : paths) {
    announce(path);
    auto file = read_dicom_file(path);
    if (!file) {
      tree.unreadable.push_back(std::move(file).error());
      tree.unreadable_paths.push_back(path);
    } else if (file->kind != DicomFile::Kind::directory) {
      tree.files.push_back(*std::move(file));
    }
  }
  return tree;
}

}  // namespace birdseye::host
