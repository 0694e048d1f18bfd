#include "host/overlay/video_watch.hpp"

#include <gtest/gtest.h>

#include "tests/support/looking_about.hpp"

namespace birdseye::host {
namespace {

struct WatcherOfAll : VideoWatch {
  using VideoWatch::take;
  void take(const wire::VideoFrame& frame, const ScopeSetup& scope) {
    contradictions += VideoWatch::take(frame, scope, std::nullopt).contradicted ? 1 : 0;
  }
  int contradictions = 0;
};

/// The poses leap to where a reference sensor has them.
TEST(VideoWatch, PosesOfAnotherFrameContradictOnlyWhereNobodySaidSo) {
  for (const bool said : {false, true}) {
    testing::LookingAbout<WatcherOfAll> about;
    about.look(0, 10);
    ASSERT_EQ(about.motion.motion(), VideoAgreement::agrees);
    if (said) about.motion.forget_motion();
    EXPECT_EQ(about.motion.motion() == VideoAgreement::untold, said);
    about.bumped_mm = Eigen::Vector3d(200, -100, 50);
    about.look(10, 10);
    EXPECT_EQ(about.motion.contradictions > 0, !said);
    EXPECT_EQ(about.motion.motion(), VideoAgreement::agrees) << "it agrees anew";
  }
}

}  // namespace
}  // namespace birdseye::host
