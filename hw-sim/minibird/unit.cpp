#include "hw-sim/minibird/unit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"
#include "calibration/geometry/transform.hpp"
#include "hw-sim/minibird/unit_errors.hpp"

namespace birdseye::hw_sim {

namespace {

std::int16_t word_at(std::span<const std::uint8_t> bytes, std::size_t index) {
  return static_cast<std::int16_t>(bytes[2 * index] + 256U * bytes[2 * index + 1]);
}

/// Rz(azimuth) Ry(elevation) Rx(roll), rad.
Eigen::Matrix3d turned(double azimuth, double elevation, double roll) {
  return rotation_exp({0, 0, azimuth}) * rotation_exp({0, elevation, 0}) * rotation_exp({roll, 0, 0});
}

/// Three words of which 32768 are half a turn.
Eigen::Matrix3d rotation_of_angles(std::span<const std::uint8_t> bytes) {
  const auto angle = [&](std::size_t i) { return word_at(bytes, i) * std::numbers::pi / 32768.0; };
  return turned(angle(0), angle(1), angle(2));
}

/// Six words: sine and cosine of each.
Eigen::Matrix3d rotation_of_sines(std::span<const std::uint8_t> bytes) {
  const auto angle = [&](std::size_t i) { return std::atan2(word_at(bytes, 2 * i), word_at(bytes, 2 * i + 1)); };
  return turned(angle(0), angle(1), angle(2));
}

}  // namespace

Unit::Unit(const UnitSettings& settings) : settings_(settings) {
  settings_.model.resize(10, ' ');
  settings_.birds = std::clamp(settings_.birds, 1, 126);
  reset();
}

void Unit::reset() {
  birds_.assign(static_cast<std::size_t>(settings_.birds), FlockBird{});
  for (std::size_t i = 0; i < birds_.size(); ++i) {
    for (unsigned number = 0; number < 64; ++number) {
      const ParameterRule* const rule = parameter_rule(static_cast<std::uint8_t>(number), revision());
      if (rule != nullptr) birds_[i].values[rule->number] = default_value(*rule);
    }
    birds_[i].values[kHemisphere] = {0, 0};  // older firmware has it too, but only by its command
    birds_[i].values[kAddress] = {static_cast<std::uint8_t>(birds_.size() == 1 ? 0 : i + 1)};
    const Addressing mode = birds_.size() > 30   ? Addressing::super_expanded
                            : birds_.size() > 14 ? Addressing::expanded
                                                 : Addressing::normal;
    birds_[i].values[kAddressing] = {static_cast<std::uint8_t>(mode)};
  }
  rate_hz_ = settings_.rate_hz;
  group_mode_ = streaming_ = asleep_ = suspended_ = false;
  configured_ = 0;
  master_ = 0;
  sync_mode_ = 0;
  points_due_ = 0;
  addressed_ = 0;
  absent_.reset();
  report_every_ = 1;
  command_.clear();
  held_.clear();
  long_prefix_ = false;
}

void Unit::address(std::size_t number) {
  addressed_ = 0;
  absent_.reset();
  // A unit alone takes the address 0, and 1, at which hosts set up a flock's master.
  if (number > birds_.size()) {
    absent_ = static_cast<std::uint8_t>(number);
  } else if (number > 0) {
    addressed_ = number - 1;
  }
}

/// Whether the byte is (a part of) a prefix that names a unit; it holds for the command that follows.
bool Unit::take_prefix(std::uint8_t byte) {
  if (long_prefix_) {
    long_prefix_ = false;
    address(byte);
    return true;
  }
  if (!command_.empty()) return false;
  if (byte == 0xA0 && addressing() == Addressing::super_expanded) {
    long_prefix_ = true;
    return true;
  }
  if (byte >= 0xF0) {
    address(byte & 0x0FU);
    return true;
  }
  if (byte >= 0xE0 && byte <= 0xEE && addressing() == Addressing::expanded) {
    address(16U + (byte & 0x0FU));
    return true;
  }
  return false;
}

std::vector<std::uint8_t> Unit::receive(std::uint8_t byte) {
  Bytes reply;
  if (take_prefix(byte)) return reply;
  if (command_.empty()) {
    command_length_ = command_bytes(byte);
    if (command_length_ == 0) {
      latch(birds_[addressed_], kErrorInvalidCommand);
      addressed_ = 0;
      absent_.reset();
      return reply;
    }
  }
  command_.push_back(byte);
  if (command_.size() == 2 && command_[0] == 'P') {
    const ParameterRule* const rule = parameter_rule(byte, revision());
    command_length_ = 2U + (rule != nullptr ? rule->change_bytes : 0U);
  }
  if (command_.size() < command_length_) return reply;
  if (absent_) {
    latch(birds_.front(), kErrorNoResponse, *absent_);
  } else {
    execute(reply);
  }
  command_.clear();
  addressed_ = 0;
  absent_.reset();
  if (suspended_) {
    held_.insert(held_.end(), reply.begin(), reply.end());
    reply.clear();
  } else if (!held_.empty()) {
    reply.insert(reply.begin(), held_.begin(), held_.end());
    held_.clear();
  }
  return reply;
}

void Unit::execute(Bytes& reply) {
  FlockBird& bird = birds_[addressed_];
  const std::uint8_t code = command_[0];
  switch (code) {
    case 'V':
    case 'W':
    case 'X':
    case 'Y':
    case 'Z':
    case '\\':
    case ']':
      bird.format = static_cast<OutputFormat>(code - 0x55);
      break;
    case 'B':
      streaming_ = false;
      if (running(addressed_)) {
        points_due_ = 1;
        point_bird_ = addressed_;
      } else {
        latch(bird, kErrorNotInitialised);
      }
      break;
    case '@':
    case '?':
      streaming_ = code == '@';
      break;
    case 'F':
    case 'G':
      asleep_ = code == 'G';
      break;
    case 'Q':
      report_every_ = 1;
      break;
    case 'R':
      report_every_ = 2;
      break;
    case 'S':
      report_every_ = 8;
      break;
    case 'T':
      report_every_ = 32;
      break;
    case 'N':
      reply.push_back(bird.button);
      break;
    case '/':
      group_mode_ = streaming_ = false;
      configured_ = 0;
      break;
    case 0x11:
    case 0x13:
      suspended_ = code == 0x13;
      break;
    default:
      execute_with_data(reply);
  }
}

void Unit::execute_with_data(Bytes& reply) {
  FlockBird& bird = birds_[addressed_];
  const auto data = std::span<const std::uint8_t>(command_).subspan(1);
  switch (command_[0]) {
    case 'M':
      bird.button_mode = data[0] != 0;
      break;
    case 'L':
      bird.values[kHemisphere] = {data[0], data[1]};
      break;
    case 'q':
      bird.align = rotation_of_angles(data);
      break;
    case 'r':
      bird.reference = rotation_of_angles(data);
      break;
    case 'J':
      bird.align = rotation_of_sines(data);
      break;
    case 'H':
      bird.reference = rotation_of_sines(data);
      break;
    case 'A':
      if (data[0] == 0xFF) {
        reply.assign(4, 0);  // nothing is picked up: no voltage, no retrace
      } else {
        sync_mode_ = data[0];
      }
      break;
    case '0':
      next_transmitter(data[0]);
      break;
    case 'O':
      examine(data[0], reply);
      break;
    case 'P':
      change(data[0], data.subspan(1));
      if (data[0] == kAngleAlign && data.size() == 7) bird.align = rotation_of_angles(data.subspan(1));
      if (data[0] == kReferenceFrame && data.size() == 7) bird.reference = rotation_of_angles(data.subspan(1));
      break;
    default:
      next_master(command_[0] - std::size_t{0x30});
  }
}

void Unit::next_master(std::size_t number) {
  if (number > birds_.size()) {
    latch(birds_.front(), kErrorNoResponse, static_cast<std::uint8_t>(number));
  } else {
    master_ = number - 1;
  }
}

void Unit::next_transmitter(std::uint8_t data) {
  // Each unit has one transmitter connected at most, and only the first unit of a flock has one.
  const unsigned unit = data >> 4U;
  if (unit > 1 || (data & 0x0FU) != 0) latch(birds_[addressed_], kErrorTransmitter);
  if (addressed_ != master_) latch(birds_[addressed_], kErrorNotMaster);
}

std::vector<std::uint8_t> Unit::record(std::size_t index, const BirdPose& pose) const {
  const FlockBird& bird = birds_[index];
  BirdPose reported = pose;
  // A dipole field is even: the unit cannot tell p from -p and answers with the one inside the chosen half-space.
  const Bytes& hemisphere = bird.values.at(kHemisphere);
  const double side = pose.position_mm[hemisphere[0] / 6 % 3];
  const bool outside = hemisphere[1] == 0 ? side < 0 : side > 0;
  if (outside != disturbance_.mirrored) reported.position_mm = -pose.position_mm;
  reported.rotation = bird.reference.transpose() * pose.rotation * bird.align.transpose();
  const auto for_position = bird.values.find(kReferenceForPosition);
  if (for_position != bird.values.end() && for_position->second[0] != 0) {
    reported.position_mm = bird.reference.transpose() * reported.position_mm;
  }
  const double full_scale_mm = (bird.values.at(kScale)[0] != 0 ? 72.0 : 36.0) * kMmPerInch;
  auto words = record_words(bird.format, reported, full_scale_mm);
  if (disturbance_.no_orientation) {
    const bool bare = bird.format == OutputFormat::angles || bird.format == OutputFormat::matrix ||
                      bird.format == OutputFormat::quaternion;
    std::fill(words.begin() + (bare ? 0 : 3), words.end(), std::int16_t{0});
  }
  auto bytes = phased_bytes(words);
  if (bird.button_mode) bytes.push_back(bird.button);
  if (group_mode_) bytes.push_back(static_cast<std::uint8_t>(index + 1));
  return bytes;
}

std::vector<std::uint8_t> Unit::measure(std::span<const BirdPose> poses) {
  Bytes out;
  const bool report = cycle_++ % report_every_ == 0;
  if (asleep_ || suspended_) return out;
  if ((streaming_ && report) || points_due_ > 0) {
    const std::size_t one = points_due_ > 0 ? point_bird_ : 0;
    for (std::size_t i = 0; i < std::min(birds_.size(), poses.size()); ++i) {
      if (group_mode_ ? !running(i) : i != one) continue;
      const Bytes bytes = record(i, poses[i]);
      out.insert(out.end(), bytes.begin(), bytes.end());
    }
  }
  points_due_ = 0;
  const auto& values = birds_.front().values;
  if (values.at(kDataReady)[0] != 0 && !streaming_ && !group_mode_) out.push_back(values.at(kDataReadyCharacter)[0]);
  return out;
}

}  // namespace birdseye::hw_sim
