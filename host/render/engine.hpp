#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "host/deform/displacement_field.hpp"
#include "host/render/gl/gl_context.hpp"
#include "host/render/scene/scene.hpp"
#include "host/render/scene/transfer_function.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// Draws a volume as docs/image-formation.md defines it.
class Engine {
 public:
  virtual ~Engine() = default;
  /// Until the next call, or undeform(), pictures show the volume deformed.
  virtual void deform(const DisplacementField& field) = 0;
  virtual void undeform() = 0;
  virtual ImageRgba render(const CameraModel& camera, const Transform<Camera, Patient>& camera_from_patient,
                           const RenderSettings& settings) = 0;
  /// What runs, in words: "cpu, avx512".
  [[nodiscard]] virtual std::string name() const = 0;
  /// What went wrong in the driver without any call saying so; empty where nothing did.
  [[nodiscard]] virtual std::string fault() const { return {}; }
  /// Main memory beyond the volume's own; 0 for what lies on the graphics card.
  [[nodiscard]] virtual std::size_t bytes() const { return 0; }

  /// What "auto" chose and why, in words; empty where the engine was asked for by its name.
  [[nodiscard]] const std::string& choice() const { return choice_; }
  void set_choice(std::string choice) { choice_ = std::move(choice); }

 private:
  std::string choice_;
};

struct EngineSettings {
  bool prune = true;  ///< false also works on bricks that are not seen, for measurements; the picture is the same
  /// A window's, to draw with, which must outlive the engine. Without one, the engines that need the graphics card make
  /// their own, off-screen.
  GlContext* window = nullptr;
};

/// The names that make_engine() takes: cpu; gl, the same rays on the graphics card; slices, the paper's method on the
/// card; auto, gl where there is a graphics card, else cpu.
std::vector<std::string> engine_names();
/// Keeps a reference to volume, which must outlive the engine. Errc::bad_value for another name, Errc::unsupported for
/// what this machine or its graphics card cannot draw.
Result<std::unique_ptr<Engine>> make_engine(const std::string& name, const Volume& volume,
                                            const TransferFunction& transfer, const EngineSettings& settings = {});

}  // namespace birdseye::host
