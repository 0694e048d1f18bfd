#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "calibration/base/result.hpp"
#include "calibration/base/verdict.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/round_field.hpp"
#include "calibration/geometry/transform.hpp"
#include "calibration/record/file_signature.hpp"
#include "calibration/record/identity.hpp"

namespace birdseye::calibration {

/// Where an entry of a record comes from.
struct Provenance {
  std::string made_utc;       ///< 2026-11-22T09:30:00Z
  std::string software;       ///< birdseye and its version
  std::string made_from;      ///< the board and how many views, in words
  Grade grade = Grade::pass;  ///< pass or marginal: what failed is not put into a record
  std::string doubt{};        ///< that it rests on what no known machine signed, and on what; empty: on nothing such
};

struct LensEntry {
  Provenance provenance;
  CameraModel camera;
  std::string model;  ///< of the lens, as `calibrate camera --model` names it
  /// Of fx fy cx cy k1 k2 p1 p2 k3; rows of terms that were not solved for are zero.
  Eigen::Matrix<double, CameraModel::kParameters, CameraModel::kParameters> covariance;
  double rms_px = 0, held_out_px = 0;
  std::optional<double> rod_angle_deg;    ///< of an oblique scope, against the camera head
  std::optional<RoundField> round_field;  ///< as its pictures showed it; empty: they showed no edge, or nobody looked
};

/// How the rod of an oblique scope turns in the camera head: the model of RodScope. Angles as the person read them off.
struct RodEntry {
  double reference_angle_deg = 0;  ///< at which camera_from_sensor holds
  Eigen::Vector3d axis_in_sensor{0, 0, 1}, axis_point_in_sensor_mm{0, 0, 0};
  double picture_turn = 1;
};

struct HandEyeEntry {
  Provenance provenance;
  Transform<Camera, Sensor> camera_from_sensor;  ///< with the rod, where there is one, at its reference angle
  Eigen::Matrix<double, 6, 6> covariance;        ///< as the solver states it: rotation vector (rad), translation (mm)
  double rms_px = 0, held_out_px = 0, held_out_mm = 0;
  std::optional<RodEntry> rod;  ///< none: camera_from_sensor holds at the one angle at which it was made
  /// That held_out_px and held_out_mm rest on, as HandEyeResult has them; empty: the record is of before they were
  /// kept.
  std::optional<int> independent_stations = std::nullopt;
};

struct TipEntry {
  Provenance provenance;
  Eigen::Vector3d tip_in_sensor_mm;
  Eigen::Matrix3d covariance_mm2;
  double rms_mm = 0;
};

/// What is left between the times of frames and of poses: a frame said to be of time t shows what the tracker measured
/// at t - offset.
struct LatencyEntry {
  Provenance provenance;
  double offset_ms = 0, ci95_low_ms = 0, ci95_high_ms = 0, drift_ppm = 0;
  /// birdseyed's [camera] delay_ms when it was measured: with another the offset is another. Empty: nobody said it.
  std::optional<double> camera_delay_ms = std::nullopt;
};

/// All that was found of one scope on one cart. Its text is JSON for people to read, with a checksum over the content:
/// a text that was cut, mixed up or changed by hand is refused.
struct CalibrationRecord {
  static constexpr int kVersion = 1;

  std::string scope;         ///< its name or serial number, as its owner calls it
  Identity tracker, camera;  ///< of the hardware it was made with
  std::optional<LensEntry> lens;
  std::optional<HandEyeEntry> hand_eye;
  std::optional<TipEntry> tip;
  std::optional<LatencyEntry> latency;

  /// Enters a lens. A hand-eye calibration holds for the lens it was made with only, so entering another lens removes
  /// it; the answer is true if it did.
  bool set_lens(LensEntry entry);
};

/// Of the first entry that rests on what no known machine signed: which entry, and on what. Empty: none does.
std::string doubt_of(const CalibrationRecord& record);

/// Signed by nobody.
std::string record_text(const CalibrationRecord& record);
/// Refuses what is no calibration record, a later version, a checksum that does not fit, and numbers that make no
/// sense. Who signed it is not asked.
Result<CalibrationRecord> parse_record(const std::string& text);

inline constexpr const char* kRecordFormat = "birdseye calibration record";
/// What a record's signature is over: all of its text but white space, the signature itself and the checksum.
std::string signed_sha256(const CalibrationRecord& record);
std::string record_text(const CalibrationRecord& record, const FileSignature& signature);

/// A record, and who says that they wrote it.
struct SignedRecord {
  CalibrationRecord record;
  std::string sha256;                      ///< signed_sha256(), of the text
  std::optional<FileSignature> signature;  ///< empty: it is signed by nobody
  bool of_010 = false;                     ///< as 0.1.0 wrote it, which signed nothing
};
/// As parse_record().
Result<SignedRecord> parse_signed_record(const std::string& text);

}  // namespace birdseye::calibration
