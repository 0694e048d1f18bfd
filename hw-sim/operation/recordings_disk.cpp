#include "hw-sim/operation/recordings_disk.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <fstream>
#include <system_error>
#include <utility>

#include "drivers/system/wait.hpp"
#include "hw-sim/base/hashed.hpp"

namespace birdseye::hw_sim {

struct RecordingsDisk::Written {
  std::ofstream out;
  std::uint64_t bytes = 0, synced_bytes = 0;
  bool powerless = false;
};

namespace {

class FileOfDisk final : public device::RecordFile {
 public:
  FileOfDisk(std::shared_ptr<RecordingsDisk::Written> written, std::shared_ptr<const RecordingsDisk::State> disk)
      : written_(std::move(written)), disk_(std::move(disk)) {}
  ~FileOfDisk() override { written_->out.flush(); }
  FileOfDisk(const FileOfDisk&) = delete;
  FileOfDisk& operator=(const FileOfDisk&) = delete;

  int write(std::span<const std::uint8_t> bytes) override {
    if (written_->powerless) return 0;
    const auto taken = disk_->full ? bytes.first(bytes.size() / 2) : bytes;
    written_->out.write(reinterpret_cast<const char*>(taken.data()), static_cast<std::streamsize>(taken.size()));
    written_->bytes += taken.size();
    if (disk_->full) return ENOSPC;
    return written_->out ? 0 : EIO;
  }
  int sync() override {
    if (disk_->late.ns > 0) sleep_for(disk_->late);
    if (written_->powerless) return 0;
    written_->out.flush();
    written_->synced_bytes = written_->bytes;
    return written_->out ? 0 : EIO;
  }

 private:
  std::shared_ptr<RecordingsDisk::Written> written_;
  std::shared_ptr<const RecordingsDisk::State> disk_;
};

}  // namespace

RecordingsDisk::RecordingsDisk(std::filesystem::path folder, ThisMachine machine, std::uint64_t seed)
    : folder_(std::move(folder)), machine_(std::move(machine)), seed_(seed) {}

Result<device::NewRecordFile> RecordingsDisk::create() {
  if (state_->full) return Error{Errc::io, folder_.string() + ": no file can be begun; is the disk full?"};
  last_ = folder_ / fmt::format("{}.berec", begun_++);
  written_ = std::make_shared<Written>();
  written_->out.open(last_, std::ios::binary);
  if (!written_->out) return Error{Errc::io, last_.string() + ": cannot be written; is the disk full?"};
  return device::NewRecordFile{std::make_unique<FileOfDisk>(written_, state_), last_, machine_};
}

void RecordingsDisk::lose_power() {
  if (written_ == nullptr || std::exchange(written_->powerless, true)) return;
  written_->out.close();
  const std::uint64_t unsynced = written_->bytes - written_->synced_bytes;
  const auto left = static_cast<std::uint64_t>(hashed_uniform(seed_, 2 * begun_) * static_cast<double>(unsynced + 1));
  const bool zeros = hashed_uniform(seed_, 2 * begun_ + 1) < 0.5;
  std::error_code failed;
  std::filesystem::resize_file(last_, written_->synced_bytes + left, failed);
  if (zeros && !failed) std::filesystem::resize_file(last_, written_->bytes, failed);
}

}  // namespace birdseye::hw_sim
