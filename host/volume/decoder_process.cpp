#include "host/volume/decoder_process.hpp"

#include <fmt/format.h>

#include <fstream>
#include <new>
#include <optional>
#include <string>

#include "host/confine/confinement.hpp"
#include "host/dicom/refused.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

/// What the copy of this process sends: the file it is about to read, how it failed, or that the outcome follows.
enum class MessageKind : std::uint8_t { reading = 'r', error = 'e', decoded = 'd' };

/// Without a word of the decoder, which names each file before it reads it: a slow disk's large series takes longer in
/// all.
constexpr Duration kLongestSilence = Duration::from_ms(300'000);

void send_text(const Send& send, MessageKind kind, std::int32_t code, const std::string& text) {
  const auto length = static_cast<std::uint32_t>(text.size());
  send(&kind, sizeof kind);
  send(&code, sizeof code);
  send(&length, sizeof length);
  send(text.data(), text.size());
}

std::optional<Error> receive_text(const Receive& receive) {
  constexpr std::uint32_t kLongestText = 1 << 16;
  std::int32_t code = 0;
  std::uint32_t length = 0;
  if (!receive(&code, sizeof code) || !receive(&length, sizeof length) || length > kLongestText) return std::nullopt;
  Error told{static_cast<Errc>(code), std::string(length, ' ')};
  if (!receive(told.what.data(), length)) return std::nullopt;
  return told;
}

}  // namespace

Error not_decoded(const fs::path& file, const std::optional<Error>& how) {
  if (how && how->code == Errc::timeout) {
    return refused(Errc::timeout, file,
                   fmt::format("its decoder {} after {:.0f} s on one file; copy it again, to a disk of this machine",
                               how->what, kLongestSilence.seconds()));
  }
  if (how && how->code == Errc::unsupported)
    return refused(Errc::unsupported, file, fmt::format("its decoder {}; save it uncompressed", how->what));
  return refused(Errc::bad_format, file,
                 fmt::format("is cut short, damaged, or too large to decode{}; copy it again, or save it uncompressed",
                             how ? fmt::format(" (its decoder {})", how->what) : ""));
}

Result<void> run_decoder(const fs::path& path, const ConfinedCopies& copies, const Decode& decode,
                         const std::function<bool(const Receive&)>& take, const std::stop_token& stop) {
  const auto work = [&](const Send& send, std::vector<ProcessCopy>& made) {
    const Announce announce = [&send](const fs::path& file) {
      send_text(send, MessageKind::reading, 0, file.string());
      allow_time_for(file);
    };
    const auto decoded = decode(announce, made);
    if (!decoded) {
      send_text(send, MessageKind::error, static_cast<std::int32_t>(decoded.error().code), decoded.error().what);
      return;
    }
    allow_time_for(path);
    const MessageKind kind = MessageKind::decoded;
    send(&kind, sizeof kind);
    (*decoded)(send);
  };
  fs::path reading = path;
  std::optional<Error> failed;
  bool came = false;
  const auto receive_all = [&](const Receive& receive) {
    MessageKind kind{};
    while (!failed && receive(&kind, sizeof kind)) {
      if (kind == MessageKind::decoded) {
        came = take(receive);
        return;
      }
      auto told = receive_text(receive);
      if (!told) return;
      if (kind == MessageKind::error) {
        failed = *std::move(told);
      } else {
        reading = told->what;
      }
    }
  };
  try {
    const auto ran = run_confined_to(path, copies, work, receive_all, kLongestSilence, stop);
    if (stop.stop_requested()) return refused(Errc::disconnected, path, "was not read: cancelled");
    if (failed) return *failed;
    if (came) return {};
    if (!ran && ran.error().code == Errc::io) return refused(Errc::io, path, ran.error().what);
    return not_decoded(reading, ran ? std::nullopt : std::optional(ran.error()));
  } catch (const std::bad_alloc&) {
    return refused(Errc::io, path, "needs more memory than there is; close other programs, or resample it");
  }
}

Result<void> check_can_be_opened(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error)) return refused(Errc::not_found, path, "no such file or folder");
  if (fs::is_directory(path, error)) return {};
  if (!fs::is_regular_file(path, error))
    return refused(Errc::unsupported, path, "is neither a file nor a folder; save it as a file first");
  if (!std::ifstream(path)) return refused(Errc::unreadable, path, "cannot be opened; check its permissions");
  return {};
}

void send_long_text(const Send& send, const std::string& text) {
  const std::uint64_t length = text.size();
  send(&length, sizeof length);
  send(text.data(), text.size());
}

std::optional<std::string> receive_long_text(const Receive& receive) {
  constexpr std::uint64_t kLongestText = 1 << 28;
  std::uint64_t length = 0;
  if (!receive(&length, sizeof length) || length > kLongestText) return std::nullopt;
  const auto text = receive_values<char>(receive, length);
  if (!text) return std::nullopt;
  return std::string(text->begin(), text->end());
}

}  // namespace birdseye::host
