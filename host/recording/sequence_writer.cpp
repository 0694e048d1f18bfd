#include "host/recording/sequence_writer.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>

#include "drivers/system/durable.hpp"
#include "host/files/sequence_header.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

Error cannot(const fs::path& path, int fault) {
  if (fault == ENOSPC || fault == EDQUOT || fault == EFBIG)
    return {Errc::io,
            fmt::format("{}: the disk has no room for more; free some, or choose another --out", path.string())};
  return {Errc::unreadable, fmt::format("{}: cannot be written: {}", path.string(), std::strerror(fault))};
}

}  // namespace

Result<OutputFile> OutputFile::create(const fs::path& path) {
  UniqueFd fd(::open(path.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  if (!fd) return cannot(path, errno);
  return OutputFile(std::move(fd), path);
}

Result<void> OutputFile::put(std::uint64_t at, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t put = ::pwrite(fd_.get(), bytes.data(), bytes.size(), static_cast<off_t>(at));
    if (put > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(put));
      at += static_cast<std::uint64_t>(put);
    } else if (put == 0 || errno != EINTR) {
      return cannot(path_, put == 0 ? ENOSPC : errno);
    }
  }
  return {};
}

Result<void> OutputFile::put(std::uint64_t at, const std::string& text) {
  return put(at, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

void OutputFile::cut(std::uint64_t bytes) {
  (void)!::ftruncate(fd_.get(), static_cast<off_t>(bytes));
}

Result<void> OutputFile::append(const fs::path& other, std::uint64_t at) {
  const UniqueFd from(::open(other.c_str(), O_RDONLY | O_CLOEXEC));
  if (!from) return cannot(other, errno);
  std::vector<std::uint8_t> chunk(std::size_t{4} << 20U);
  for (;;) {
    const ssize_t got = ::read(from.get(), chunk.data(), chunk.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return cannot(other, errno);
    if (got == 0) return {};
    if (auto done = put(at, std::span(chunk).first(static_cast<std::size_t>(got))); !done) return done;
    at += static_cast<std::uint64_t>(got);
  }
}

Result<void> OutputFile::sync() {
  if (::fsync(fd_.get()) != 0) return cannot(path_, errno);
  return {};
}

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
  text += count_text();
  text += "\nKinds = domain domain list\n";
  text += pictures ? "ElementNumberOfChannels = 3\nElementType = MET_UCHAR\n" : "ElementType = MET_OTHER\n";
  text += "ElementSpacing = 1 1 1\nOffset = 0 0 0\nTransformMatrix = 1 0 0 0 1 0 0 0 1\n";
  text += pictures ? "UltrasoundImageOrientation = MFA\nUltrasoundImageType = RGB_COLOR\n"
                   : "UltrasoundImageOrientation = XX\nUltrasoundImageType = XX\n";
  end_at_ = text.size();
  return header_.put(0, text + end_text());
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
    return put;
  }
  end_at_ += text.size();
  ++frames_;
  return header_.put(count_at_, count_text());
}

Result<void> SequenceWriter::sync() {
  for (OutputFile& file : pixels_) {
    if (auto synced = file.sync(); !synced) return synced;
  }
  return header_.sync();
}

Result<void> SequenceWriter::join() {
  if (pixels_.empty()) return {};
  fs::path whole = path_;
  whole.replace_extension(".mha");
  const fs::path part = whole.string() + ".part", raw = pixels_[0].path();
  std::error_code error;
  const std::uint64_t needed = frames_ * frame_bytes() + end_at_;
  const auto space = fs::space(path_.parent_path(), error);
  const auto stays = [&](const std::string& why) {
    fs::remove(part, error);
    return Error{Errc::io, fmt::format("{} and {} stay two files: {}", path_.string(), raw.filename().string(), why)};
  };
  constexpr std::uint64_t kSpare = std::uint64_t{64} << 20U;
  if (!error && space.available < needed + kSpare)
    return stays(fmt::format("the disk has no room for both and one of {} MB", needed >> 20U));
  auto file = OutputFile::create(part);
  if (!file) return stays(file.error().what);
  auto done = file->append(path_, 0);
  const std::string end = "ElementDataFile = LOCAL\n";
  if (done) done = file->put(end_at_, end);
  file->cut(end_at_ + end.size());
  if (done) done = file->append(raw, end_at_ + end.size());
  if (done) done = replace_durably(part, whole);
  if (!done) return stays(done.error().what);
  fs::remove(path_, error);
  fs::remove(raw, error);
  path_ = whole;
  return {};
}

}  // namespace birdseye::host
