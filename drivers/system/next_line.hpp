#pragma once

#include <cstddef>
#include <istream>
#include <string>

namespace birdseye {

/// What to say of a file, behind its name, whose stream next_line() left bad.
constexpr const char* kNotReadToItsEnd = "cannot be read to its end; check its disk, or give another copy";

/// The next line, as std::getline has it. False also where it has more than most_bytes: a file of gigabytes without a
/// line's end is not read into memory. Where the file cannot be read further the stream is bad.
inline bool next_line(std::istream& in, std::string& line, std::size_t most_bytes) {
  using Traits = std::istream::traits_type;
  line.clear();
  if (!in.good()) return false;
  try {
    for (auto next = in.rdbuf()->sbumpc(); !Traits::eq_int_type(next, Traits::eof()); next = in.rdbuf()->sbumpc()) {
      const char c = Traits::to_char_type(next);
      if (c == '\n') return true;
      if (line.size() == most_bytes) {
        in.setstate(std::ios::failbit);
        return false;
      }
      line += c;
    }
  } catch (const std::ios::failure&) {
    in.setstate(std::ios::badbit);
    return false;
  }
  in.setstate(line.empty() ? std::ios::eofbit | std::ios::failbit : std::ios::eofbit);
  return !line.empty();
}

}  // namespace birdseye
