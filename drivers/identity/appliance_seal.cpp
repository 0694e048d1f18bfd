#include "drivers/identity/appliance_seal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>
#include <vector>

#include "calibration/record/sha256.hpp"

namespace birdseye {

namespace {

constexpr std::string_view kMagic = "BEREC002";
constexpr std::uint32_t kSignatureBlock = 7;
constexpr std::size_t kHeadBytes = 12, kSumBytes = 8;  // kind and size before a payload, its sum behind it
constexpr std::uint64_t kMostPayload = 64U << 20U;

struct Head {
  std::uint32_t kind = 0;
  std::uint64_t size = 0;
};

/// Both little endian, as the machines are that birdseyed runs on.
Head head_of(const std::array<char, kHeadBytes>& bytes) {
  Head head;
  std::memcpy(&head.kind, bytes.data(), sizeof head.kind);
  std::memcpy(&head.size, bytes.data() + sizeof head.kind, sizeof head.size);
  return head;
}

void add(calibration::Sha256& sum, const char* bytes, std::size_t size) {
  sum.add({reinterpret_cast<const std::uint8_t*>(bytes), size});
}

}  // namespace

bool is_appliance_recording(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return false;
  std::ifstream in(path, std::ios::binary);
  std::array<char, kMagic.size()> magic{};
  in.read(magic.data(), magic.size());
  return std::string_view(magic.data(), magic.size()) == kMagic;
}

Result<ApplianceSeal> read_appliance_seal(const std::filesystem::path& path) {
  const auto refused = [&path](const char* why) {
    return Error{Errc::bad_format, fmt::format("{}: {}", path.string(), why)};
  };
  if (!is_appliance_recording(path)) return refused("is no recording of birdseyed, or one of another version");
  std::ifstream in(path, std::ios::binary);
  in.ignore(kMagic.size());
  calibration::Sha256 sum;
  add(sum, kMagic.data(), kMagic.size());
  std::vector<char> bytes;
  for (;;) {
    std::array<char, kHeadBytes> head_bytes{};
    in.read(head_bytes.data(), head_bytes.size());
    const Head head = head_of(head_bytes);
    const bool whole = in.gcount() == kHeadBytes;
    if (whole && head.size > kMostPayload) return refused("is damaged: a block's size makes no sense");
    bytes.resize(whole ? head.size + kSumBytes : 0);
    in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (!whole || static_cast<std::size_t>(in.gcount()) != bytes.size()) return ApplianceSeal{sum.hex(), {}};
    if (head.kind != kSignatureBlock) {
      add(sum, head_bytes.data(), head_bytes.size());
      add(sum, bytes.data(), bytes.size());
      continue;
    }
    ApplianceSeal out{sum.hex(), calibration::FileSignature(), in.peek() != std::char_traits<char>::eof()};
    try {
      out.signature = calibration::signature_of_json(
          nlohmann::json::parse(bytes.begin(), bytes.end() - static_cast<std::ptrdiff_t>(kSumBytes)));
    } catch (const nlohmann::json::exception&) {
      return refused("is damaged in its signature");
    }
    return out;
  }
}

}  // namespace birdseye
