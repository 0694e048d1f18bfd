#include "host/render/engine.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "host/render/cpu/ray_caster.hpp"
#include "host/render/gl/gl_ray_caster.hpp"
#include "host/render/gl/gl_slice_renderer.hpp"

namespace birdseye::host {

namespace {

class CpuEngine final : public Engine {
 public:
  CpuEngine(const Volume& volume, const TransferFunction& transfer, bool prune)
      : caster_(volume, transfer, cpu::supported_isas().back(), prune) {}
  void deform(const DisplacementField& field) override { caster_.deform(field); }
  void undeform() override { caster_.undeform(); }
  ImageRgba render(const CameraModel& camera, const Transform<Camera, Patient>& camera_from_patient,
                   const RenderSettings& settings) override {
    return caster_.render(rays_of(camera), camera_from_patient, settings);
  }
  [[nodiscard]] std::string name() const override { return "cpu, " + cpu::name_of(cpu::supported_isas().back()); }
  [[nodiscard]] std::size_t bytes() const override { return caster_.bytes(); }

 private:
  /// The rays of the last two cameras are kept: a window draws its inset between frames.
  const LensRays& rays_of(const CameraModel& camera) {
    if (rays_[1] && rays_[1]->camera() == camera) std::swap(rays_[0], rays_[1]);
    if (!rays_[0] || !(rays_[0]->camera() == camera)) {
      std::swap(rays_[0], rays_[1]);
      rays_[0] = std::make_unique<LensRays>(camera);
    }
    return *rays_[0];
  }

  RayCaster caster_;
  std::array<std::unique_ptr<LensRays>, 2> rays_;
};

template <typename Renderer>
class GlEngine final : public Engine {
 public:
  GlEngine(std::unique_ptr<GlContext> own, const GlContext& context, std::unique_ptr<Renderer> renderer,
           const char* what)
      : own_(std::move(own)), context_(context), renderer_(std::move(renderer)), what_(what) {}
  void deform(const DisplacementField& field) override { renderer_->deform(field); }
  void undeform() override { renderer_->undeform(); }
  ImageRgba render(const CameraModel& camera, const Transform<Camera, Patient>& camera_from_patient,
                   const RenderSettings& settings) override {
    return renderer_->render(camera, camera_from_patient, settings);
  }
  [[nodiscard]] std::string name() const override { return fmt::format("{}, {}", what_, context_.renderer()); }
  [[nodiscard]] std::string fault() const override { return context_.fault(); }

 private:
  std::unique_ptr<GlContext> own_;  // outlives what was made with it; none in a window
  const GlContext& context_;
  std::unique_ptr<Renderer> renderer_;
  const char* what_;
};

template <typename Renderer>
Result<std::unique_ptr<Engine>> make_gl(std::unique_ptr<GlContext> own, GlContext& context, const Volume& volume,
                                        const TransferFunction& transfer, const char* what, bool prune) {
  auto renderer = Renderer::create(context, volume, transfer, prune);
  if (!renderer) return renderer.error();
  if (!context.fault().empty()) {
    return Error{Errc::unsupported,
                 fmt::format("OpenGL: {} cannot hold a volume of {}x{}x{} ({}); use --engine cpu", context.renderer(),
                             volume.size[0], volume.size[1], volume.size[2], context.fault())};
  }
  return std::unique_ptr<Engine>(
      std::make_unique<GlEngine<Renderer>>(std::move(own), context, *std::move(renderer), what));
}

bool is_software(const std::string& renderer) {
  return renderer.find("llvmpipe") != std::string::npos || renderer.find("softpipe") != std::string::npos ||
         renderer.find("SwiftShader") != std::string::npos;
}

/// gl or slices; or auto, gl where it is not done in software.
Result<std::unique_ptr<Engine>> on_card(const std::string& name, const Volume& volume, const TransferFunction& transfer,
                                        const EngineSettings& settings) {
  std::unique_ptr<GlContext> own;
  GlContext* context = settings.window;
  if (context == nullptr) {
    auto made = GlContext::offscreen();
    if (!made) return made.error();
    own = *std::move(made);
    context = own.get();
  }
  if (name == "auto" && is_software(context->renderer())) {
    return Error{Errc::unsupported, "OpenGL is here in software only (" + context->renderer() + ")"};
  }
  if (name == "slices")
    return make_gl<GlSliceRenderer>(std::move(own), *context, volume, transfer, "slices", settings.prune);
  return make_gl<GlRayCaster>(std::move(own), *context, volume, transfer, "gl", settings.prune);
}

/// Engines keep two to three times the volume besides it; what does not fit would end us, or be swapped for minutes.
Result<void> check_memory(const Volume& volume) {
  const double needed = 4.0 * sizeof(std::int16_t) * volume.size[0] * volume.size[1] * volume.size[2];
  const auto physical = static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGESIZE));
  if (needed <= 0.8 * physical) return {};
  return Error{Errc::unsupported,
               fmt::format("a volume of {}x{}x{} needs {:.1f} GB to draw, of {:.1f} GB there are; "
                           "resample or crop it",
                           volume.size[0], volume.size[1], volume.size[2], needed / 1e9, physical / 1e9)};
}

/// What the inner loops can count.
Result<void> check_size(const Volume& volume) {
  const auto row = static_cast<std::int64_t>(volume.size[0]) + 2;
  const std::int64_t slice = row * (volume.size[1] + 2) + cpu::kSliceUnit;
  const bool fits = row <= cpu::kLongestRow && volume.size[1] < cpu::kLongestRow && volume.size[2] < cpu::kLongestRow &&
                    slice / cpu::kSliceUnit <= cpu::kLongestRow &&
                    slice * (volume.size[2] + 2) <= std::numeric_limits<std::int32_t>::max();
  if (fits) return {};
  return Error{Errc::unsupported, fmt::format("a volume of {}x{}x{} is larger than the cpu engine draws; resample or "
                                              "crop it",
                                              volume.size[0], volume.size[1], volume.size[2])};
}

}  // namespace

std::vector<std::string> engine_names() {
  return {"auto", "cpu", "gl", "slices"};
}

Result<std::unique_ptr<Engine>> make_engine(const std::string& name, const Volume& volume,
                                            const TransferFunction& transfer, const EngineSettings& settings) {
  if (auto enough = check_memory(volume); !enough) return enough.error();
  const auto on_cpu = [&]() -> Result<std::unique_ptr<Engine>> {
    if (auto fits = check_size(volume); !fits) return fits.error();
    return std::unique_ptr<Engine>(std::make_unique<CpuEngine>(volume, transfer, settings.prune));
  };
  if (name == "cpu") return on_cpu();
  if (name == "gl" || name == "slices") return on_card(name, volume, transfer, settings);
  if (name == "auto") {
    auto engine = on_card(name, volume, transfer, settings);
    std::string choice = engine ? "engine " + (*engine)->name() : "engine cpu: " + engine.error().what;
    if (!engine) engine = on_cpu();
    if (engine) (*engine)->set_choice(std::move(choice));
    return engine;
  }
  return Error{Errc::bad_value, fmt::format("engine \"{}\" is none of {}", name, fmt::join(engine_names(), ", "))};
}

}  // namespace birdseye::host
