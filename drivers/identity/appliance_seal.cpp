#include "drivers/identity/appliance_seal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "calibration/base/crc64.hpp"
#include "calibration/record/sha256.hpp"
#include "calibration/record/strict_json.hpp"

namespace birdseye {

namespace {

constexpr std::string_view kMagic = "BEREC002";
constexpr std::uint32_t kSettingsBlock = 1, kSignatureBlock = 7;
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

std::span<const std::uint8_t> as_bytes(std::span<const char> bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

/// Whether the sum behind a payload is of it and its head.
bool sum_fits(std::span<const char> head, std::span<const char> payload_and_sum) {
  const auto payload = payload_and_sum.first(payload_and_sum.size() - kSumBytes);
  std::uint64_t sum = 0;
  std::memcpy(&sum, payload_and_sum.last(kSumBytes).data(), kSumBytes);
  return sum == ~crc64_ecma(as_bytes(payload), crc64_ecma(as_bytes(head), ~std::uint64_t{0}));
}

/// What birdseyed wrote of its map of the field among its settings, where no known machine had signed that.
std::string rests_on(std::span<const char> settings) {
  const auto json = calibration::strict_json<nlohmann::json>({settings.begin(), settings.end()});
  const auto field = json.is_object() ? json.find("field_unsigned") : json.end();
  if (field == json.end() || !field->is_string()) return {};
  return fmt::format("its map of the field is {}", field->get<std::string>());
}

/// Whether a signature stands at a file's end, whatever its block says of itself: damage to the kind or the size of a
/// block must not make a signed recording one that nobody signed.
bool ends_in_a_signature(std::ifstream& in) {
  constexpr std::streamoff kMostBytes = 4096;  // more than a signature has
  in.clear();
  in.seekg(0, std::ios::end);
  const std::streamoff size = in.tellg();
  std::string end(static_cast<std::size_t>(std::min(size, kMostBytes)), '\0');
  in.seekg(size - static_cast<std::streamoff>(end.size()));
  in.read(end.data(), static_cast<std::streamsize>(end.size()));
  end.resize(end.size() - std::min(end.size(), kSumBytes));
  const auto has = [&end](const char* name) { return end.find(name) != std::string::npos; };
  return end.ends_with('}') && (has("\"signature\":") || has("\"utc\":"));  // either may be damaged
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
  constexpr const char* kDamagedSignature = "is damaged in its signature; take a copy that is as it was written";
  const auto refused = [&path](const char* why) {
    return Error{Errc::bad_format, fmt::format("{}: {}", path.string(), why)};
  };
  if (!is_appliance_recording(path)) return refused("is no recording of birdseyed, or one of another version");
  std::ifstream in(path, std::ios::binary);
  in.ignore(kMagic.size());
  calibration::Sha256 sum;
  sum.add(as_bytes(kMagic));
  std::vector<char> bytes;
  std::string doubt;
  for (;;) {
    std::array<char, kHeadBytes> head_bytes{};
    in.read(head_bytes.data(), head_bytes.size());
    const Head head = head_of(head_bytes);
    const bool whole = in.gcount() == kHeadBytes;
    if (whole && head.size > kMostPayload) return refused("is damaged: a block's size makes no sense");
    bytes.resize(whole ? head.size + kSumBytes : 0);
    in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (!whole || static_cast<std::size_t>(in.gcount()) != bytes.size()) {
      if (ends_in_a_signature(in)) return refused(kDamagedSignature);
      return ApplianceSeal{sum.hex(), {}, false, doubt};
    }
    if (head.kind == kSettingsBlock) doubt = rests_on(std::span(bytes).first(head.size));
    if (head.kind != kSignatureBlock) {
      sum.add(as_bytes(head_bytes));
      sum.add(as_bytes(bytes));
      continue;
    }
    if (!sum_fits(head_bytes, bytes)) return refused(kDamagedSignature);
    ApplianceSeal out{sum.hex(), calibration::FileSignature(), in.peek() != std::char_traits<char>::eof(), doubt};
    try {
      out.signature = calibration::signature_of_json(
          nlohmann::json::parse(bytes.begin(), bytes.end() - static_cast<std::ptrdiff_t>(kSumBytes)));
    } catch (const nlohmann::json::exception&) {
      return refused(kDamagedSignature);
    }
    return out;
  }
}

}  // namespace birdseye
