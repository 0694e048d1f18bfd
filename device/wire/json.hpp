#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "device/wire/packet.hpp"

/// The JSON inside the wire's STRINGs. Reading throws nlohmann::json::exception where a value is not what it should be.
namespace birdseye::wire {

/// On one line. What an instrument says of itself may be cut inside a character, or be in another encoding: such bytes
/// become U+FFFD.
std::string text_of(const nlohmann::json& json);

/// A whole number. Throws where the value is none: one with a fraction or an exponent may be larger than any, and what
/// it is turned into is then undefined. Of int, int64_t and uint64_t.
template <typename Whole>
void get_whole(const nlohmann::json& in, Whole& out);

/// A whole number of ns that is no farther from zero than kFarthest_ns.
void get_time(const nlohmann::json& in, std::int64_t& ns);

void to_json(nlohmann::json& json, const FrameInfo& info);
void from_json(const nlohmann::json& json, FrameInfo& info);
void to_json(nlohmann::json& json, const ClockChange& change);
void from_json(const nlohmann::json& json, ClockChange& change);
void to_json(nlohmann::json& json, const Doubt& doubt);
void from_json(const nlohmann::json& json, Doubt& doubt);
void to_json(nlohmann::json& json, const Pedal& pedal);
void from_json(const nlohmann::json& json, Pedal& pedal);
void to_json(nlohmann::json& json, const ClockPing& ping);
void from_json(const nlohmann::json& json, ClockPing& ping);
void to_json(nlohmann::json& json, const ClockPong& pong);
void from_json(const nlohmann::json& json, ClockPong& pong);
void to_json(nlohmann::json& json, const Subscription& subscription);
void from_json(const nlohmann::json& json, Subscription& subscription);
void to_json(nlohmann::json& json, const CameraLock& lock);
void from_json(const nlohmann::json& json, CameraLock& lock);
void to_json(nlohmann::json& json, const CameraControls& controls);
void from_json(const nlohmann::json& json, CameraControls& controls);
void to_json(nlohmann::json& json, const Calibration& calibration);
void from_json(const nlohmann::json& json, Calibration& calibration);
void to_json(nlohmann::json& json, const WallClock& clock);
void from_json(const nlohmann::json& json, WallClock& clock);
// What an older appliance does not tell is as it is in a new Health: counters are 0.
void to_json(nlohmann::json& json, const InstrumentHealth& instrument);
void from_json(const nlohmann::json& json, InstrumentHealth& instrument);
void to_json(nlohmann::json& json, const Health& health);
void from_json(const nlohmann::json& json, Health& health);

}  // namespace birdseye::wire
