#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace birdseye::host {

/// A reference picture in bins, in blocks of pixels, of which only those that hold some of the overlap are looked at.
/// Pixels outside the overlap have a bin of their own, one past the last: counting them costs less than asking.
class BinnedPicture {
 public:
  static constexpr std::size_t kBlock = 64;

  BinnedPicture(std::span<const std::uint8_t> grey, std::span<const std::uint8_t> overlap,
                const std::array<std::uint8_t, 256>& bin_of_grey, int bins)
      : size_(grey.size()), bins_((grey.size() + kBlock - 1) / kBlock * kBlock, static_cast<std::uint8_t>(bins)) {
    for (std::size_t first = 0; first < size_; first += kBlock) {
      const std::size_t before = pixels_;
      for (std::size_t i = first; i < std::min(first + kBlock, size_); ++i) {
        if (overlap[i] == 0) continue;
        bins_[i] = bin_of_grey[grey[i]];
        ++pixels_;
      }
      if (pixels_ > before) blocks_.push_back(first);
    }
  }

  [[nodiscard]] std::size_t size() const { return size_; }      ///< of the picture, pixels
  [[nodiscard]] std::size_t pixels() const { return pixels_; }  ///< of the overlap
  /// First pixels of the blocks that hold some of the overlap.
  [[nodiscard]] std::span<const std::size_t> blocks() const { return blocks_; }
  [[nodiscard]] const std::uint8_t* bins(std::size_t first) const { return &bins_[first]; }

  /// A block of another picture of this size. Where the picture ends inside the block, the block is copied into spare.
  template <typename T>
  [[nodiscard]] const T* block(std::span<const T> picture, std::size_t first, std::array<T, kBlock>& spare) const {
    if (first + kBlock <= size_) return &picture[first];
    std::copy(picture.begin() + static_cast<std::ptrdiff_t>(first), picture.end(), spare.begin());
    return spare.data();
  }

 private:
  std::size_t size_, pixels_ = 0;
  std::vector<std::uint8_t> bins_;
  std::vector<std::size_t> blocks_;
};

}  // namespace birdseye::host
