#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>

#include "tests/support/scratch.hpp"

/// What the fuzz targets share. Each is one file with LLVMFuzzerTestOneInput: it gives bytes to one parser, and holds
/// what the parser believed against what it promises.
namespace birdseye::testing {

using ByteView = std::span<const std::uint8_t>;

/// Ends the program where a law does not hold: the fuzzer then keeps the input.
inline void must(bool holds, const char* law) {
  if (holds) return;
  std::fprintf(stderr, "does not hold: %s\n", law);
  std::abort();
}

/// An error names the file that it is of.
inline void must_name(const std::string& what, const std::string& file) {
  must(what.find(file) != std::string::npos, "an error names the file");
}

inline std::string as_text(ByteView bytes) {
  return {bytes.begin(), bytes.end()};
}

/// The input as a file of that name; files of other names stay beside it.
inline std::string as_file(const std::string& name, const std::string& text) {
  static const Scratch folder;
  return folder.file(name, text);
}

/// The parts of a text that form feeds are between; what is missing is empty.
template <std::size_t N>
std::array<std::string, N> parts_of(const std::string& text) {
  std::array<std::string, N> parts;
  std::size_t part = 0;
  for (const char c : text) {
    if (c == '\f' && part + 1 < N) {
      ++part;
    } else {
      parts[part] += c;
    }
  }
  return parts;
}

/// Takes the input apart from its front.
class Pieces {
 public:
  explicit Pieces(ByteView input) : rest_(input) {}

  /// 0 where nothing is left.
  std::uint8_t byte() {
    const ByteView piece = take(1);
    return piece.empty() ? std::uint8_t{0} : piece.front();
  }
  /// So many bytes, or as many as are left.
  ByteView take(std::size_t most) {
    const ByteView piece = rest_.first(std::min(most, rest_.size()));
    rest_ = rest_.subspan(piece.size());
    return piece;
  }
  [[nodiscard]] bool empty() const { return rest_.empty(); }

 private:
  ByteView rest_;
};

}  // namespace birdseye::testing
