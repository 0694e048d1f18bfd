#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <variant>

namespace birdseye {

/// What can go wrong with the world outside the program. A bug of the program is an assert, not a code.
enum class Errc {
  not_found,     ///< a file, folder or device that is not there
  unreadable,    ///< it is there and cannot be read or written
  bad_format,    ///< read, and not what it should be
  bad_value,     ///< well-formed, and outside what is allowed
  unsupported,   ///< well-formed and legal, and we refuse it on purpose
  degenerate,    ///< the measurements do not determine the answer
  timeout,       ///< a deadline passed
  disconnected,  ///< the other side went away
  in_use,        ///< a port, device or file held by someone else
  io,            ///< any other failure of the operating system
};

/// What went wrong: `what` names the thing and the remedy in one line.
struct Error {
  Errc code = Errc::io;
  std::string what;

  /// The same, of `thing` (a file, a part): "thing: what".
  [[nodiscard]] Error with_context(std::string_view thing) const {
    return {code, std::string(thing).append(": ").append(what)};
  }
};

/// A value or the Error that prevented it. Member names are those of std::expected (C++23), which g++ 12 and clang 14
/// do not both have (docs/decisions/0001-result.md).
template <typename T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}      // NOLINT: implicit by design
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT: implicit by design

  [[nodiscard]] bool has_value() const { return state_.index() == 0; }
  explicit operator bool() const { return has_value(); }

  T& value() & { return std::get<0>(state_); }
  const T& value() const& { return std::get<0>(state_); }
  T&& value() && { return std::get<0>(std::move(state_)); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

  const Error& error() const& { return std::get<1>(state_); }
  Error&& error() && { return std::get<1>(std::move(state_)); }

  /// The value, or the error of `thing`: Error::with_context.
  [[nodiscard]] Result with_context(std::string_view thing) && {
    if (has_value()) return std::move(*this);
    return error().with_context(thing);
  }

 private:
  std::variant<T, Error> state_;
};

template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)), ok_(false) {}  // NOLINT: implicit by design

  [[nodiscard]] bool has_value() const { return ok_; }
  explicit operator bool() const { return ok_; }
  const Error& error() const { return error_; }

  [[nodiscard]] Result with_context(std::string_view thing) const {
    if (has_value()) return {};
    return error_.with_context(thing);
  }

 private:
  Error error_;
  bool ok_ = true;
};

}  // namespace birdseye
