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

  /// A buffer, empty or with whatever was in it before.
  [[nodiscard]] std::unique_ptr<Pixels> take();
  /// Hands a buffer to its readers. The last of them may outlive the pool.
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
