#include "host/recording/sequence_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "drivers/system/part_file.hpp"
#include "host/files/sequence_header.hpp"

namespace birdseye::host {

namespace fs = std::filesystem;

namespace {

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

}  // namespace

std::string transform_name(const std::string& bird) {
  const auto to = bird.find("To");
  const bool letters = std::ranges::all_of(bird, [](unsigned char c) { return std::isalnum(c) != 0; });
  if (letters && to != std::string::npos && to > 0 && to + 2 < bird.size() &&
      std::isupper(static_cast<unsigned char>(bird[to + 2])) != 0)
    return bird;
  std::string name;
  for (const char c : bird) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) name += c;
  }
  if (name.empty()) name = "Bird";
  name[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(name[0])));
  return name + "ToTracker";
}

std::string transform_text(const Eigen::Matrix4d& m) {
  std::string text;
  for (int i = 0; i < 16; ++i) text += fmt::format("{}{}", i > 0 ? " " : "", m(i / 4, i % 4));
  return text;
}

std::string seconds_text(std::int64_t ns) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::int64_t part = ns % kSecond;
  return fmt::format("{}{}.{:09}", ns < 0 ? "-" : "", std::abs(ns / kSecond), std::abs(part));
}

Result<SequenceWriter> SequenceWriter::create(const fs::path& folder, const std::string& name, int width_px,
                                              int height_px) {
  const bool pictures = width_px > 0;
  auto header = OutputFile::create(folder / (name + (pictures ? ".igs.mhd" : ".igs.mha")));
  if (!header) return header.error();
  std::vector<OutputFile> pixels;
  if (pictures) {
    auto file = OutputFile::create(folder / (name + ".raw"));
    if (!file) return file.error();
    pixels.push_back(*std::move(file));
  }
  SequenceWriter writer(*std::move(header), std::move(pixels), width_px, height_px);
  if (auto begun = writer.begin(); !begun) return begun.error();
  return writer;
}

Result<void> SequenceWriter::begin() {
  const bool pictures = width_px_ > 0;
  std::string text =
      "ObjectType = Image\nNDims = 3\nAnatomicalOrientation = RAI\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
      "CenterOfRotation = 0 0 0\nCompressedData = False\nDimSize = ";
  count_at_ = text.size();
  head_ = text + count_text();
  text = "\nKinds = domain domain list\n";
  text += pictures ? "ElementNumberOfChannels = 3\nElementType = MET_UCHAR\n" : "ElementType = MET_OTHER\n";
  text += "ElementSpacing = 1 1 1\nOffset = 0 0 0\nTransformMatrix = 1 0 0 0 1 0 0 0 1\n";
  text += pictures ? "UltrasoundImageOrientation = MFA\nUltrasoundImageType = RGB_COLOR\n"
                   : "UltrasoundImageOrientation = XX\nUltrasoundImageType = XX\n";
  fields_sum_.add(bytes_of(text));
  end_at_ = head_.size() + text.size();
  return header_.put(0, head_ + text + end_text());
}

std::string SequenceWriter::count_text() const {
  // As wide for any count, for it is written over.
  return fmt::format("{} {} {:<20}", width_px_, height_px_, frames_);
}

std::string SequenceWriter::end_text() const {
  return fmt::format("ElementDataFile = {}\n", pixels_.empty() ? "LOCAL" : pixels_[0].path().filename().string());
}

std::uint64_t SequenceWriter::frame_bytes() const {
  return 3 * static_cast<std::uint64_t>(width_px_) * static_cast<std::uint64_t>(height_px_);
}

Result<void> SequenceWriter::add(const Fields& fields, std::span<const std::uint8_t> rgb) {
  if (rgb.size() != frame_bytes()) {
    return Error{Errc::bad_value, fmt::format("{}: a frame of {} bytes where the sequence's have {}", path_.string(),
                                              rgb.size(), frame_bytes())};
  }
  // Pixels first: the header never tells of what is not there.
  if (!pixels_.empty()) {
    if (auto put = pixels_[0].put(frames_ * frame_bytes(), rgb); !put) {
      pixels_[0].cut(frames_ * frame_bytes());
      return put;
    }
  }
  std::string text;
  for (const auto& [key, value] : fields) text += fmt::format("Seq_Frame{:04}_{} = {}\n", frames_, key, value);
  text +=
      fmt::format("Seq_Frame{:04}_{} = {}\n", frames_, kImageStatusField, pixels_.empty() ? kStatusInvalid : kStatusOk);
  if (auto put = header_.put(end_at_, text + end_text()); !put) {
    // The header's end was there before, and so there is room for it.
    (void)header_.put(end_at_, end_text());
    header_.cut(end_at_ + end_text().size());
    if (!pixels_.empty()) pixels_[0].cut(frames_ * frame_bytes());
    return put;
  }
  end_at_ += text.size();
  ++frames_;
  fields_sum_.add(bytes_of(text));
  pixels_sum_.add(rgb);
  auto put = header_.put(count_at_, count_text());
  if (put) head_.replace(count_at_, std::string::npos, count_text());
  return put;
}

Result<void> SequenceWriter::sync() {
  for (OutputFile& file : pixels_) {
    if (auto synced = file.sync(); !synced) return synced;
  }
  return header_.sync();
}

Result<void> SequenceWriter::check() const {
  for (const OutputFile& file : pixels_) {
    if (auto same = file.check(frames_ * frame_bytes()); !same) return same;
  }
  return header_.check(end_at_ + end_text().size());
}

void SequenceWriter::end_sums() {
  if (!fields_sha256_.empty()) return;
  fields_sha256_ = fields_sum_.hex();
  pixels_sha256_ = pixels_sum_.hex();
}

/// Its count was written over with each frame, so that no sum of all of it could be kept.
Result<void> SequenceWriter::read_header(const OutputFile::Take& take) const {
  std::string head, end;
  calibration::Sha256 fields;
  std::uint64_t at = 0;
  auto read = header_.read([&](std::span<const std::uint8_t> bytes) {
    const auto until = [&](std::uint64_t place) {
      const auto some =
          bytes.first(static_cast<std::size_t>(std::min<std::uint64_t>(bytes.size(), place > at ? place - at : 0)));
      bytes = bytes.subspan(some.size());
      at += some.size();
      return some;
    };
    for (const bool of_head : {true, false}) {
      const auto some = until(of_head ? head_.size() : end_at_);
      if (some.empty()) continue;
      if (of_head) head.append(some.begin(), some.end());
      if (!of_head) fields.add(some);
      if (auto taken = take(some); !taken) return taken;
    }
    end.append(bytes.begin(), bytes.end());
    at += bytes.size();
    return at > end_at_ + end_text().size() ? Result<void>(changed_meanwhile(path_)) : Result<void>();
  });
  if (!read) return read;
  if (head != head_ || end != end_text() || fields.hex() != fields_sha256_) return changed_meanwhile(path_);
  return {};
}

Result<void> SequenceWriter::read_pixels(const OutputFile::Take& take) const {
  calibration::Sha256 sum;
  auto read = pixels_[0].read([&](std::span<const std::uint8_t> bytes) {
    sum.add(bytes);
    return take(bytes);
  });
  if (!read) return read;
  return sum.hex() == pixels_sha256_ ? Result<void>() : changed_meanwhile(pixels_[0].path());
}

Result<std::map<std::string, std::string>> SequenceWriter::sums() {
  if (!joined_sha256_.empty()) return std::map<std::string, std::string>{{path_.filename().string(), joined_sha256_}};
  end_sums();
  calibration::Sha256 header;
  const auto read = read_header([&](std::span<const std::uint8_t> bytes) {
    header.add(bytes);
    return Result<void>();
  });
  if (!read) return read.error();
  header.add(bytes_of(end_text()));
  std::map<std::string, std::string> out = {{path_.filename().string(), header.hex()}};
  if (!pixels_.empty()) out[pixels_[0].path().filename().string()] = pixels_sha256_;
  return out;
}

Result<void> SequenceWriter::join() {
  if (pixels_.empty()) return {};
  fs::path whole = path_;
  whole.replace_extension(".mha");
  const fs::path raw = pixels_[0].path();
  std::error_code error;
  const std::uint64_t needed = frames_ * frame_bytes() + end_at_;
  const auto space = fs::space(path_.parent_path(), error);
  const auto stays = [&](const std::string& why) {
    return Error{Errc::io, fmt::format("{} and {} stay two files: {}", path_.string(), raw.filename().string(), why)};
  };
  constexpr std::uint64_t kSpare = std::uint64_t{64} << 20U;
  if (!error && space.available < needed + kSpare)
    return stays(fmt::format("the disk has no room for both and one of {} MB", needed >> 20U));
  auto part = PartFile::make(whole);
  if (!part) return stays(part.error().what);
  auto file = OutputFile::create(part->path());
  if (!file) return stays(file.error().what);
  end_sums();
  calibration::Sha256 sum;
  std::uint64_t at = 0;
  const auto put = [&](std::span<const std::uint8_t> bytes) {
    auto written = file->put(at, bytes);
    at += bytes.size();
    sum.add(bytes);
    return written;
  };
  auto done = read_header(put);
  if (done) done = put(bytes_of("ElementDataFile = LOCAL\n"));
  if (done) done = read_pixels(put);
  if (done) done = part->put_durably();
  if (!done) return stays(done.error().what);
  fs::remove(path_, error);
  fs::remove(raw, error);
  path_ = whole;
  joined_sha256_ = sum.hex();
  return {};
}

}  // namespace birdseye::host
