#include "host/volume/decode_slices.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "host/confine/confinement.hpp"
#include "host/dicom/dicom_pixels.hpp"
#include "host/volume/decoder_process.hpp"

namespace birdseye::host {

namespace {

using Hu = std::vector<std::int16_t>;

std::size_t pixels_of(const DicomSlice& slice) {
  return static_cast<std::size_t>(slice.columns) * static_cast<std::size_t>(slice.rows);
}

/// What a copy sends before each slice: 0 and its pixels follow, or the length of why it has none.
struct SliceHead {
  std::int32_t code = 0;
  std::uint32_t length = 0;
};

/// What a copy is given of a slice; its file's path follows.
struct SliceTask {
  std::int32_t frame = 0, columns = 0, rows = 0;
  double slope = 1, intercept = 0;
  std::uint32_t path_bytes = 0;
};

/// Every so many slices from the first on, for one copy: how many, then each.
std::string share_of(const std::vector<DicomFile>& files, const std::vector<DicomSlice>& slices, std::size_t first,
                     std::size_t stride) {
  std::string share;
  const auto append = [&share](const auto& value) {
    share.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  append((slices.size() - first + stride - 1) / stride);
  for (std::size_t i = first; i < slices.size(); i += stride) {
    const DicomSlice& slice = slices[i];
    const std::string path = files[slice.file].path.string();
    append(SliceTask{slice.frame, slice.columns, slice.rows, slice.slope, slice.intercept,
                     static_cast<std::uint32_t>(path.size())});
    share += path;
  }
  return share;
}

struct Task {
  std::string path;
  DicomSlice slice;
};

/// All of a share, since whoever gives it takes no pixels before it has given all. False: no more will come.
bool take_share(const ProcessCopy::Take& take, std::vector<Task>& tasks) {
  std::size_t count = 0;
  if (!take(&count, sizeof count)) return false;
  for (std::size_t i = 0; i < count; ++i) {
    SliceTask given;
    if (!take(&given, sizeof given)) return false;
    Task task;
    task.path.resize(given.path_bytes);
    if (!take(task.path.data(), task.path.size())) return false;
    task.slice.frame = given.frame;
    task.slice.columns = given.columns;
    task.slice.rows = given.rows;
    task.slice.slope = given.slope;
    task.slice.intercept = given.intercept;
    tasks.push_back(std::move(task));
  }
  return true;
}

Result<void> receive_slice(ProcessCopy& copy, Deadline deadline, std::int16_t* to, std::size_t count) {
  constexpr std::uint32_t kLongestText = 1 << 16;
  SliceHead head;
  if (auto came = copy.receive(&head, sizeof head, deadline); !came) return came;
  if (head.length == 0) return copy.receive(to, count * sizeof *to, deadline);
  Error told{static_cast<Errc>(head.code), std::string(std::min(head.length, kLongestText), ' ')};
  if (auto came = copy.receive(told.what.data(), told.what.size(), deadline); !came) return came;
  return told;
}

Result<Hu> decode_alone(const std::vector<DicomFile>& files, const std::vector<DicomSlice>& slices,
                        const Announce& announce) {
  DicomPixels pixels;
  Hu hu;
  hu.reserve(pixels_of(slices.front()) * slices.size());
  for (const DicomSlice& slice : slices) {
    announce(files[slice.file].path);
    if (auto read = pixels.append_hu(files[slice.file].path, slice, hu); !read) return read.error();
  }
  return hu;
}

}  // namespace

Result<Hu> decode_slices(const std::vector<DicomFile>& files, const std::vector<DicomSlice>& slices,
                         std::span<ProcessCopy> copies, const Announce& announce) {
  constexpr Duration kToTakeAShare = Duration::from_ms(10'000);
  const std::size_t count = std::min(copies.size(), slices.size());
  if (count < 2) return decode_alone(files, slices, announce);
  for (std::size_t c = 0; c < count; ++c) {
    const std::string share = share_of(files, slices, c, count);
    if (!copies[c].give(share.data(), share.size(), Deadline::after(kToTakeAShare)))
      return decode_alone(files, slices, announce);
  }
  // In the order of the slices: while one copy is waited for, the others decode ahead by what their pipes hold.
  constexpr Duration kLongestOfASlice = Duration::from_ms(300'000);
  const std::size_t pixels = pixels_of(slices.front());
  Hu hu(pixels * slices.size());
  for (std::size_t i = 0; i < slices.size(); ++i) {
    const auto& path = files[slices[i].file].path;
    announce(path);
    ProcessCopy& copy = copies[i % count];
    const auto came = receive_slice(copy, Deadline::after(kLongestOfASlice), hu.data() + i * pixels, pixels);
    if (!came && (came.error().code == Errc::disconnected || came.error().code == Errc::timeout))
      return not_decoded(path, how_it_ended(copy, came.error()));
    if (!came) return came.error();
  }
  return hu;
}

void send_slices(const ProcessCopy::Take& take, const ProcessCopy::Send& send) {
  for (std::vector<Task> tasks; take_share(take, tasks); tasks.clear()) {
    DicomPixels pixels;
    Hu hu;
    for (const auto& [path, slice] : tasks) {
      hu.clear();
      SliceHead head;
      allow_time_for(path);
      if (const auto read = pixels.append_hu(path, slice, hu); !read) {
        head = {static_cast<std::int32_t>(read.error().code), static_cast<std::uint32_t>(read.error().what.size())};
        send(&head, sizeof head);
        send(read.error().what.data(), read.error().what.size());
        return;
      }
      send(&head, sizeof head);
      send(hu.data(), hu.size() * sizeof hu[0]);
    }
  }
}

}  // namespace birdseye::host
