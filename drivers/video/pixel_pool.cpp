#include "drivers/video/pixel_pool.hpp"

namespace birdseye::drivers {

namespace {

constexpr std::size_t kMostKept = 4;  // what readers held on to in a bad moment goes back to the system

}  // namespace

std::unique_ptr<PixelPool::Pixels> PixelPool::take() {
  const std::lock_guard lock(shelf_->mutex);
  if (shelf_->free.empty()) return std::make_unique<Pixels>();
  auto pixels = std::move(shelf_->free.back());
  shelf_->free.pop_back();
  return pixels;
}

std::shared_ptr<const PixelPool::Pixels> PixelPool::share(std::unique_ptr<Pixels> pixels) {
  return {pixels.release(), [shelf = shelf_](Pixels* returned) { shelf->put(std::unique_ptr<Pixels>(returned)); }};
}

void PixelPool::Shelf::put(std::unique_ptr<Pixels> pixels) {
  const std::lock_guard lock(mutex);
  if (free.size() < kMostKept) free.push_back(std::move(pixels));
}

}  // namespace birdseye::drivers
