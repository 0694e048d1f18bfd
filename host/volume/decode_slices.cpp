#include "host/volume/decode_slices.hpp"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>

#include "drivers/system/process_copy.hpp"
#include "host/confine/confinement.hpp"
#include "host/dicom/dicom_pixels.hpp"
#include "host/dicom/refused.hpp"

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

/// In a copy: every so many slices from the first of its own.
void send_share(const ProcessCopy::Send& send, const std::vector<DicomFile>& files,
                const std::vector<DicomSlice>& slices, std::size_t first, std::size_t stride) {
  DicomPixels pixels;
  Hu hu;
  for (std::size_t i = first; i < slices.size(); i += stride) {
    hu.clear();
    SliceHead head;
    allow_time_for(files[slices[i].file].path);
    if (const auto read = pixels.append_hu(files[slices[i].file].path, slices[i], hu); !read) {
      head = {static_cast<std::int32_t>(read.error().code), static_cast<std::uint32_t>(read.error().what.size())};
      send(&head, sizeof head);
      send(read.error().what.data(), read.error().what.size());
      return;
    }
    send(&head, sizeof head);
    send(hu.data(), hu.size() * sizeof hu[0]);
  }
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

Result<Hu> decode_slices(const std::vector<DicomFile>& files, const std::vector<DicomSlice>& slices, int copies,
                         const Announce& announce) {
  const auto count = std::min(static_cast<std::size_t>(std::max(copies, 1)), slices.size());
  if (count < 2) return decode_alone(files, slices, announce);
  std::vector<ProcessCopy> started;
  for (std::size_t c = 0; c < count; ++c) {
    auto copy =
        ProcessCopy::start([&, c](const ProcessCopy::Send& send) { send_share(send, files, slices, c, count); });
    if (!copy) return decode_alone(files, slices, announce);
    started.push_back(*std::move(copy));
  }
  // In the order of the slices: while one copy is waited for, the others decode ahead by what their pipes hold.
  constexpr Duration kLongestOfASlice = Duration::from_ms(300'000);
  const std::size_t pixels = pixels_of(slices.front());
  Hu hu(pixels * slices.size());
  for (std::size_t i = 0; i < slices.size(); ++i) {
    const auto& path = files[slices[i].file].path;
    announce(path);
    auto came = receive_slice(started[i % count], Deadline::after(kLongestOfASlice), hu.data() + i * pixels, pixels);
    if (!came && came.error().code == Errc::disconnected) {
      return refused(
          Errc::bad_format, path,
          fmt::format("is damaged, or too large to decode (its decoder {}); copy it again", came.error().what));
    }
    if (!came) return came.error();
  }
  return hu;
}

}  // namespace birdseye::host
