#include "hw-sim/local/local_disk.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iterator>
#include <set>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"
#include "hw-sim/base/hashed.hpp"

namespace birdseye::hw_sim {

namespace {

namespace fs = std::filesystem;

std::string text_in(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// As the file system knows it, under whatever name.
std::uint64_t number_of(const fs::path& file) {
  struct stat status {};
  return ::lstat(file.c_str(), &status) == 0 ? static_cast<std::uint64_t>(status.st_ino) : 0;
}

}  // namespace

LocalDisk::LocalDisk(const fs::path& root, std::uint64_t seed) : seed_(seed) {
  std::error_code ignored;
  root_ = fs::weakly_canonical(root, ignored);
  held_ = root_.string() + ".held";
  fs::create_directories(held_, ignored);
  note_all();
}

LocalDisk::~LocalDisk() {
  std::error_code ignored;
  fs::remove_all(held_, ignored);
}

double LocalDisk::drawn() {
  return hashed_uniform(seed_, key_++);
}

fs::path LocalDisk::held(std::uint64_t number) const {
  return held_ / std::to_string(number);
}

std::uint64_t LocalDisk::hold(const fs::path& file) {
  const std::uint64_t number = number_of(file);
  std::error_code there;
  fs::create_hard_link(file, held(number), there);
  if (there && there != std::errc::file_exists) throw std::runtime_error(file.string() + ": cannot have a second name");
  return number;
}

LocalDisk::Names LocalDisk::names_in(const fs::path& folder) {
  Names names;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const bool is_folder = entry.is_directory(ignored);
    names.emplace(entry.path().filename().string(), Node{is_folder, is_folder ? 0 : hold(entry.path())});
  }
  return names;
}

/// A machine that loses its power waits for no disk.
void LocalDisk::wait_for_disk() const {
  constexpr Duration kLook = Duration::from_ms(10);
  const Deadline until = Deadline::after(late_);
  while (!left_ && !until.passed()) sleep_for(std::min(kLook, until.left()));
}

/// That a file, or the names in a folder, are on the disk.
void LocalDisk::note(const fs::path& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) {
    synced_names_[path] = names_in(path);
    forget_removed();
  } else {
    synced_text_[hold(path)] = text_in(path);
  }
}

/// What no name leads to any more, neither one that was synced nor one that is there now, is nobody's.
void LocalDisk::forget_removed() {
  std::set<std::uint64_t> named;
  for (const auto& [folder, names] : synced_names_)
    for (const auto& [name, node] : names) named.insert(node.number);
  std::error_code ignored;
  for (const auto& entry : fs::recursive_directory_iterator(root_, ignored)) named.insert(number_of(entry.path()));
  std::erase_if(synced_text_, [&](const auto& file) {
    if (named.contains(file.first)) return false;
    fs::remove(held(file.first), ignored);
    return true;
  });
}

void LocalDisk::note_all() {
  std::error_code ignored;
  for (const auto& entry : fs::recursive_directory_iterator(root_, ignored)) note(entry.path());
  note(root_);
}

int LocalDisk::sync(const fs::path& path) {
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(path, error);
  const auto [rest, unused] = std::mismatch(root_.begin(), root_.end(), whole.begin(), whole.end());
  if (rest != root_.end()) return 0;
  wait_for_disk();
  if (left_) return EIO;  // the program that waits here is of a machine that has no power any more
  if (full_) {
    ++failed_;
    return ENOSPC;
  }
  if (!fs::exists(whole, error)) return ENOENT;
  note(whole);
  if (goes_after_ && *goes_after_ > 0 && --*goes_after_ == 0) lose_power();
  return 0;
}

void LocalDisk::lose_power_after(std::uint64_t syncs) {
  goes_after_ = syncs;
  if (syncs == 0) lose_power();
}

void LocalDisk::lose_power() {
  goes_after_.reset();
  if (left_) return;
  Image image;
  survive(root_, image);
  left_ = std::move(image);
}

/// Of what was written and not synced a part may be there, and where it ends zeros.
std::string LocalDisk::surviving_text(std::uint64_t number) {
  std::string now = text_in(held(number));
  const auto found = synced_text_.find(number);
  if (found != synced_text_.end() && found->second == now) return now;
  // What was appended comes after what was synced. What was written over it: all of it is the former, or a part of the
  // new is there.
  std::string synced = found == synced_text_.end() ? "" : found->second;
  const bool appended = now.starts_with(synced);
  if (!appended && drawn() < 0.5) return synced;
  const std::size_t kept = appended ? synced.size() : 0;
  const auto there = static_cast<std::size_t>(drawn() * static_cast<double>(now.size() - kept + 1));
  std::string text = now.substr(0, kept + there);
  const std::size_t longest = std::max(now.size(), synced.size());
  if (drawn() < 0.3)
    text.resize(text.size() + static_cast<std::size_t>(drawn() * static_cast<double>(longest - text.size() + 1)), '\0');
  return text;
}

void LocalDisk::survive(const fs::path& folder, Image& image) {
  const Names now = names_in(folder);
  const auto found = synced_names_.find(folder);
  const Names synced = found == synced_names_.end() ? Names{} : found->second;
  std::set<std::string> all;
  for (const Names* names : {&now, &synced})
    for (const auto& [name, node] : *names) all.insert(name);
  for (const std::string& name : all) {
    const auto as_now = now.find(name), as_synced = synced.find(name);
    const bool same = as_now != now.end() && as_synced != synced.end() && as_now->second == as_synced->second;
    const bool newer = same || drawn() < 0.5;
    const Names& of = newer ? now : synced;
    const auto node = newer ? as_now : as_synced;
    if (node == of.end()) continue;
    const fs::path path = folder / name;
    if (node->second.folder) {
      image.emplace(path, std::nullopt);
      survive(path, image);
    } else {
      image.emplace(path, surviving_text(node->second.number));
    }
  }
}

Result<void> LocalDisk::power_up() {
  lose_power();
  const Image image = *std::exchange(left_, std::nullopt);
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(root_, error)) fs::remove_all(entry.path(), error);
  fs::remove_all(held_, error);
  fs::create_directories(held_, error);
  synced_names_.clear();
  synced_text_.clear();
  for (const auto& [path, text] : image) {
    if (!text) {
      fs::create_directories(path, error);
      continue;
    }
    std::ofstream out(path, std::ios::binary);
    out << *text;
    out.flush();
    if (!out) return Error{Errc::io, fmt::format("{}: cannot be put back; is the disk full?", path.string())};
  }
  note_all();
  return {};
}

}  // namespace birdseye::hw_sim
