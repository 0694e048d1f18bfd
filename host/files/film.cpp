#include "host/files/film.hpp"

#include <fmt/format.h>

#include <system_error>

#include "drivers/system/durable.hpp"

namespace birdseye::host {

namespace {
constexpr Duration kEncoderPatience = Duration::from_ms(20'000);
}

Result<Film> Film::open(const std::filesystem::path& path, int width_px, int height_px, double rate_hz) {
  std::filesystem::path temporary = path;
  temporary.replace_extension(".part.mp4");
  std::filesystem::path log = path;
  log.replace_extension(".ffmpeg.log");
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
                           temporary.string()},
                          log, ChildProcess::Pipe::stdin_to_child, ChildProcess::Signals::ours_alone);
  if (!encoder) return std::move(encoder).error();
  return Film(std::move(*encoder), path, temporary,
              static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) * 3);
}

Result<void> Film::add(std::span<const std::uint8_t> rgb) {
  if (rgb.size() != frame_bytes_) {
    return Error{Errc::bad_value, fmt::format("{}: a frame of {} bytes where the film's are {}", path_.string(),
                                              rgb.size(), frame_bytes_)};
  }
  return encoder_.write(rgb.data(), rgb.size(), Deadline::after(kEncoderPatience));
}

Result<void> Film::finish() {
  encoder_.close_input();
  const std::optional<int> code = encoder_.wait(Deadline::after(kEncoderPatience));
  std::filesystem::path log = path_;
  log.replace_extension(".ffmpeg.log");
  if (code != 0) {
    return Error{Errc::io, fmt::format("{}: ffmpeg did not finish it; see {}", path_.string(), log.string())};
  }
  if (auto replaced = replace_durably(temporary_, path_); !replaced) return replaced;
  std::error_code ignored;
  std::filesystem::remove(log, ignored);
  return {};
}

Result<FilmReader> FilmReader::open(const std::filesystem::path& path, int width_px, int height_px) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored))
    return Error{Errc::not_found, fmt::format("{}: no such film", path.string())};
  Result<ChildProcess> decoder =
      ChildProcess::start({"ffmpeg", "-hide_banner", "-loglevel", "error", "-i", path.string(), "-vsync", "passthrough",
                           "-f", "rawvideo", "-pix_fmt", "rgb24", "-"},
                          "/dev/null", ChildProcess::Pipe::stdout_from_child);
  if (!decoder) return std::move(decoder).error();
  return FilmReader(std::move(*decoder), path,
                    static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) * 3);
}

Result<std::vector<std::uint8_t>> FilmReader::read(std::size_t index) {
  std::vector<std::uint8_t> rgb(frame_bytes_);
  for (; next_ <= index; ++next_) {
    const auto got = decoder_.read(rgb.data(), rgb.size(), Deadline::after(kEncoderPatience));
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
