// Slices, and where the inset lies.
#include "host/window/slice_view.hpp"

#include <gtest/gtest.h>

#include "host/window/inset_place.hpp"

namespace birdseye::host {
namespace {

/// Oblique, with a bright ball at kBall_mm.
const Eigen::Vector3d kBall_mm(40, -10, 25);
std::shared_ptr<const Volume> ct_with_ball() {
  auto ct = std::make_shared<Volume>();
  ct->size = {60, 50, 40};
  ct->spacing_mm = {1, 1, 2};
  ct->patient_from_voxel.linear() =
      Eigen::AngleAxisd(0.1, Eigen::Vector3d(1, 1, 2).normalized()).toRotationMatrix() * ct->spacing_mm.asDiagonal();
  ct->patient_from_voxel.translation() = Eigen::Vector3d(8, -30, -10);
  ct->hu.assign(grid_count(ct->size), 0);
  for (int k = 0; k < ct->size[2]; ++k) {
    for (int j = 0; j < ct->size[1]; ++j) {
      for (int i = 0; i < ct->size[0]; ++i) {
        if ((ct->patient_from_voxel * Eigen::Vector3d(i, j, k) - kBall_mm).norm() < 4)
          ct->hu[ct->index(i, j, k)] = 1000;
      }
    }
  }
  return ct;
}

TEST(SliceView, APixelIsThePlaceThatLiesUnderIt) {
  SliceView view(ct_with_ball());
  view.go_to({30, -12, 22});
  for (const double zoom : {1.0, 2.5, 8.0}) {
    view.set_zoom(zoom);
    for (int slice = 0; slice < SliceView::kViews; ++slice) {
      const Eigen::Vector2d px(slice * SliceView::kSidePx + 133.25, 201.5);
      const Eigen::Vector3d place_mm = view.place_at(px);
      EXPECT_LT((view.px_of(slice, place_mm) - px).norm(), 1e-9);
      // All that a slice shows lies in the plane through the cross-hair.
      EXPECT_NEAR(place_mm[2 - slice], view.place_mm()[2 - slice], 1e-9) << slice;
    }
  }
}

TEST(SliceView, TheCrossHairStaysWhereItIsWhenItIsLookedAtFromNearer) {
  SliceView view(ct_with_ball());
  view.go_to(kBall_mm);
  std::vector<Eigen::Vector2d> before;
  for (int slice = 0; slice < SliceView::kViews; ++slice) before.push_back(view.px_of(slice, kBall_mm));
  view.set_zoom(4);
  for (int slice = 0; slice < SliceView::kViews; ++slice)
    EXPECT_LT((view.px_of(slice, kBall_mm) - before[static_cast<std::size_t>(slice)]).norm(), 1e-6);
}

TEST(SliceView, ShowsWhatTheCtHasThere) {
  SliceView view(ct_with_ball());
  view.go_to(kBall_mm);
  EXPECT_EQ(view.hu(), 1000);
  view.set_window({0, 2000});
  const Picture picture = view.draw({});
  for (int slice = 0; slice < SliceView::kViews; ++slice) {
    // Beside the cross-hair, in the ball: half of white.
    const Eigen::Vector3d beside_mm = kBall_mm + Eigen::Vector3d::Constant(1.3);
    const Eigen::Vector2d px = view.px_of(slice, beside_mm);
    const std::size_t at =
        3 * (static_cast<std::size_t>(px.y()) * SliceView::kWidthPx + static_cast<std::size_t>(px.x()));
    EXPECT_NEAR(picture.rgb[at], 127, 30) << slice;
  }
}

TEST(SliceView, StaysWithinTheCtAndScrollsBySlices) {
  SliceView view(ct_with_ball());
  const Eigen::Vector3d before_mm = view.place_mm();
  view.scroll(0, 3);
  EXPECT_NEAR((view.place_mm() - before_mm).z(), 6, 1e-9) << "three slices of 2 mm towards the head";
  view.scroll(2, -1);
  EXPECT_NEAR((view.place_mm() - before_mm).x(), -1, 1e-9);
  view.go_to({1e6, 0, 0});
  EXPECT_LT(view.place_mm().x(), 100);
  view.go_to(Eigen::Vector3d::Constant(std::nan("")));
  EXPECT_TRUE(view.place_mm().allFinite());
}

TEST(SliceView, MarksAreDrawnInTheSlicesThatTheyLieIn) {
  SliceView view(ct_with_ball());
  view.go_to({30, -12, 22});
  const Picture bare = view.draw({});
  const Eigen::Vector3d in_axial_mm = view.place_mm() + Eigen::Vector3d(-12, 12, 2);
  const Picture marked = view.draw({{in_axial_mm, "1", {255, 255, 0}}});
  std::array<int, SliceView::kViews> changed{};
  for (std::size_t i = 0; i < bare.rgb.size(); i += 3) {
    const std::size_t x = i / 3 % SliceView::kWidthPx;
    if (bare.rgb[i] != marked.rgb[i]) ++changed[x / SliceView::kSidePx];
  }
  EXPECT_GT(changed[0], 10);
  EXPECT_EQ(changed[1], 0);
  EXPECT_EQ(changed[2], 0);
}

TEST(InsetPlace, NeverCoversTheTarget) {
  const ScreenBox area{{0, 0}, {800, 600}};
  const Eigen::Vector2f size(200, 150);
  int corner = 0;
  for (float y = 0; y <= 600; y += 13) {
    for (float x = 0; x <= 800; x += 17) {
      const ScreenBox target{{x - 40, y - 40}, {x + 120, y + 40}};
      const auto place = place_inset(area, size, target, corner);
      ASSERT_TRUE(place) << x << " " << y;
      EXPECT_FALSE(overlap(place->box, target)) << x << " " << y;
      EXPECT_TRUE(overlap(place->box, area));
      corner = place->corner;
    }
  }
}

TEST(InsetPlace, StaysWhereItIsAsLongAsItMay) {
  const ScreenBox area{{0, 0}, {800, 600}};
  const Eigen::Vector2f size(200, 150);
  for (int corner = 0; corner < 4; ++corner) {
    EXPECT_EQ(place_inset(area, size, std::nullopt, corner)->corner, corner);
    EXPECT_EQ(place_inset(area, size, ScreenBox{{350, 250}, {450, 350}}, corner)->corner, corner);
  }
  // Where the target is everywhere, the inset is nowhere.
  EXPECT_FALSE(place_inset(area, size, area, 0));
}

}  // namespace
}  // namespace birdseye::host
