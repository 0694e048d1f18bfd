#include "host/operation/surface_watch.hpp"

#include <gtest/gtest.h>

#include "drivers/system/wait.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/simulated_case.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::Scratch;
using birdseye::testing::simulated_case;

KeptView kept(const RegistrationCase& by, std::size_t n) {
  KeptView out;
  out.frame.width_px = by.pictures[n].width_px;
  out.frame.height_px = by.pictures[n].height_px;
  out.frame.rgb = std::make_shared<const std::vector<std::uint8_t>>(by.pictures[n].rgb);
  out.camera_from_patient = by.views[n].camera_from_patient;
  return out;
}

std::optional<CheckedSurface> next(SurfaceWatch& watch) {
  for (int i = 0; i < 3000; ++i) {
    if (auto checked = watch.tick()) return checked;
    sleep_for(Duration::from_ms(10));
  }
  return std::nullopt;
}

HostTime at_ms(int ms) {
  return HostTime{} + Duration::from_ms(ms);
}

TEST(SurfaceWatch, HoldsAFrameASecondAgainstTheDeformationThatIsShown) {
  const Scratch scratch;
  const RegistrationCase by = simulated_case(scratch / "c", 6);
  auto truth = read_field(scratch / "c/truth/field.mha");
  auto transfer = load_transfer_function(by.transfer);
  ASSERT_TRUE(truth && transfer);
  auto organ = organ_at_rest(by.ct, &*by.labels, by.label_values, *transfer);
  ASSERT_TRUE(organ) << organ.error().what;
  WatchedSurface surface{{kept(by, 1), kept(by, 2)},
                         by.views[0].camera,
                         *std::move(organ),
                         std::make_shared<const DeformedOrgan>(DeformedOrgan{*truth, 0.9, std::nullopt})};
  SurfaceWatch watch;
  watch.offer(kept(by, 0), 0.3, at_ms(0));
  EXPECT_FALSE(watch.watches());
  EXPECT_FALSE(watch.tick().has_value()) << "there is nothing to hold it against";
  watch.show(surface);
  watch.offer(kept(by, 0), 0.3, at_ms(0));
  const auto first = next(watch);
  ASSERT_TRUE(first.has_value());
  EXPECT_EQ(first->finding.verdict, SurfaceVerdict::holds) << first->finding.words;
  watch.offer(kept(by, 0), 0.3, at_ms(900));  // too soon
  watch.offer(kept(by, 0), std::nullopt, at_ms(1000));
  const auto second = next(watch);
  ASSERT_TRUE(second.has_value());
  EXPECT_EQ(second->at, at_ms(1000));
  EXPECT_EQ(second->finding.verdict, SurfaceVerdict::cannot_tell) << "the pose's error is not known";
  // Nothing is known of how good a deformation is that nobody estimated.
  surface.deformed = std::make_shared<const DeformedOrgan>(DeformedOrgan{*truth, std::nullopt, std::nullopt});
  watch.show(surface);
  watch.offer(kept(by, 0), 0.3, at_ms(1100));
  const auto third = next(watch);
  ASSERT_TRUE(third.has_value());
  EXPECT_EQ(third->finding.verdict, SurfaceVerdict::cannot_tell);
  EXPECT_NE(third->finding.words.find("not estimated"), std::string::npos) << third->finding.words;
  watch.forget();
  EXPECT_FALSE(watch.watches());
}

}  // namespace
}  // namespace birdseye::host
