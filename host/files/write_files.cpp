#include "host/files/write_files.hpp"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>

#include "drivers/system/durable.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

fs::path part_of(const fs::path& path) {
  return path.string() + ".part";
}

Result<void> put(const fs::path& path, const std::string& text, const fs::path& named) {
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out << text;
  out.flush();
  if (out) return {};
  return Error{Errc::unreadable,
               fmt::format("{}: cannot be written; check the folder, its permissions, and whether the disk is full",
                           named.string())};
}

}  // namespace

Result<void> write_files(const std::vector<FileText>& files) {
  std::error_code ignored;
  std::vector<const FileText*> replaced;
  const auto give_up = [&](Error error) {
    for (const FileText* file : replaced) fs::remove(part_of(file->path), ignored);
    return error;
  };
  for (std::size_t i = 0; i < files.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (!files[i].path.empty() && files[i].path == files[j].path) {
        return Error{Errc::bad_value, fmt::format("{}: is named twice; give two files", files[i].path.string())};
      }
    }
  }
  for (const FileText& file : files) {
    if (file.path.empty() || fs::is_other(file.path, ignored)) continue;
    if (fs::is_directory(file.path, ignored)) {
      return give_up({Errc::unreadable, fmt::format("{}: is a folder; give a file", file.path.string())});
    }
    replaced.push_back(&file);
    if (auto written = put(part_of(file.path), file.text, file.path); !written) return give_up(written.error());
    if (auto synced = sync_file(part_of(file.path)); !synced) return give_up(synced.error());
  }
  std::set<fs::path> folders;
  for (const FileText* file : replaced) {
    std::error_code error;
    fs::rename(part_of(file->path), file->path, error);
    if (error) return give_up({Errc::unreadable, fmt::format("{}: cannot be replaced", file->path.string())});
    folders.insert(file->path.parent_path());
  }
  for (const fs::path& folder : folders) {
    if (auto synced = sync_folder(folder); !synced) return synced;
  }
  for (const FileText& file : files) {
    if (file.path.empty() || !fs::is_other(file.path, ignored)) continue;
    if (auto written = put(file.path, file.text, file.path); !written) return written;
  }
  return {};
}

Result<void> write_file(const fs::path& path, const std::string& text) {
  return write_files({{path, text}});
}

std::string text_of(const nlohmann::json& json) {
  // Names may come from files in other encodings: what is found is not lost for one of them.
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace birdseye::host
