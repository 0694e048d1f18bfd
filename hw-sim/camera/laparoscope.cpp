#include "hw-sim/camera/laparoscope.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "hw-sim/base/hashed.hpp"
#include "hw-sim/camera/blur.hpp"
#include "hw-sim/camera/cavity_coat.hpp"
#include "hw-sim/camera/embree_scene.hpp"
#include "hw-sim/camera/solid_noise.hpp"
#include "hw-sim/phantom/grid.hpp"

namespace birdseye::hw_sim {

namespace {

using Eigen::Vector3f;

constexpr int kPacket = 8;

/// What a ray meets: where, in the scene's frame, and the surface's normal there (unit, towards the camera).
struct Hit {
  Vector3f point, normal;
  Vector3f rest;  ///< the point before the organ was deformed, where its texture is
  float distance = 0;
  unsigned geometry = RTC_INVALID_GEOMETRY_ID;
};

constexpr float kReferenceMm = 100;  // where a lamp of strength one gives light of strength one

class EmbreeLaparoscope final : public Laparoscope {
 public:
  EmbreeLaparoscope(const LaparoscopeSettings& settings, RTCDevice device)
      : usual_lens_(settings.lens),
        camera_(settings.lens),
        lamp_(settings.lamp_in_camera_mm.cast<float>()),
        exposure_(static_cast<float>(1.55 * std::pow(settings.well_lit_mm / kReferenceMm, 2))),
        noise_level_(static_cast<float>(settings.noise)),
        field_share_(settings.field),
        blur_px_(settings.blur_px),
        seed_(settings.seed),
        device_(device),
        texture_(settings.seed + 31) {
    const CameraModel& camera = camera_;
    const auto pixels = static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px);
    rays_.resize(pixels);
    light_.resize(pixels, Vector3f::Zero());
    field_.resize(pixels);
    lay_rays();
    for (std::size_t i = 0; i < noise_.size(); ++i) noise_[i] = static_cast<float>(hashed_normal(seed_ + 32, i));
    for (std::size_t i = 0; i < gamma_.size(); ++i) {
      const double share = static_cast<double>(i) / static_cast<double>(gamma_.size() - 1);
      gamma_[i] = static_cast<std::uint8_t>(std::lround(255.0 * std::pow(share, 1 / 2.2)));
    }
  }
  ~EmbreeLaparoscope() override {
    cavity_.reset();
    bench_.reset();
    rtcReleaseDevice(device_);
  }

  void set_cavity(const Cavity& cavity) override {
    traced_scene_ = nullptr;
    organ_ = cavity.organ;
    rest_mm_ = cavity.rest_mm;
    change_ = {};
    coat_ = std::make_unique<CavityCoat>(texture_, cavity);
    cavity_ = std::make_unique<EmbreeScene>(device_);
    cavity_->add(cavity.organ, kOrganGeometry, cavity.rest_mm);
    if (cavity.wall_centre_mm) {
      const Eigen::Vector3d& c = *cavity.wall_centre_mm;
      const Field wall = [&](const Eigen::Vector3d& p) { return (p - c).norm() - cavity.wall_radius_mm; };
      const Eigen::Vector3d reach = Eigen::Vector3d::Constant(1.1 * cavity.wall_radius_mm);
      cavity_->add(surface_of(ScalarGrid::sample(wall, Grid::around(c - reach, c + reach, cavity.wall_radius_mm / 15))),
                   kWallGeometry);
    }
    if (!cavity.instruments.vertices.empty()) cavity_->add(cavity.instruments, kInstrumentGeometry);
    cavity_->commit();
  }

  void set_bench(const Chessboard& board) override {
    board_ = board;
    traced_scene_ = nullptr;
    bench_ = std::make_unique<EmbreeScene>(device_);
    Mesh table;
    constexpr float kReach = 2000;
    table.vertices = {{-kReach, -kReach, 0}, {kReach, -kReach, 0}, {kReach, kReach, 0}, {-kReach, kReach, 0}};
    table.triangles = {{0, 2, 1}, {0, 3, 2}};
    bench_->add(table, 0);
    bench_->commit();
  }

  void change_organ(const OrganChange& change) override {
    if (change == change_) return;
    change_ = change;
    traced_scene_ = nullptr;
    Mesh organ = organ_;
    std::vector<Vector3f> rest_mm = rest_mm_;
    if (rest_mm.empty() && change != OrganChange{}) rest_mm = organ.vertices;
    if (change.hollow) {
      hollow_out(*change.hollow, organ, rest_mm);
    }
    for (Vector3f& vertex : organ.vertices) vertex += change.shift_mm.cast<float>();
    cavity_->replace(organ, kOrganGeometry, rest_mm);
  }

  void zoom(double factor) override {
    CameraModel zoomed = usual_lens_;
    zoomed.fx_px *= factor;
    zoomed.fy_px *= factor;
    if (zoomed == camera_) return;
    camera_ = zoomed;
    traced_scene_ = nullptr;
    lay_rays();
  }

  std::vector<std::uint8_t> look_into_cavity(const Transform<Camera, Patient>& camera_from_patient,
                                             std::uint64_t sequence) override {
    const Transform<Patient, Camera> pose = camera_from_patient.inverse();
    if (is_new(*cavity_, pose.matrix())) {
      trace(*cavity_, pose.rotation().cast<float>(), pose.translation().cast<float>(), exposure_,
            [this](const Hit& hit) { return coat_->at(hit.rest, hit.geometry); });
    }
    return expose(sequence);
  }

  std::vector<std::uint8_t> look_at_bench(const Transform<Camera, Marker>& camera_from_marker,
                                          std::uint64_t sequence) override {
    const Transform<Marker, Camera> pose = camera_from_marker.inverse();
    if (is_new(*bench_, pose.matrix())) {
      trace(*bench_, pose.rotation().cast<float>(), pose.translation().cast<float>(), 0.6F,
            [this](const Hit& hit) { return bench_surface(hit); });
    }
    return expose(sequence);
  }

  [[nodiscard]] std::vector<std::uint8_t> lens_circle() const override {
    std::vector<std::uint8_t> circle(field_.size(), 0);
    for (std::size_t i = 0; i < circle.size(); ++i) {
      // The light falls to 0.55 at the edge, within which the stop is wide open.
      if (field_[i] >= 0.55F) circle[i] = 255;
    }
    return circle;
  }

  [[nodiscard]] bool sees(const Transform<Camera, Patient>& camera_from_patient, const Eigen::Vector3d& point,
                          const Eigen::Vector3d& normal) const override {
    const auto at = project(camera_, camera_from_patient * point);
    if (!at) return false;
    const int x = static_cast<int>(std::lround(std::clamp(at->x(), -1.0, 1e4)));
    const int y = static_cast<int>(std::lround(std::clamp(at->y(), -1.0, 1e4)));
    if (x < 0 || y < 0 || x >= camera_.width_px || y >= camera_.height_px || field_[pixel(x, y)] < 0.55F) return false;
    const Eigen::Vector3d eye = camera_from_patient.inverse().translation();
    const Eigen::Vector3d way = point - eye;
    constexpr double kLeastFacing = 0.25;  // grazing surfaces are a pixel wide
    if (-way.normalized().dot(normal) < kLeastFacing) return false;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay ray{};
    ray.org_x = static_cast<float>(eye.x());
    ray.org_y = static_cast<float>(eye.y());
    ray.org_z = static_cast<float>(eye.z());
    ray.dir_x = static_cast<float>(way.x());
    ray.dir_y = static_cast<float>(way.y());
    ray.dir_z = static_cast<float>(way.z());
    ray.tfar = static_cast<float>(1 - 1.0 / way.norm());  // up to a millimetre before the point itself
    ray.mask = ~0U;
    rtcOccluded1(cavity_->get(), &context, &ray);
    return ray.tfar >= 0;  // it is set to minus infinity where something is in the way
  }

 private:
  /// The ray and the light of each pixel.
  void lay_rays() {
    const CameraModel& camera = camera_;
    const double radius = field_share_ * camera.width_px * camera.fx_px / usual_lens_.fx_px;
    for (int y = 0; y < camera.height_px; ++y) {
      for (int x = 0; x < camera.width_px; ++x) {
        const std::size_t at = pixel(x, y);
        const auto ray = unproject(camera, Eigen::Vector2d(x, y));
        const double r = std::hypot(x - camera.cx_px, y - camera.cy_px);
        // The round field stop, a pixel or two soft, and the fall of light towards its edge.
        const double stop = std::clamp((radius - r) / 2.0, 0.0, 1.0);
        field_[at] = ray ? static_cast<float>(stop * (1 - 0.45 * std::pow(r / radius, 2.5))) : 0.0F;
        rays_[at] = ray ? Vector3f(ray->normalized().cast<float>()) : Vector3f(0, 0, 1);
      }
    }
  }

  [[nodiscard]] std::size_t pixel(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(camera_.width_px) + static_cast<std::size_t>(x);
  }

  [[nodiscard]] Reflectance bench_surface(const Hit& hit) const {
    // The board's squares, box-filtered over the pixel's footprint along each axis, so that edges lie where they are.
    const float square = static_cast<float>(board_.square_mm);
    const float slant = std::max(0.3F, hit.normal.dot(Vector3f(0, 0, -1)));
    const float footprint = hit.distance / static_cast<float>(camera_.fx_px) / std::sqrt(slant);
    const auto wave = [&](float u) {
      const float cell = std::floor(u / square + 0.5F);  // the nearest edge between two squares
      const float past = u - cell * square;
      const float sign = static_cast<long>(cell) % 2 == 0 ? 1.0F : -1.0F;
      return sign * std::clamp(past / (0.5F * footprint), -1.0F, 1.0F);
    };
    const float u = hit.point.x();
    const float v = hit.point.y();
    const float columns = static_cast<float>(board_.columns) * square;
    const float rows = static_cast<float>(board_.rows) * square;
    const bool printed = u > -square && v > -square && u < columns && v < rows;
    const bool paper = u > -2 * square && v > -2 * square && u < columns + square && v < rows + square;
    Reflectance out;
    if (printed) {
      const float white = 0.5F + 0.5F * wave(u) * wave(v);
      out.albedo = Vector3f::Constant(0.035F + 0.78F * white);
    } else if (paper) {
      out.albedo = Vector3f::Constant(0.80F);
    } else {
      const float weave = 0.8F + 0.4F * texture_.at(hit.point / 2.1F);
      out.albedo = Vector3f(0.05F, 0.16F, 0.20F) * weave;  // surgical drape
    }
    return out;
  }

  /// Whether the light that reaches the sensor is not what was traced last: a scope at rest sees the same frame after
  /// frame, but for the sensor's noise.
  bool is_new(const EmbreeScene& scene, const Eigen::Matrix4d& pose) {
    if (traced_scene_ == &scene && traced_pose_ == pose) return false;
    traced_scene_ = &scene;
    traced_pose_ = pose;
    return true;
  }

  /// The light at every pixel, into light_. rotation, eye: of the camera in the scene's frame.
  template <typename SurfaceOf>
  void trace(const EmbreeScene& scene, const Eigen::Matrix3f& rotation, const Vector3f& eye, float exposure,
             const SurfaceOf& surface_of_hit) {
    const Vector3f lamp = eye + rotation * lamp_;
    tbb::parallel_for(0, camera_.height_px, [&](int y) {
      RTCIntersectContext context;
      rtcInitIntersectContext(&context);
      context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
      for (int x0 = 0; x0 < camera_.width_px; x0 += kPacket) {
        alignas(32) RTCRayHit8 packet;
        alignas(32) int valid[kPacket];
        std::array<Vector3f, kPacket> directions;
        for (int lane = 0; lane < kPacket; ++lane) {
          const int x = x0 + lane;
          const bool seen = x < camera_.width_px && field_[pixel(std::min(x, camera_.width_px - 1), y)] > 0;
          valid[lane] = seen ? -1 : 0;
          directions[static_cast<std::size_t>(lane)] = rotation * rays_[pixel(std::min(x, camera_.width_px - 1), y)];
          const Vector3f& d = directions[static_cast<std::size_t>(lane)];
          packet.ray.org_x[lane] = eye.x();
          packet.ray.org_y[lane] = eye.y();
          packet.ray.org_z[lane] = eye.z();
          packet.ray.dir_x[lane] = d.x();
          packet.ray.dir_y[lane] = d.y();
          packet.ray.dir_z[lane] = d.z();
          packet.ray.tnear[lane] = 1;
          packet.ray.tfar[lane] = std::numeric_limits<float>::infinity();
          packet.ray.time[lane] = 0;
          packet.ray.mask[lane] = ~0U;
          packet.ray.id[lane] = 0;
          packet.ray.flags[lane] = 0;
          packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
          packet.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
        }
        rtcIntersect8(valid, scene.get(), &context, &packet);
        for (int lane = 0; lane < kPacket && x0 + lane < camera_.width_px; ++lane) {
          const std::size_t at = pixel(x0 + lane, y);
          Vector3f light = Vector3f::Zero();
          if (valid[lane] != 0 && packet.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID) {
            light = shade(scene, packet, lane, eye, lamp, directions[static_cast<std::size_t>(lane)], surface_of_hit) *
                    (exposure * field_[at]);
          }
          light_[at] = light;
        }
      }
    });
    if (blur_px_ > 0) blur(light_, camera_.width_px, camera_.height_px, blur_px_);
  }

  /// The sensor: noise that is new with every frame, and the camera's gamma.
  [[nodiscard]] std::vector<std::uint8_t> expose(std::uint64_t sequence) const {
    std::vector<std::uint8_t> rgb(rays_.size() * 3);
    tbb::parallel_for(0, camera_.height_px, [&](int y) {
      const double row = hashed_uniform(seed_ + sequence, static_cast<std::uint64_t>(y));
      auto noise_at = static_cast<std::size_t>(row * static_cast<double>(noise_.size()));
      for (int x = 0; x < camera_.width_px; ++x, noise_at += 3) {
        const std::size_t at = pixel(x, y);
        write_pixel(light_[at], noise_at, &rgb[3 * at]);
      }
    });
    return rgb;
  }

  template <typename SurfaceOf>
  [[nodiscard]] Vector3f shade(const EmbreeScene& scene, const RTCRayHit8& packet, int lane, const Vector3f& eye,
                               const Vector3f& lamp, const Vector3f& direction, const SurfaceOf& surface_of_hit) const {
    Hit hit;
    hit.distance = packet.ray.tfar[lane];
    hit.point = eye + hit.distance * direction;
    hit.rest = scene.rest(packet, lane, hit.point);
    hit.geometry = packet.hit.geomID[lane];
    hit.normal = scene.normal(packet, lane);
    hit.normal.normalize();
    if (hit.normal.dot(direction) > 0) hit.normal = -hit.normal;
    const Reflectance surface = surface_of_hit(hit);
    Vector3f normal = hit.normal;
    if (surface.gloss > 0) {
      // A wet surface is not smooth: ripples break the highlight up.
      const Vector3f q = hit.rest / 3.1F;
      const float ripple = texture_.at(q) - 0.5F;
      const float other = texture_.at(q + Vector3f(17, 5, 3)) - 0.5F;
      normal += 0.22F * Vector3f(ripple, other, ripple * other * 2);
      normal.normalize();
    }
    const Vector3f to_lamp = lamp - hit.point;
    const float lamp_distance = to_lamp.norm();
    const Vector3f towards_lamp = to_lamp / lamp_distance;
    const float fall = (kReferenceMm / lamp_distance) * (kReferenceMm / lamp_distance);
    const float facing = std::max(0.0F, normal.dot(towards_lamp));
    const float half = facing > 0 ? std::max(0.0F, normal.dot((towards_lamp - direction).normalized())) : 0.0F;
    const float half2 = half * half;
    const float half8 = half2 * half2 * half2 * half2;
    const float half32 = half8 * half8 * half8 * half8;
    const float highlight = surface.gloss * half32 * half32 * half32;  // Blinn and Phong's, with an exponent of 96
    return (surface.albedo * facing + Vector3f::Constant(highlight)) * fall;
  }

  void write_pixel(const Vector3f& light, std::size_t noise_at, std::uint8_t* out) const {
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const float value = light[static_cast<Eigen::Index>(channel)];
      // Shot noise grows with the root of the light; the read noise is what is left in the dark.
      const float sigma = noise_level_ * (0.0015F + 0.012F * std::sqrt(std::max(0.0F, value)));
      const float noisy = value + sigma * noise_[(noise_at + channel) % noise_.size()];
      const float scaled = std::clamp(noisy, 0.0F, 1.0F) * static_cast<float>(gamma_.size() - 1);
      out[channel] = gamma_[static_cast<std::size_t>(scaled)];
    }
  }

  CameraModel usual_lens_, camera_;
  Vector3f lamp_;  ///< in the camera frame
  float exposure_, noise_level_;
  double field_share_, blur_px_;
  std::uint64_t seed_;
  RTCDevice device_;
  SolidNoise texture_;
  Chessboard board_;
  std::unique_ptr<CavityCoat> coat_;
  std::vector<Vector3f> rays_;  ///< unit directions in the camera frame, one per pixel
  std::vector<float> field_;    ///< how much of the light reaches each pixel, 0 outside the round field
  std::array<float, 1U << 16U> noise_{};
  std::array<std::uint8_t, 4096> gamma_{};
  Mesh organ_;  ///< as the cavity was set
  std::vector<Vector3f> rest_mm_;
  OrganChange change_;
  std::unique_ptr<EmbreeScene> cavity_, bench_;
  const EmbreeScene* traced_scene_ = nullptr;
  Eigen::Matrix4d traced_pose_ = Eigen::Matrix4d::Zero();
  std::vector<Vector3f> light_;  ///< of the last trace
};

}  // namespace

Result<std::unique_ptr<Laparoscope>> Laparoscope::create(const LaparoscopeSettings& settings) {
  if (const auto checked = check(settings.lens); !checked) return checked.error();
  RTCDevice device = rtcNewDevice(nullptr);
  if (device == nullptr) return Error{Errc::io, "the ray tracer (Embree) does not start on this machine"};
  return std::unique_ptr<Laparoscope>(std::make_unique<EmbreeLaparoscope>(settings, device));
}

CameraModel laparoscope_lens(int width_px, int height_px) {
  const double scale = width_px / 768.0;
  CameraModel lens;
  lens.width_px = width_px;
  lens.height_px = height_px;
  lens.fx_px = 598.4 * scale;
  lens.fy_px = 601.9 * scale;
  lens.cx_px = 0.5 * width_px + 7.3 * scale;
  lens.cy_px = 0.5 * height_px - 6.1 * scale;
  lens.k1 = -0.305;
  lens.k2 = 0.098;
  lens.p1 = 0.0011;
  lens.p2 = -0.0007;
  return lens;
}

}  // namespace birdseye::hw_sim
