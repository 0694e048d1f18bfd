#include "host/files/film.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>
#include <system_error>

#include "host/files/frame_size.hpp"

namespace birdseye::host {

namespace {

constexpr Duration kEncoderPatience = Duration::from_ms(20'000);
constexpr Duration kDecoderPatience = Duration::from_ms(20'000);

/// Twice what ffmpeg needs before it decodes anything, and twice what it needs for each pixel of a film whose pictures
/// refer to as many others as H.264 allows (32 bytes; of a film of ours 13).
constexpr std::uint64_t kDecoder_bytes = std::uint64_t{1} << 30U, kDecoderPerPixel_bytes = 64;

/// Of "P6\n16384 16384\n255\n", with room.
constexpr std::size_t kLongestHead = 32;

/// H.264 pads pictures to whole blocks, and ffmpeg rows for its vectors; it counts the pixels that it makes room for.
std::int64_t padded_pixels(std::int64_t width_px, std::int64_t height_px) {
  constexpr std::int64_t kWhole_px = 64;
  const auto padded = [](std::int64_t side_px) { return (side_px + kWhole_px - 1) / kWhole_px * kWhole_px; };
  return padded(width_px) * padded(height_px);
}

/// Of a file, whatever its name: by itself ffmpeg takes what stands before a colon for a protocol, and a leading - for
/// an option.
std::string ffmpeg_name(const std::filesystem::path& file) {
  return "file:" + file.string();
}

/// By itself ffmpeg goes by what a file holds: a list of other files and addresses, or any of 500 codecs. Two threads
/// decode faster than a film is played; with one for each processor, the memory that it needs would hang on the
/// machine. So it would with OpenBLAS, which ffmpeg loads where it is installed, and which tries for ever to get more.
/// Each picture is given as a PPM, which tells its size.
std::vector<std::string> decoder_command(const std::filesystem::path& film, std::int64_t most_px) {
  return {"env",
          "OPENBLAS_NUM_THREADS=1",
          "ffmpeg",
          "-hide_banner",
          "-loglevel",
          "error",
          "-f",
          "mov",
          "-protocol_whitelist",
          "file",
          "-codec_whitelist",
          "h264",
          "-c:v",
          "h264",
          "-max_pixels",
          std::to_string(most_px),
          "-threads",
          "2",
          "-i",
          ffmpeg_name(film),
          "-map",
          "0:v:0",
          "-vsync",
          "passthrough",
          "-f",
          "image2pipe",
          "-c:v",
          "ppm",
          "-pix_fmt",
          "rgb24",
          "-threads",
          "1",
          "-"};
}

/// "64x48", in words where the picture does not begin as a PPM.
std::string size_of_ppm(const std::string& bytes) {
  std::istringstream in(bytes);
  std::string magic;
  int width_px = 0, height_px = 0;
  if (in >> magic >> width_px >> height_px && magic == "P6") return fmt::format("{}x{}", width_px, height_px);
  return "of an unknown number of";
}

std::filesystem::path log_of(const PartFile& film) {
  return film.path().string() + ".log";
}

}  // namespace

Result<Film> Film::open(const std::filesystem::path& path, int width_px, int height_px, double rate_hz) {
  Result<PartFile> part = PartFile::make(path);
  if (!part) return std::move(part).error();
  // yuv420p and an even size are what browsers play; faststart lets them start before the whole file is read.
  Result<ChildProcess> encoder =
      ChildProcess::start({"ffmpeg",
                           "-hide_banner",
                           "-loglevel",
                           "error",
                           "-y",
                           "-f",
                           "rawvideo",
                           "-pix_fmt",
                           "rgb24",
                           "-s",
                           fmt::format("{}x{}", width_px, height_px),
                           "-r",
                           fmt::format("{}", rate_hz),
                           "-i",
                           "-",
                           "-vf",
                           "crop=trunc(iw/2)*2:trunc(ih/2)*2",
                           "-c:v",
                           "libx264",
                           "-preset",
                           "veryfast",
                           "-crf",
                           "22",
                           "-pix_fmt",
                           "yuv420p",
                           "-movflags",
                           "+faststart",
                           "-f",
                           "mp4",
                           ffmpeg_name(part->path())},
                          log_of(*part), ChildProcess::Pipe::stdin_to_child, ChildProcess::Signals::ours_alone);
  if (!encoder) return std::move(encoder).error();
  return Film(std::move(*part), std::move(*encoder),
              static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) * 3);
}

Result<void> Film::add(std::span<const std::uint8_t> rgb) {
  if (rgb.size() != frame_bytes_) {
    return Error{Errc::bad_value, fmt::format("{}: a frame of {} bytes where the film's are {}", part_.place().string(),
                                              rgb.size(), frame_bytes_)};
  }
  auto taken = encoder_.write(rgb.data(), rgb.size(), Deadline::after(kEncoderPatience));
  if (taken || taken.error().code != Errc::disconnected) return taken;
  (void)encoder_.wait(Deadline::after(kEncoderPatience));  // then it has said why
  return unfinished();
}

Error Film::unfinished() const {
  std::ifstream log(log_of(part_));
  std::string why;
  std::getline(log, why);
  return {Errc::io, fmt::format("{}: ffmpeg did not finish it ({}); check whether the disk is full",
                                part_.place().string(), why.empty() ? "it does not say why" : why)};
}

Result<void> Film::finish() {
  encoder_.close_pipe();
  const std::optional<int> code = encoder_.wait(Deadline::after(kEncoderPatience));
  if (code != 0) return unfinished();
  return part_.put_durably();
}

Result<FilmReader> FilmReader::open(const std::filesystem::path& path, int width_px, int height_px) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored))
    return Error{Errc::not_found, fmt::format("{}: no such film", path.string())};
  if (!is_frame_size(width_px, height_px)) {
    return Error{Errc::bad_value, fmt::format("{}: frames of {}x{} px are told of, which no camera has; take a copy of "
                                              "the recording that is as it was written",
                                              path.string(), width_px, height_px)};
  }
  const std::int64_t padded_px = padded_pixels(width_px, height_px);
  Result<ChildProcess> decoder = ChildProcess::start(decoder_command(path, std::max(padded_px, kMostFramePixels)),
                                                     "/dev/null", ChildProcess::Pipe::stdout_from_child);
  if (!decoder) return std::move(decoder).error();
  // Before it opens the film it loads some 200 libraries.
  decoder->bound_memory(kDecoder_bytes + kDecoderPerPixel_bytes * static_cast<std::uint64_t>(padded_px));
  return FilmReader(std::move(*decoder), path, width_px, height_px);
}

FilmReader::~FilmReader() {
  // It waits for somebody to take what it has decoded, and would not end before that.
  decoder_.close_pipe();
}

Result<bool> FilmReader::take_head() {
  const std::string expected = fmt::format("P6\n{} {}\n255\n", width_px_, height_px_);
  std::string head(expected.size(), '\0');
  const Deadline deadline = Deadline::after(kDecoderPatience);
  const auto got = decoder_.read(head.data(), head.size(), deadline);
  if (!got) return got.error().with_context(path_.string());
  if (*got < head.size() && next_ == 0) {
    constexpr int kNotThere = 127;  // env's exit code where it finds no such program
    if (decoder_.wait(deadline) == kNotThere)
      return Error{Errc::not_found, "ffmpeg: cannot be started; is it installed?"};
    return Error{Errc::unreadable, fmt::format("{}: ffmpeg finds no picture in it: it is no H.264 film in an MP4 file, "
                                               "or damaged at its beginning; take a copy of the recording that is as "
                                               "it was written",
                                               path_.string())};
  }
  if (*got < head.size()) return false;
  if (head == expected) return true;
  // The head of a larger picture is longer.
  std::string rest(kLongestHead, '\0');
  const auto more = decoder_.read(rest.data(), rest.size(), deadline);
  if (!more) return more.error().with_context(path_.string());
  return Error{Errc::bad_value, fmt::format("{}: its pictures are {} px where frames of {}x{} px are told of; take a "
                                            "copy of the recording that is as it was written",
                                            path_.string(), size_of_ppm(head + rest), width_px_, height_px_)};
}

Result<std::vector<std::uint8_t>> FilmReader::read(std::size_t index) {
  std::vector<std::uint8_t> rgb(3 * static_cast<std::size_t>(width_px_) * static_cast<std::size_t>(height_px_));
  for (; next_ <= index; ++next_) {
    const auto begun = take_head();
    if (!begun) return begun.error();
    const auto got = *begun ? decoder_.read(rgb.data(), rgb.size(), Deadline::after(kDecoderPatience)) : std::size_t{0};
    if (!got) return got.error().with_context(path_.string());
    if (*got < rgb.size()) {
      return Error{Errc::bad_format,
                   fmt::format("{}: has no frame {}: {} frames are whole", path_.string(), index, next_)};
    }
    if (next_ == index) {
      ++next_;
      return rgb;
    }
  }
  return Error{Errc::bad_value, fmt::format("{}: frame {} has been read already", path_.string(), index)};
}

}  // namespace birdseye::host
