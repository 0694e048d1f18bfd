#include "hw-sim/operation/recordings_disk.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <fstream>
#include <system_error>
#include <utility>

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
  explicit FileOfDisk(std::shared_ptr<RecordingsDisk::Written> written) : written_(std::move(written)) {}
  ~FileOfDisk() override { written_->out.flush(); }
  FileOfDisk(const FileOfDisk&) = delete;
  FileOfDisk& operator=(const FileOfDisk&) = delete;

  int write(std::span<const std::uint8_t> bytes) override {
    if (written_->powerless) return 0;
    written_->out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    written_->bytes += bytes.size();
    return written_->out ? 0 : EIO;
  }
  int sync() override {
    if (written_->powerless) return 0;
    written_->out.flush();
    written_->synced_bytes = written_->bytes;
    return written_->out ? 0 : EIO;
  }

 private:
  std::shared_ptr<RecordingsDisk::Written> written_;
};

}  // namespace

RecordingsDisk::RecordingsDisk(std::filesystem::path folder, ThisMachine machine, std::uint64_t seed)
    : folder_(std::move(folder)), machine_(std::move(machine)), seed_(seed) {}

Result<device::NewRecordFile> RecordingsDisk::create() {
  last_ = folder_ / fmt::format("{}.berec", begun_++);
  written_ = std::make_shared<Written>();
  written_->out.open(last_, std::ios::binary);
  if (!written_->out) return Error{Errc::io, last_.string() + ": cannot be written; is the disk full?"};
  return device::NewRecordFile{std::make_unique<FileOfDisk>(written_), last_, machine_};
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
