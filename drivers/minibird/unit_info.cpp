#include "drivers/minibird/unit_info.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace birdseye::drivers::minibird {

namespace {

constexpr std::uint8_t kInvalidCommand = 6;
constexpr int kMostErrors = 8;

Result<std::optional<int>> serial_number(Dialogue& dialogue, std::uint8_t parameter, std::uint8_t unit, bool known) {
  if (!known) return std::optional<int>();
  const auto reply = dialogue.ask_if_known(parameter, unit);
  if (!reply) return reply.error();
  if (!*reply) return std::optional<int>();
  return std::optional<int>((**reply)[0] + 256 * (**reply)[1]);
}

}  // namespace

Result<UnitInfo> examine_unit(Dialogue& dialogue, std::uint8_t unit) {
  UnitInfo info;
  const auto revision = dialogue.ask(kRevision, unit);
  if (!revision) return revision.error();
  const auto crystal = dialogue.ask(kCrystal, unit);
  if (!crystal) return crystal.error();
  const auto model = dialogue.ask(kModel, unit);
  if (!model) return model.error();
  const bool printable =
      std::all_of(model->begin(), model->end(), [](std::uint8_t byte) { return byte >= 0x20 && byte < 0x7F; });
  // No letter, digit or line end is below 10: text is never taken for a revision.
  if ((*revision)[0] < 1 || (*revision)[0] > 9 || (*revision)[1] > 99 || !printable) {
    return Error{
        Errc::bad_format,
        fmt::format("{}: what answers is no miniBIRD: its revision reads {}, its model {}; check [tracker] device",
                    dialogue.name(), shown(*revision), shown(*model))};
  }
  info.revision_major = (*revision)[0];
  info.revision_minor = (*revision)[1];
  info.crystal_mhz = (*crystal)[0] == 0 ? 20 : (*crystal)[0];
  info.model.assign(model->begin(), model->end());
  while (!info.model.empty() && info.model.back() == ' ') info.model.pop_back();
  struct Row {
    std::uint8_t parameter;
    bool known;
    std::optional<int>& into;
  };
  for (const Row& row : {Row{kUnitSerial, info.since(3, 67), info.unit_serial},
                         Row{kSensorSerial, info.since(3, 71), info.sensor_serial},
                         Row{kTransmitterSerial, info.since(3, 71), info.transmitter_serial}}) {
    auto number = serial_number(dialogue, row.parameter, unit, row.known);
    if (!number) return number.error();
    row.into = *number;
  }
  return info;
}

Result<std::vector<UnitError>> read_errors(Dialogue& dialogue, std::uint8_t unit) {
  std::vector<UnitError> errors;
  bool expanded = true;
  for (int i = 0; i < kMostErrors; ++i) {
    std::optional<Bytes> reply;
    if (expanded) {
      auto asked = dialogue.ask_if_known(kExpandedError, unit);
      if (!asked) return asked.error();
      reply = *std::move(asked);
    }
    if (!reply) {
      auto asked = dialogue.ask(kErrorCode, unit);
      if (!asked) return asked.error();
      reply = *std::move(asked);
      // That the question before was not understood is no fault of the unit.
      if (std::exchange(expanded, false) && (*reply)[0] == kInvalidCommand) continue;
    }
    const std::uint8_t code = (*reply)[0];
    if (code == 0) break;
    const auto same = [code](const UnitError& error) { return error.code == code; };
    if (std::any_of(errors.begin(), errors.end(), same)) continue;  // it comes again as soon as it is read
    errors.push_back({code, reply->size() > 1 ? std::optional<std::uint8_t>((*reply)[1]) : std::nullopt});
  }
  return errors;
}

std::string words_of(const std::vector<UnitError>& errors) {
  std::string words;
  for (const UnitError& error : errors) words += (words.empty() ? "" : "; ") + words_of(error);
  return words;
}

}  // namespace birdseye::drivers::minibird
