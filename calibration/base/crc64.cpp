#include "calibration/base/crc64.hpp"

#include <isa-l/crc64.h>

namespace birdseye {

namespace {

#ifdef __x86_64__
/// libisal sums 256 bytes and more in registers of 512 bits and leaves their upper parts in use. All computing that
/// follows then takes up to several times as long, until something says that they are free.
__attribute__((target("avx"))) void free_wide_registers() {
  __builtin_ia32_vzeroupper();
}
#endif

}  // namespace

std::uint64_t crc64_ecma(std::span<const std::uint8_t> bytes, std::uint64_t seed) {
  const std::uint64_t crc = ::crc64_ecma_norm(seed, bytes.data(), bytes.size());
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx") != 0) free_wide_registers();
#endif
  return crc;
}

}  // namespace birdseye
