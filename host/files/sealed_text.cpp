#include "host/files/sealed_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "calibration/record/sha256.hpp"
#include "calibration/record/strict_json.hpp"

namespace birdseye::host {

namespace {

using calibration::sha256_of;

constexpr std::string_view kBegin = "{\n", kSums = "sha256", kWhole = "whole", kSigned = "signed";

std::string line_of(std::string_view name, const nlohmann::json& value) {
  // Names may come from files in other encodings: what is found is not lost for one of them.
  return fmt::format("\"{}\": {}", name, calibration::text_of_json(value));
}

/// The line that begins with this name, without the comma at its end.
std::optional<std::string_view> find_line(std::string_view text, std::string_view name) {
  const std::string begin = fmt::format("\n\"{}\": ", name);
  const std::size_t at = text.find(begin);
  if (at == std::string_view::npos) return std::nullopt;
  std::string_view line = text.substr(at + 1, text.find('\n', at + 1) - at - 1);
  if (line.ends_with(',')) line.remove_suffix(1);
  return line;
}

/// The name with which the text's last line begins.
std::string last_name(std::string_view text) {
  const std::size_t at = text.rfind("\n\"");
  if (at == std::string_view::npos) return "";
  const std::string_view rest = text.substr(at + 2);
  return std::string(rest.substr(0, rest.find('"')));
}

std::string end_of(const std::string& before) {
  return line_of(kWhole, sha256_of(before)) + "\n}\n";
}

std::string before(const std::string& text, std::string_view line) {
  return text.substr(0, static_cast<std::size_t>(line.data() - text.data()));
}

std::string without_comma(const std::string& lines) {
  return lines.ends_with(",\n") ? lines.substr(0, lines.size() - 2) : lines;
}

/// Lines of parts, and the sum of each.
class TextWithSums {
 public:
  void add(std::string_view name, const std::string& line) {
    sums_[std::string(name)] = sha256_of(line);
    text_ += line;
    text_ += ",\n";
  }
  [[nodiscard]] const std::string& text() const { return text_; }
  [[nodiscard]] std::string sealed() const {
    const std::string text = text_ + line_of(kSums, sums_) + ",\n";
    return text + end_of(text);
  }

 private:
  std::string text_{kBegin};
  nlohmann::json sums_ = nlohmann::json::object();
};

/// The text that was signed, of its lines before the signature and that of the signature.
std::string signed_text_of(std::string_view lines, std::string_view signature) {
  TextWithSums out;
  lines.remove_prefix(std::min(lines.size(), kBegin.size()));
  while (!lines.empty()) {
    const std::size_t end = std::min(lines.find(",\n"), lines.size());
    const std::string_view line = lines.substr(0, end);
    out.add(line.substr(0, line.find("\": ")).substr(std::min<std::size_t>(line.size(), 1)), std::string(line));
    lines.remove_prefix(std::min(lines.size(), end + 2));
  }
  out.add(kSigned, std::string(signature));
  return out.sealed();
}

/// What of a text that does not fit its sums is damaged, in words.
std::string damage(const std::string& text) {
  if (!text.starts_with("{\n\"")) return "is empty, or its beginning was changed or damaged";
  const auto sums_line = find_line(text, kSums);
  const std::size_t colon = sums_line ? sums_line->find(' ') : std::string_view::npos;
  const nlohmann::json sums = colon == std::string_view::npos
                                  ? nlohmann::json()
                                  : nlohmann::json::parse(sums_line->substr(colon), nullptr, false);
  const bool summed = sums.is_object() && !sums.empty() &&
                      std::all_of(sums.begin(), sums.end(), [](const nlohmann::json& sum) { return sum.is_string(); });
  if (!summed && !text.ends_with("\n}\n")) return fmt::format("is cut off in its part \"{}\"", last_name(text));
  if (!summed) return fmt::format("its part \"{}\" was changed or damaged", kSums);
  for (const auto& [name, sum] : sums.items()) {
    const auto line = find_line(text, name);
    if (!line || sha256_of(*line) != sum.get<std::string>())
      return fmt::format("its part \"{}\" was changed or damaged", name);
  }
  // Each part is as it was: what is wrong lies between them, in the sums, or at the end.
  return fmt::format("its part \"{}\" was changed or damaged", kWhole);
}

}  // namespace

std::string sealed_text(const std::vector<SealedPart>& parts) {
  TextWithSums out;
  for (const auto& [name, value] : parts) out.add(name, line_of(name, value));
  return out.sealed();
}

std::string sealed_text(const std::vector<SealedPart>& parts, std::string_view kind, const ThisMachine& machine) {
  TextWithSums out;
  for (const auto& [name, value] : parts) out.add(name, line_of(name, value));
  const auto signature = machine.sign(kind, sha256_of(out.text()));
  out.add(kSigned, line_of(kSigned, json_of_signature(signature)));
  return out.sealed();
}

SealedBy sealed_by(const std::string& text) {
  const auto line = find_line(text, kSigned);
  if (!line) return {};
  const nlohmann::json json = nlohmann::json::parse("{" + std::string(*line) + "}", nullptr, false);
  SealedBy out{sha256_of(before(text, *line)), std::nullopt};
  try {
    out.signature = calibration::signature_of_json(json.at(std::string(kSigned)));
  } catch (const nlohmann::json::exception&) {
    out.signature = calibration::FileSignature();  // which holds for nothing
  }
  return out;
}

Result<nlohmann::json> unseal(const std::string& text) {
  const std::size_t end = text.rfind(fmt::format("\n\"{}\": ", kWhole));
  if (end == std::string::npos || text.substr(end + 1) != end_of(text.substr(0, end + 1)))
    return Error{Errc::bad_format, damage(text)};
  const auto line = find_line(text, kSigned);
  // What stands behind a signature it does not hold for: there are the sums of what stands before, and nothing else.
  if (line && text != signed_text_of(before(text, *line), *line))
    return Error{Errc::bad_format, "holds more than was signed: something was put in behind its signature"};
  const std::string read = line ? without_comma(before(text, *line)) + "\n}\n" : text;
  auto json = calibration::strict_json<nlohmann::json>(read);
  if (!json.is_object())
    return Error{Errc::bad_format, "is no object of JSON, says something twice, or nests lists deeper than any"};
  json.erase(std::string(kSums));
  json.erase(std::string(kWhole));
  return json;
}

}  // namespace birdseye::host
