#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "device/wire/client.hpp"
#include "tests/vm/machine.hpp"

namespace birdseye::vm {

/// birdseyed in the guest, and a host's end of its wire out here.
class Cart {
 public:
  /// config: the daemon's TOML but for [wire]. Comes back once poses and frames do.
  Cart(Machine& machine, const std::string& name, const std::string& config);
  ~Cart();
  Cart(const Cart&) = delete;
  Cart& operator=(const Cart&) = delete;

  /// The next event, from now on, of which `wanted` is true. Empty, and the test fails, when `patience` ends first.
  template <typename Kind, typename Wanted>
  std::optional<Kind> next(const std::string& what, Wanted&& wanted, Duration patience = Duration::from_ms(15'000)) {
    const auto deadline = Deadline::after(gone_ ? Duration{} : patience);
    while (auto event = any(deadline)) {
      if (const Kind* const kind = std::get_if<Kind>(&*event); kind != nullptr && wanted(*kind)) return *kind;
    }
    complain(what);
    return std::nullopt;
  }
  /// Has the camera's controls held, or let go.
  void lock_camera(bool on);
  template <typename Kind>
  std::vector<Kind> some(const std::string& what, std::size_t count) {
    std::vector<Kind> found;
    while (found.size() < count) {
      auto one = next<Kind>(what, [](const Kind&) { return true; });
      if (!one) break;
      found.push_back(*std::move(one));
    }
    return found;
  }

 private:
  std::optional<wire::Event> any(Deadline deadline);
  void complain(const std::string& what);

  Machine& machine_;
  std::string name_;
  std::unique_ptr<wire::Client> client_;
  bool gone_ = false;                      ///< nothing is worth waiting for
  std::string parted_ = "none has ended";  ///< why the last connection did
};

}  // namespace birdseye::vm
