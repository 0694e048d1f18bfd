// What the live window looks like, against stored pictures. BIRDSEYE_NEW_PICTURES=1 stores what it looks like now: look
// at them before you commit them.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "host/window/inset_view.hpp"
#include "host/window/live_panels.hpp"
#include "tests/support/display.hpp"
#include "tests/support/live_operation.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::connect_and_calibrate;
using birdseye::testing::Hand;
using birdseye::testing::kFiducials;
using birdseye::testing::kTrackerFromPatient;
using birdseye::testing::operation_settings;
using birdseye::testing::Scratch;

constexpr int kVideoWidth = 768, kVideoHeight = 576;

/// In a few levels of each colour, which PNG packs well. Tissue as a lamp at the lens lights it: bright in the middle,
/// with some folds.
std::shared_ptr<const std::vector<std::uint8_t>> tissue_rgb() {
  auto rgb = std::make_shared<std::vector<std::uint8_t>>();
  rgb->reserve(std::size_t{3} * kVideoWidth * kVideoHeight);
  for (int v = 0; v < kVideoHeight; ++v) {
    for (int u = 0; u < kVideoWidth; ++u) {
      const double x = (u - kVideoWidth / 2.0) / kVideoHeight, y = (v - kVideoHeight / 2.0) / kVideoHeight;
      const double light = std::exp(-2.2 * (x * x + y * y)) * (1 + 0.12 * std::sin(23 * x + 9 * std::sin(7 * y)));
      for (const double part : {190.0, 92.0, 84.0})
        rgb->push_back(static_cast<std::uint8_t>(static_cast<int>(part * light / 12) * 12));
    }
  }
  return rgb;
}

wire::VideoFrame tissue(std::uint64_t number, const PoseAnswer& pose) {
  static const auto rgb = tissue_rgb();
  wire::VideoFrame frame;
  frame.width_px = kVideoWidth;
  frame.height_px = kVideoHeight;
  frame.rgb = rgb;
  frame.info.sequence = number;
  frame.info.acquired = DeviceTime{static_cast<std::int64_t>(number) * 40'000'000};
  frame.info.pose = pose;
  return frame;
}

calibration::CalibrationRecord record() {
  auto out = birdseye::testing::straight_scope_record(kVideoWidth, kVideoHeight, {}, {});
  out.lens->camera = {kVideoWidth, kVideoHeight, 620, 620, 384, 288, -0.2, 0.05, 0, 0, 0};
  out.lens->rms_px = 0.3;
  out.hand_eye->held_out_px = 1;
  return out;
}

/// The scope 90 mm before the ball of the small CT.
PoseAnswer looking_at_the_ball() {
  const Transform<Camera, Patient> camera_from_patient(
      Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 1, 0).normalized()).toRotationMatrix(), {6, -4, 90});
  PoseAnswer pose;
  pose.kind = PoseKind::interpolated;
  pose.tracker_from_sensor =
      kTrackerFromPatient * camera_from_patient.inverse() * record().hand_eye->camera_from_sensor;
  pose.position_sigma_mm = 0.2;
  return pose;
}

class LiveWindowPictures : public ::testing::Test {
 protected:
  void open(int width_px, int height_px, double scale) {
    window_.reset();
    display_ = std::make_unique<birdseye::testing::Display>(std::to_string(width_px) + "x" + std::to_string(height_px));
    ::setenv("DISPLAY", display_->name().c_str(), 1);
    ::unsetenv("WAYLAND_DISPLAY");
    LiveWindow::Settings settings;
    settings.width_px = width_px;
    settings.height_px = height_px;
    settings.scale = scale;
    auto window = LiveWindow::open(settings);
    ASSERT_TRUE(window) << window.error().what;
    window_ = *std::move(window);
    ages_ = {};
    for (int i = 0; i < 60; ++i) ages_.add(48 + 6 * std::sin(0.7 * i) + (i == 41 ? 30 : 0));
    facts_.ages = &ages_;
    facts_.frames_per_s = 25;
  }

  /// Draws it until its panels have found their places, and compares.
  void expect_looks(const std::string& name, LiveWorkflow& workflow, HostTime now) {
    const ShownPicture shown = workflow.shown_at(now);
    if (shown.any) window_->set_picture(LiveWindow::Slot::video, {*shown.rgb, shown.width_px, shown.height_px});
    if (workflow.view().patient != nullptr && !workflow.view().engine_name.empty()) {
      histogram_ = HuHistogram(workflow.view().patient->shown);
      facts_.histogram = &histogram_;
      facts_.editor = &editor_;
      editor_.set_points(workflow.view().transfer->points());
      const InsetView view(workflow.view().patient->shown);
      const auto ct = workflow.ct_seen_from(view.camera(), view.outside_from_patient(), InsetView::render_settings());
      ASSERT_TRUE(ct.has_value());
      const Picture inset = view.draw(*ct, workflow.picture().camera_from_patient());
      window_->set_picture(LiveWindow::Slot::inset, {inset.rgb, inset.width_px, inset.height_px});
    }
    for (int i = 0; i < 3; ++i) {
      window_->begin_frame();
      draw_panels(*window_, workflow.view(), shown, facts_);
      window_->end_frame();
      if (i < 2) window_->swap();
    }
    LiveWindow::Shot shot = window_->shot();
    const cv::Mat rgb(shot.height_px, shot.width_px, CV_8UC3, shot.rgb.data());
    cv::Mat got;
    cv::cvtColor(rgb, got, cv::COLOR_RGB2BGR);
    cv::Mat foot;
    cv::cvtColor(got.rowRange(got.rows - 2, got.rows), foot, cv::COLOR_BGR2GRAY);
    double darkest = 0, brightest = 0;
    cv::minMaxLoc(foot, &darkest, &brightest);
    EXPECT_EQ(darkest, brightest) << name << ": a line is cut at the window's lower edge";
    const std::string stored = std::string(BIRDSEYE_PICTURES "/") + name + ".png";
    if (std::getenv("BIRDSEYE_NEW_PICTURES") != nullptr) cv::imwrite(stored, got);
    const cv::Mat want = cv::imread(stored);
    ASSERT_EQ(got.size(), want.size()) << stored;
    cv::Mat off;
    cv::absdiff(got, want, off);
    const cv::Scalar mean = cv::mean(off);
    cv::Mat grey, far_off;
    cv::cvtColor(off, grey, cv::COLOR_BGR2GRAY);
    cv::threshold(grey, far_off, 40, 255, cv::THRESH_BINARY);
    const double share = cv::countNonZero(far_off) / static_cast<double>(far_off.total());
    // The line over the video, which says what may be believed, is a small part of it and must be right by itself.
    const cv::Rect line(got.cols / 4, 0, got.cols / 2, got.rows / 24);
    const double line_share = cv::countNonZero(far_off(line)) / static_cast<double>(line.area());
    // Another rasteriser draws the edges of letters otherwise; a panel that is missing or moved is some per cent.
    const bool alike = mean[0] + mean[1] + mean[2] < 3 && share < 0.003 && line_share < 0.01;
    if (!alike) cv::imwrite(::testing::TempDir() + name + "-got.png", got);
    EXPECT_TRUE(alike) << name << ": mean " << mean << ", " << 100 * share << " % far off; see " << ::testing::TempDir()
                       << name << "-got.png";
  }

  std::unique_ptr<birdseye::testing::Display> display_;
  std::unique_ptr<LiveWindow> window_;
  AgeStrip ages_;
  PanelFacts facts_;

 private:
  TransferEditor editor_;
  HuHistogram histogram_;
};

void begin(LiveWorkflow& workflow, Hand& hand, std::size_t touched) {
  birdseye::testing::load(workflow);
  connect_and_calibrate(workflow);
  birdseye::testing::give_record(workflow, record());
  const Eigen::Vector3d slip_mm(0.3, -0.2, 0.1);
  for (std::size_t i = 0; i < touched; ++i) hand.rest_at(kFiducials[i] + static_cast<double>(i) * slip_mm, 80);
  hand.rest_at({0, 0, 200}, 1);
}

/// The overlay runs; when, on this machine's clock, 45 ms after the newest frame.
HostTime run_overlay(LiveWorkflow& workflow) {
  workflow.go_to(LiveStep::run);
  HostTime exposed;
  for (std::uint64_t i = 1; i <= 50; ++i) {
    exposed = HostTime{static_cast<std::int64_t>(i) * 40'000'000};
    workflow.take(tissue(i, looking_at_the_ball()), exposed, ClockGap{});
  }
  workflow.draw();
  return HostTime{exposed.ns + 45'000'000};
}

TEST_F(LiveWindowPictures, BeforeAnythingHasCome) {
  ASSERT_NO_FATAL_FAILURE(open(1280, 720, 1));
  LiveWorkflow workflow{LiveSettings{}};
  workflow.set_link(false, "127.0.0.1:18944: nothing answers; does birdseyed run there?");
  expect_looks("connect-1280x720", workflow, HostTime{});
}

TEST_F(LiveWindowPictures, FiducialsWithTheirResiduals) {
  ASSERT_NO_FATAL_FAILURE(open(1280, 720, 1));
  const Scratch scratch;
  LiveWorkflow workflow(operation_settings(scratch));
  Hand hand(workflow);
  begin(workflow, hand, 3);
  workflow.take(tissue(1, looking_at_the_ball()), HostTime{40'000'000}, ClockGap{});
  workflow.draw();
  facts_.said = "snapshot: snapshot-001.png";
  expect_looks("fiducials-1280x720", workflow, HostTime{85'000'000});
}

TEST_F(LiveWindowPictures, ATouchIsOffAndTheFrozenPictureIsGrey) {
  ASSERT_NO_FATAL_FAILURE(open(1280, 720, 1));
  const Scratch scratch;
  LiveWorkflow workflow(operation_settings(scratch));
  Hand hand(workflow);
  begin(workflow, hand, 3);
  hand.rest_at(kFiducials[3] + Eigen::Vector3d(3, 8, 0), 80);
  hand.rest_at({0, 0, 200}, 1);
  ASSERT_EQ(workflow.view().odd_touch, 3U) << workflow.view().fre_mm.value_or(-1);
  workflow.take(tissue(1, looking_at_the_ball()), HostTime{0}, ClockGap{});
  workflow.freeze_or_let_go();
  workflow.draw();
  facts_.keys = true;
  expect_looks("fiducials-one-off-1280x720", workflow, HostTime{2'000'000'000});
}

TEST_F(LiveWindowPictures, MarginsWithHowFarOffTheyMayBeAmongAllFigures) {
  ASSERT_NO_FATAL_FAILURE(open(1280, 720, 1));
  const Scratch scratch;
  LiveSettings settings = operation_settings(scratch);
  hw_sim::Grid grid;
  grid.size = {20, 20, 20};
  grid.spacing_mm = {6, 6, 6};
  grid.origin_mm = {-20, -20, -20};
  std::vector<std::int16_t> labels;
  for (int k = 0; k < 20; ++k) {
    for (int j = 0; j < 20; ++j) {
      for (int i = 0; i < 20; ++i)
        labels.push_back((grid.point(i, j, k) - Eigen::Vector3d(2, 0, 0)).norm() < 12 ? 4 : 0);
    }
  }
  ASSERT_TRUE(hw_sim::write_dicom_series(scratch / "labels", grid, labels, 1));
  settings.patient.labels = scratch / "labels";
  settings.patient.organ = settings.patient.targets = {4};
  settings.patient.landmarks.clear();
  settings.patient.margins_mm = {5, 10};
  LiveWorkflow workflow(settings);
  Hand hand(workflow);
  begin(workflow, hand, 4);
  facts_.look.margins = true;
  facts_.details = true;
  facts_.preset = "tumour-and-vessels";
  workflow.set_look(facts_.look);
  const HostTime now = run_overlay(workflow);
  ASSERT_TRUE(workflow.shown_at(now).overlaid) << workflow.shown_at(now).reason;
  expect_looks("margins-1280x720", workflow, now);
}

TEST_F(LiveWindowPictures, ALightRoomWithSlicesAndAPatientNobodyHasConfirmed) {
  ASSERT_NO_FATAL_FAILURE(open(1280, 720, 1));
  const Scratch scratch;
  LiveWorkflow workflow(operation_settings(scratch));
  birdseye::testing::read_ct(workflow);
  connect_and_calibrate(workflow);
  const auto patient = workflow.view().patient;
  facts_.room = Room::light;
  window_->set_room(Room::light);
  facts_.slices.emplace(std::shared_ptr<const Volume>(patient, &patient->ct));
  const Picture slices = facts_.slices->draw({{{30, 30, 20}, "tumour", {0, 200, 150}}});
  window_->set_picture(LiveWindow::Slot::slices, slices.view());
  expect_looks("light-slices-1280x720", workflow, HostTime{});
}

TEST_F(LiveWindowPictures, ASnapshotLooksTheSameWhoeverThePatientIs) {
  ASSERT_NO_FATAL_FAILURE(open(1280, 720, 1));
  const Scratch scratch;
  LiveWorkflow workflow(operation_settings(scratch));
  birdseye::testing::read_ct(workflow);
  connect_and_calibrate(workflow);
  const auto of_patient = [&](const PatientIdentity& identity, bool snapshot) {
    OperationView view = workflow.view();
    const auto plan = std::make_shared<PatientPlan>(*view.patient);
    plan->identity = identity;
    view.patient = plan;
    facts_.pseudonymised = snapshot;
    for (int i = 0; i < 3; ++i) {
      window_->begin_frame();
      draw_panels(*window_, view, workflow.shown_at(HostTime{}), facts_);
      window_->end_frame();
      if (i < 2) window_->swap();
    }
    return window_->shot().rgb;
  };
  const PatientIdentity one{"Doe, Jane", "4711", "1961-02-03", "2026-11-20"}, other{};
  ASSERT_NE(of_patient(one, false), of_patient(other, false));
  EXPECT_EQ(of_patient(one, true), of_patient(other, true));
}

TEST_F(LiveWindowPictures, TheOverlayRunsAndOnADenseScreenTheVideoHasStopped) {
  const Scratch scratch;
  LiveWorkflow workflow(operation_settings(scratch));
  Hand hand(workflow);
  begin(workflow, hand, 4);
  const HostTime now = run_overlay(workflow);
  ASSERT_TRUE(workflow.shown_at(now).overlaid) << workflow.shown_at(now).reason;
  ASSERT_NO_FATAL_FAILURE(open(1920, 1080, 1));
  expect_looks("run-1920x1080", workflow, now);
  ASSERT_NO_FATAL_FAILURE(open(1920, 1080, 1.5));
  expect_looks("stopped-1920x1080-dense", workflow, HostTime{now.ns + 2'000'000'000});
}

TEST_F(LiveWindowPictures, AnEngineOnTheCardLeavesTheWindowItsOwnContext) {
  const Scratch scratch;
  ASSERT_NO_FATAL_FAILURE(open(1920, 1080, 1));
  LiveSettings settings = operation_settings(scratch);
  settings.engine = "gl";
  LiveWorkflow workflow(settings);
  Hand hand(workflow);
  begin(workflow, hand, 4);
  ASSERT_EQ(workflow.view().engine_name.substr(0, 2), "gl") << workflow.view().fault;
  const HostTime now = run_overlay(workflow);
  ASSERT_TRUE(workflow.shown_at(now).overlaid) << workflow.shown_at(now).reason;
  expect_looks("run-1920x1080", workflow, now);
}

}  // namespace
}  // namespace birdseye::host
