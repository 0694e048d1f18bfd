#pragma once

#include <algorithm>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "drivers/io/byte_stream.hpp"
#include "drivers/minibird/settings.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye::testing {

using drivers::minibird::Bytes;

/// A line to a unit that answers what the test has written down, and notes what it is sent. Questions that are not
/// written down it does not understand: no reply, error 6. Time is real, but only replies can be late.
class ScriptedUnit final : public drivers::ByteStream {
 public:
  /// A single unit of firmware 3.67 that has just been reset.
  ScriptedUnit() {
    fresh = {
        {0x00, {0x08, 0xD0}}, {0x01, {3, 67}},      {0x02, {0x28, 0}},    {0x03, {0, 0}},       {0x04, {4, 0}},
        {0x06, {0xCD, 0x2D}}, {0x07, {0x4C, 0x67}}, {0x08, {0}},          {0x0E, {0}},          {0x11, {0}},
        {0x14, {60}},         {0x16, {0, 0}},       {0x17, Bytes(6, 0)},  {0x18, Bytes(6, 0)},  {0x19, {0x39, 0x30}},
        {0x23, {0}},          {0x05, Bytes(14, 1)}, {0x0C, Bytes(14, 1)}, {0x0D, Bytes(14, 1)},
    };
    fresh[0x0F] = Bytes{'6', 'D', 'F', 'O', 'B', ' ', ' ', ' ', ' ', ' '};
    answers = fresh;
  }

  Result<std::size_t> read(std::span<std::uint8_t> into, Deadline deadline) override {
    for (;;) {
      if (streaming && pending_.empty()) put(records());
      std::size_t n = 0;
      while (n < into.size() && !pending_.empty() && pending_.front().due <= device_now()) {
        into[n++] = pending_.front().byte;
        pending_.pop_front();
      }
      if (n > 0) return n;
      if (deadline.passed()) return std::size_t{0};
      sleep_for(std::min(deadline.left(), Duration{500'000}));
    }
  }
  Result<void> write(std::span<const std::uint8_t> bytes, Deadline /*deadline*/) override {
    for (const std::uint8_t byte : bytes) take(byte);
    return {};
  }
  void discard_input() override {
    // What is late has not come yet, and stays.
    while (!pending_.empty() && pending_.front().due <= device_now()) pending_.pop_front();
  }
  bool set_rts(bool asserted) override {
    if (!has_rts) return false;
    if (asserted) {
      ++resets;
      answers = fresh;
      streaming = asleep = false;
      command_.clear();
      pending_.clear();
    }
    return true;
  }
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] std::uint64_t line_errors() const override { return damaged; }

  [[nodiscard]] bool was_sent(const Bytes& command) const {
    return std::find(commands.begin(), commands.end(), command) != commands.end();
  }
  /// Of one unit: a position_matrix record at (300, 0, 0) mm, no rotation; more units: with their addresses.
  [[nodiscard]] Bytes records() const {
    Bytes out;
    for (int unit = 1; unit <= units; ++unit) {
      Bytes record{0xFF, 0x14, 0, 0, 0, 0, 0x7F, 0x3F, 0, 0, 0, 0, 0, 0, 0x7F, 0x3F, 0, 0, 0, 0, 0, 0, 0x7F, 0x3F};
      if (buttons) record.push_back(0x10);
      if (answers.contains(0x23) && answers.at(0x23)[0] == 1) record.push_back(static_cast<std::uint8_t>(unit));
      out.insert(out.end(), record.begin(), record.end());
    }
    return out;
  }

  std::map<std::uint8_t, Bytes> fresh, answers;  ///< replies by parameter: after a reset, and now
  std::set<std::uint8_t> stubborn;               ///< parameters that CHANGE does not change
  std::deque<Bytes> errors;                      ///< code, detail
  bool knows_expanded_errors = true;
  bool has_rts = true, mute = false, streaming = false, asleep = false, buttons = false;
  int units = 1, resets = 0;
  int half_replies = 0;  ///< so many of the next replies lose their last byte
  Duration late;         ///< by so much replies come
  std::uint64_t damaged = 0;
  std::vector<Bytes> commands;  ///< whole, with their prefixes

 private:
  struct Timed {
    std::uint8_t byte;
    DeviceTime due;
  };

  void put(Bytes reply) {
    if (half_replies > 0 && !reply.empty()) {
      --half_replies;
      reply.pop_back();
    }
    for (const std::uint8_t byte : reply) pending_.push_back({byte, device_now() + late});
  }
  static std::size_t length_of(const Bytes& command) {
    switch (command[0]) {
      case 'O':
      case 'M':
      case 'A':
      case '0':
        return 2;
      case 'L':
        return 3;
      case 'q':
      case 'r':
        return 7;
      case 'P': {
        if (command.size() < 2) return 2;
        const auto size = drivers::minibird::examine_bytes(command[1]);
        return 2 + (command[1] == 0x32 ? 1 : size.value_or(0));
      }
      default:
        return 1;
    }
  }
  void take(std::uint8_t byte) {
    if (mute) return;
    if (command_.empty() && byte >= 0xF0) {
      prefix_ = {byte};
      return;
    }
    command_.push_back(byte);
    if (command_.size() < length_of(command_) || (command_.size() == 1 && length_of(command_) > 1)) return;
    Bytes whole = prefix_;
    whole.insert(whole.end(), command_.begin(), command_.end());
    commands.push_back(whole);
    execute();
    command_.clear();
    prefix_.clear();
  }
  void execute() {
    const std::uint8_t code = command_[0];
    if (code >= 'V' && code <= ']') {
      const unsigned status = answers[0][0] & ~0x1EU;
      answers[0][0] = static_cast<std::uint8_t>(status | (code - 0x55U) << 1U);
    } else if (code == 'B') {
      streaming = false;
      if (!asleep) put(records());
    } else if (code == '@') {
      streaming = true;
    } else if (code == 'F' || code == 'G') {
      asleep = code == 'G';
    } else if (code == 'L' && answers.contains(0x16)) {
      if (!stubborn.contains(0x16)) answers[0x16] = {command_[1], command_[2]};
    } else if (code == 'P' && answers.contains(command_[1]) && !stubborn.contains(command_[1])) {
      if (command_[1] != 0x32) answers[command_[1]] = Bytes(command_.begin() + 2, command_.end());
    } else if (code == 'O') {
      examine(command_[1]);
    }
  }
  void examine(std::uint8_t parameter) {
    if (parameter == 10 || (parameter == 16 && knows_expanded_errors)) {
      Bytes error{0, 0};
      if (!errors.empty()) {
        error = errors.front();
        errors.pop_front();
      }
      put(parameter == 10 ? Bytes{error[0]} : error);
    } else if (answers.contains(parameter)) {
      put(answers[parameter]);
    } else {
      errors.push_back({6, 0});
    }
  }

  std::string name_ = "/dev/test";
  Bytes command_, prefix_;
  std::deque<Timed> pending_;
};

inline drivers::minibird::MiniBirdSettings without_waits(int birds = 1) {
  drivers::minibird::MiniBirdSettings settings;
  settings.birds = birds;
  settings.reset_hold = settings.reset_settle = settings.configure_wait = settings.bus_reset_wait =
      settings.run_wait = {};
  settings.reply_timeout = settings.answer_within = Duration::from_ms(40);
  settings.quiet = Duration::from_ms(5);
  return settings;
}

}  // namespace birdseye::testing
