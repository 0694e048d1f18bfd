#include "calibration/base/crc64.hpp"

#include <gtest/gtest.h>

#ifdef __x86_64__
#include <cpuid.h>
#endif

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace birdseye {
namespace {

TEST(Crc64, IsThatOfTheCatalogue) {
  constexpr std::string_view kDigits = "123456789";
  const std::vector<std::uint8_t> bytes(kDigits.begin(), kDigits.end());
  EXPECT_EQ(crc64_ecma(bytes), 0x62EC59E3F1A4F00AU);          // CRC-64/WE
  EXPECT_EQ(~crc64_ecma(bytes, ~0ULL), 0x6C40DF5F0B497347U);  // CRC-64/ECMA-182
  const std::span<const std::uint8_t> all(bytes);
  EXPECT_EQ(crc64_ecma(all.subspan(4), crc64_ecma(all.first(4))), crc64_ecma(all));
}

#ifdef __x86_64__
/// Bits 2 and 6: the upper parts of the first sixteen wide registers are in use, of 256 and of 512 bits.
std::uint32_t registers_in_use() {
  std::uint32_t low = 0, high = 0;
  asm volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(1));
  return low & 0x44U;
}

TEST(Crc64, LeavesNoWideRegisterInUse) {
  std::uint32_t eax = 0, ebx = 0, ecx = 0, edx = 0;
  const bool tells = __get_cpuid_count(0xD, 1, &eax, &ebx, &ecx, &edx) != 0 && (eax & 4U) != 0;
  if (!tells || __builtin_cpu_supports("avx512f") == 0) GTEST_SKIP() << "the processor has no such registers";
  for (const std::size_t size : {100U, 256U, 1000U, 30000U}) {
    const std::vector<std::uint8_t> bytes(size, 7);
    EXPECT_NE(crc64_ecma(bytes), 0U);
    EXPECT_EQ(registers_in_use(), 0U) << size;
  }
}
#endif

}  // namespace
}  // namespace birdseye
