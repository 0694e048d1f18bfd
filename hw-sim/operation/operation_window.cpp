#include "hw-sim/operation/operation_window.hpp"

#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "drivers/system/wait.hpp"
#include "host/operation/operation.hpp"

namespace birdseye::hw_sim {

namespace {

/// Draws nothing: what is decided of each frame is all that is looked at.
class NoEngine final : public host::Engine {
 public:
  void deform(const host::DisplacementField& /*field*/) override {}
  void undeform() override {}
  host::ImageRgba render(const CameraModel& camera, const Transform<Camera, Patient>& /*camera_from_patient*/,
                         const host::RenderSettings& /*settings*/) override {
    const std::size_t pixels = static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px);
    return {camera.width_px, camera.height_px, std::vector<std::uint8_t>(4 * pixels)};
  }
  [[nodiscard]] std::string name() const override { return "none"; }
};

}  // namespace

Result<std::unique_ptr<host::LiveWorkflow>> open_window(const WindowSettings& window, const OperationTruth& truth,
                                                        const host::Authors& authors,
                                                        const std::filesystem::path& folder) {
  host::LiveSettings settings;
  settings.authors = authors;
  settings.out = folder;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (host::has_operation(folder)) settings.resume = folder;
  settings.patient = window.patient;
  settings.make_engine = [](const auto&, const auto&, const auto&) -> Result<std::unique_ptr<host::Engine>> {
    return std::unique_ptr<host::Engine>(std::make_unique<NoEngine>());
  };
  settings.tip_in_pointer_mm = truth.tip_in_pointer_mm();
  settings.rod_angle_deg = truth.rod_angle_deg();
  settings.fiducials = truth.fiducials_mm().size();
  settings.video_must_agree = window.video_must_agree;
  settings.pattern = window.pattern;
  auto workflow = std::make_unique<host::LiveWorkflow>(settings);
  const Deadline deadline = Deadline::after(Duration::from_ms(30'000));
  while (!workflow->view().markers_seen || workflow->view().engine_name.empty()) {
    if (const std::string fault = workflow->view().fault; !fault.empty()) return Error{Errc::bad_value, fault};
    if (deadline.passed()) return Error{Errc::timeout, "the simulated patient's CT is not read within 30 s"};
    sleep_for(Duration::from_ms(2));
    workflow->tick();
  }
  return workflow;
}

bool is_whole(const host::ShownPicture& shown) {
  return shown.overlaid && shown.strength >= 1 && shown.reason.empty();
}

}  // namespace birdseye::hw_sim
