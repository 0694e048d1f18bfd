#pragma once

#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "host/confine/run_confined.hpp"

namespace birdseye::host {

/// A Result as bytes, for run_confined: a mark, then the value, or the error's code and words.
template <auto kWork>
std::string result_as_bytes(std::string_view input) {
  const auto result = kWork(input);
  if (!result) {
    const auto code = static_cast<char>(result.error().code);
    return std::string("e").append(1, code).append(result.error().what);
  }
  std::string out(1 + sizeof *result, 'v');
  std::memcpy(out.data() + 1, &*result, sizeof *result);
  return out;
}

/// What kWork(std::string_view) makes of the input, in a confined process (run_confined): a Result of a value without
/// pointers, which is not to be trusted: each of its bits may be any. Errors: its own, and run_confined's.
template <auto kWork>
auto result_of_confined(std::string_view input) -> decltype(kWork(input)) {
  using Value = std::remove_cvref_t<decltype(*kWork(input))>;
  static_assert(std::is_trivially_copyable_v<Value>);
  constexpr std::size_t kMostBytes = sizeof(Value) + (1U << 16U);
  const auto came = run_confined(result_as_bytes<kWork>, input, kMostBytes);
  if (!came) return came.error();
  if (came->size() >= 2 && came->front() == 'e' && (*came)[1] >= 0 && (*came)[1] <= static_cast<char>(Errc::io))
    return Error{static_cast<Errc>((*came)[1]), came->substr(2)};
  if (came->size() != 1 + sizeof(Value) || came->front() != 'v')
    return Error{Errc::bad_format, "its decoder gave something else"};
  Value value;
  std::memcpy(&value, came->data() + 1, sizeof value);
  return value;
}

}  // namespace birdseye::host
