#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

namespace birdseye::drivers {

/// Buffers for pixels that come back when their last reader lets go, so that a stream of frames takes no new memory:
/// fresh pages cost as much as converting the picture.
class PixelPool {
 public:
  using Pixels = std::vector<std::uint8_t>;

  /// A buffer of whatever was in it before, perhaps empty.
  [[nodiscard]] std::unique_ptr<Pixels> take();
  /// To the readers; the pool may be gone by the time the last of them is.
  [[nodiscard]] std::shared_ptr<const Pixels> share(std::unique_ptr<Pixels> pixels);
  void give_back(std::unique_ptr<Pixels> pixels) { shelf_->put(std::move(pixels)); }

 private:
  struct Shelf {
    void put(std::unique_ptr<Pixels> pixels);
    std::mutex mutex;
    std::vector<std::unique_ptr<Pixels>> free;
  };
  std::shared_ptr<Shelf> shelf_ = std::make_shared<Shelf>();
};

}  // namespace birdseye::drivers
