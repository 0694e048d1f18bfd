#include "host/volume/decode_slices.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <span>
#include <utility>
#include <vector>

#include "host/volume/decode.hpp"
#include "host/volume/decoder_process.hpp"
#include "tests/support/dicom_files.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using testing::Scratch;

TEST(DecodeSlices, CompressedOnesAreDecodedByCopiesOfTheDecoder) {
  const Scratch scratch;
  testing::write_ct_series(scratch / "ct", {}, 5, {}, EXS_RLELossless);
  std::vector<std::int16_t> hu;
  const auto decode_by = [&](const ConfinedCopies& copies) {
    const auto decode = [&](const Announce& announce, std::span<ProcessCopy> made) -> Result<SendDecoded> {
      auto image = decode_dicom(scratch / "ct", announce, made);
      if (!image) return image.error();
      return SendDecoded([sent = std::move(image->hu)](const Send& send) { send(sent.data(), sent.size() * 2); });
    };
    hu.assign(std::size_t{5} * testing::kSliceColumns * testing::kSliceRows, 0);
    return run_decoder(scratch / "ct", copies, decode,
                       [&](const Receive& receive) { return receive(hu.data(), hu.size() * 2); });
  };
  ASSERT_TRUE(decode_by({}));
  const auto by_the_decoder_alone = hu;
  const auto by_copies = decode_by({3, send_slices});
  ASSERT_TRUE(by_copies) << by_copies.error().what;
  EXPECT_EQ(hu, by_the_decoder_alone);
  const auto ended = decode_by({2, [](const ProcessCopy::Take& take, const ProcessCopy::Send&) {
                                  std::size_t slices = 0;
                                  (void)take(&slices, sizeof slices);
                                  std::abort();
                                }});
  ASSERT_FALSE(ended);
  EXPECT_NE(ended.error().what.find("ct/1.dcm: is cut short, damaged, or too large to decode (its decoder ended by "),
            std::string::npos)
      << ended.error().what;
}

}  // namespace
}  // namespace birdseye::host
