#pragma once

#include <Eigen/Core>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "drivers/minibird/measurement.hpp"
#include "drivers/minibird/record_parser.hpp"
#include "drivers/minibird/stream_layout.hpp"

namespace birdseye::drivers::minibird {

/// Decides whether one bird's records make sense, each by itself and after those before it. The guard follows the
/// sensor through readings that it withholds too, so that a position that has flipped to its negative stays known as
/// flipped. Where readings make no sense again and again, those that do are withheld too: a byte that was damaged may
/// have changed them by less than shows.
class BirdGuard {
 public:
  BirdGuard(const BirdLayout& layout, const Plausibility& limits) : layout_(layout), limits_(limits) {}

  /// What a bird's noise was like. It outlives the stream: a unit that starts again has the noise that it had.
  struct Noise {
    double restless = 0;     ///< how often, of late, a way led back: noise is there
    double back_counts = 0;  ///< how far such a way was, on average
    double repeats = 1;      ///< how often, of late, a record was one of those before
    double newest = 0.2;     ///< what the newest record counts in that: as if five had repeated before the first
  };
  [[nodiscard]] const Noise& noise() const { return noise_; }
  void expect(const Noise& noise) { noise_ = noise; }

  /// Judges one reading. Where its time is not certain, its place is judged but no speed is computed from it.
  BirdReading judge(const Record& record, DeviceTime acquired, Duration sigma, bool time_certain = true);

 private:
  struct Sample {
    Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    DeviceTime time;
    Duration sigma;
    bool time_certain = true;
  };
  struct Objection {
    DoubtKind kind = DoubtKind::none;
    std::string words;
  };

  [[nodiscard]] std::optional<Objection> doubt_of_words(const std::vector<std::int16_t>& words) const;
  std::optional<Objection> doubt_of_life();
  static bool is_quiet(const std::map<std::vector<std::int16_t>, std::size_t>& alike);
  std::optional<Objection> doubt_of_repeats(const std::vector<std::int16_t>& words, DeviceTime time);
  Objection place(Sample sample);
  BirdReading judge_itself(const Record& record, DeviceTime acquired, Duration sigma, bool time_certain);
  [[nodiscard]] Objection doubt_of_side(const Eigen::Vector3d& reported_mm, bool mirrored) const;
  /// Does the position, after the track, look like the negative of where the sensor is?
  [[nodiscard]] bool is_mirrored(const Sample& sample) const;
  [[nodiscard]] bool noise_is_plain() const;
  [[nodiscard]] bool within_reach(const Sample& from, const Sample& to) const;
  enum class Placed { on_track, in_reach, off };
  Placed placed(const Sample& sample);
  [[nodiscard]] std::optional<Eigen::Vector3d> predicted_mm(DeviceTime time) const;
  void follow(const Sample& sample);

  BirdLayout layout_;
  Plausibility limits_;
  std::deque<Sample> track_;  ///< where the sensor has been, newest last; positions are put back where they flipped
                              ///< from. The times of all of them are certain, or of none
  Eigen::Vector3d last_mm_ = Eigen::Vector3d::Zero();  ///< of the last reading in place, its time certain or not
  std::optional<DeviceTime> judged_at_;
  Duration usual_{0};                ///< from one reading to the next, as a rule
  double noise_mm2_ = 0;             ///< mean square of the readings about the line through those before
  std::optional<Sample> candidate_;  ///< the newest reading of those that are off the track but agree
  int agreeing_ = 0;
  std::vector<std::int16_t> last_words_;
  std::deque<std::vector<std::int16_t>> recent_words_;  ///< of the records before, newest last
  std::deque<std::vector<std::int16_t>> first_words_;   ///< those since the start, until alive_
  bool alive_ = false;       ///< these differed: what is frozen since before the stream shows damaged ones at most
  bool was_frozen_ = false;  ///< until a reading is good again
  DeviceTime repeated_since_;
  int repeats_ = 0;
  double speed_mm_s_ = 0;                                  ///< when the words last changed
  Eigen::Vector3d last_way_mm_ = Eigen::Vector3d::Zero();  ///< from the reading before
  Noise noise_;
  double damaged_ = 0;      ///< how often, of late, a reading made no sense after one that did
  bool made_sense_ = true;  ///< the reading before
};

}  // namespace birdseye::drivers::minibird
