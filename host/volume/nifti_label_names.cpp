#include "host/volume/nifti_label_names.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "host/dicom/refused.hpp"

namespace birdseye::host {

namespace {

constexpr std::size_t kHeaderBytes = 348, kMostBytes = std::size_t{1} << 28U;
constexpr std::string_view kBlanks(" \t\r\n\0", 5);

/// What lies between the header and the voxels.
struct HeaderEnd {
  std::string bytes;  ///< empty for no single-file NIfTI-1
  bool swapped = false;
};

template <typename T>
T value_at(const std::string& bytes, std::size_t at, bool swapped) {
  std::array<char, sizeof(T)> own{};
  std::memcpy(own.data(), bytes.data() + at, own.size());
  if (swapped) std::reverse(own.begin(), own.end());
  T value{};
  std::memcpy(&value, own.data(), own.size());
  return value;
}

HeaderEnd bytes_before_voxels(const std::filesystem::path& path) {
  HeaderEnd end;
  const gzFile file = gzopen(path.c_str(), "rb");
  if (file == nullptr) return end;
  std::string header(kHeaderBytes, '\0');
  float offset = 0;
  if (gzread(file, header.data(), kHeaderBytes) == static_cast<int>(kHeaderBytes) &&
      header.compare(344, 3, "n+1") == 0) {
    end.swapped = value_at<std::int32_t>(header, 0, false) != static_cast<std::int32_t>(kHeaderBytes);
    offset = value_at<float>(header, 108, end.swapped);
  }
  if (offset > static_cast<float>(kHeaderBytes) && offset <= static_cast<float>(kMostBytes)) {
    end.bytes.resize(static_cast<std::size_t>(offset) - kHeaderBytes);
    const int got = gzread(file, end.bytes.data(), static_cast<unsigned>(end.bytes.size()));
    end.bytes.resize(static_cast<std::size_t>(std::max(got, 0)));
  }
  gzclose_r(file);
  return end;
}

/// The contents of the header's extensions. What follows an extension of impossible length is taken for its content.
std::vector<std::string_view> extensions_in(const HeaderEnd& end) {
  constexpr std::size_t kFlags = 4, kHead = 8;
  std::vector<std::string_view> extensions;
  const std::string_view all = end.bytes;
  for (std::size_t at = kFlags; at + kHead < all.size();) {
    const auto length = value_at<std::int32_t>(end.bytes, at, end.swapped);
    const bool sound = length >= 16 && static_cast<std::size_t>(length) <= all.size() - at;
    const std::size_t next = sound ? at + static_cast<std::size_t>(length) : all.size();
    extensions.push_back(all.substr(at + kHead, next - at - kHead));
    at = next;
  }
  return extensions;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlanks);
  return first == text.npos ? std::string_view() : text.substr(first, text.find_last_not_of(kBlanks) + 1 - first);
}

/// Takes what stands before the mark, and the mark, off the text; empty where the mark is not there.
std::optional<std::string_view> take_until(std::string_view& text, std::string_view mark) {
  const std::size_t at = text.find(mark);
  if (at == text.npos) return std::nullopt;
  const std::string_view before = text.substr(0, at);
  text.remove_prefix(at + mark.size());
  return before;
}

bool take(std::string_view& text, std::string_view mark) {
  if (!text.starts_with(mark)) return false;
  text.remove_prefix(mark.size());
  return true;
}

/// Whether the first element of an XML text is closed at its end.
bool is_whole_xml(std::string_view text) {
  while (text.starts_with("<?") || text.starts_with("<!")) {
    if (!take_until(text, text.starts_with("<!--") ? "-->" : ">")) return false;
    text = trimmed(text);
  }
  if (!take(text, "<")) return false;
  const std::string_view name = text.substr(0, text.find_first_of(" \t\r\n/>"));
  return !name.empty() &&
         (text.ends_with(fmt::format("</{}>", name)) || (text.ends_with("/>") && text.find('>') == text.size() - 1));
}

/// The character that a reference stands for, without its & and ;. Names are ASCII but for what is written as it is.
std::optional<char> referred(std::string_view reference) {
  constexpr std::array<std::pair<std::string_view, char>, 5> kNamed{
      {{"amp", '&'}, {"lt", '<'}, {"gt", '>'}, {"quot", '"'}, {"apos", '\''}}};
  for (const auto& [name, character] : kNamed) {
    if (name == reference) return character;
  }
  if (!take(reference, "#")) return std::nullopt;
  const int base = take(reference, "x") ? 16 : 10;
  int code = 0;
  const char* const end = reference.data() + reference.size();
  const auto read = std::from_chars(reference.data(), end, code, base);
  if (read.ec != std::errc() || read.ptr != end || code < 32 || code > 126) return std::nullopt;
  return static_cast<char>(code);
}

/// A label's name from what stands between its tags: plain, with references, or within <![CDATA[ ]]>.
std::optional<std::string> name_in(std::string_view text) {
  if (take(text, "<![CDATA[")) {
    const auto name = take_until(text, "]]>");
    if (!name || !trimmed(text).empty()) return std::nullopt;
    return std::string(*name);
  }
  if (text.find('<') != text.npos) return std::nullopt;
  std::string name;
  while (const auto before = take_until(text, "&")) {
    const auto reference = take_until(text, ";");
    const auto character = reference ? referred(*reference) : std::nullopt;
    if (!character) return std::nullopt;
    name.append(*before).push_back(*character);
  }
  return name.append(text);
}

std::optional<NamedLabel> label_in(std::string_view attributes, std::string_view content) {
  NamedLabel label;
  if (!take_until(attributes, "Key=\"")) return std::nullopt;
  const auto key = take_until(attributes, "\"");
  if (!key) return std::nullopt;
  const auto read = std::from_chars(key->data(), key->data() + key->size(), label.number);
  auto name = name_in(content);
  if (read.ec != std::errc() || read.ptr != key->data() + key->size() || !name) return std::nullopt;
  label.name = *std::move(name);
  label.values = {label.number};
  return label;
}

/// Adds the labels of a table; empty, or what is wrong.
std::string add_labels(std::string_view table, std::vector<NamedLabel>& names) {
  for (table = trimmed(table); !table.empty(); table = trimmed(table)) {
    if (!take(table, "<Label ")) return "is damaged";
    const auto attributes = take_until(table, ">");
    const auto content = take_until(table, "</Label>");
    const auto label = attributes && content ? label_in(*attributes, *content) : std::nullopt;
    if (!label) return "is damaged";
    const auto same = std::find_if(names.begin(), names.end(),
                                   [&label](const NamedLabel& other) { return other.number == label->number; });
    if (same == names.end()) {
      names.push_back(*label);
    } else if (same->name != label->name) {
      return fmt::format("calls label {} both '{}' and '{}'", label->number, same->name, label->name);
    }
  }
  return {};
}

/// Adds the labels of all tables of an extension; empty, or what is wrong.
std::string add_tables(std::string_view text, std::vector<NamedLabel>& names) {
  if (!is_whole_xml(text)) return "is damaged";
  while (take_until(text, "<LabelTable")) {
    const auto attributes = take_until(text, ">");
    if (!attributes) return "is damaged";
    if (attributes->ends_with('/')) continue;
    const auto table = take_until(text, "</LabelTable>");
    if (!table) return "is damaged";
    if (std::string wrong = add_labels(*table, names); !wrong.empty()) return wrong;
  }
  return {};
}

}  // namespace

Result<std::vector<NamedLabel>> nifti_label_names(const std::filesystem::path& path) {
  const HeaderEnd end = bytes_before_voxels(path);
  std::vector<NamedLabel> names;
  for (const std::string_view extension : extensions_in(end)) {
    const std::string_view text = trimmed(extension);
    // Other extensions are comments, or a DICOM header.
    if (!text.starts_with('<') && text.find("<Label") == text.npos) continue;
    if (const std::string wrong = add_tables(text, names); !wrong.empty())
      return refused(Errc::bad_format, path,
                     fmt::format("its table of label names {}; export the labels again", wrong));
  }
  return names;
}

}  // namespace birdseye::host
