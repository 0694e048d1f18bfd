#include "host/dicom/phase_words.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

#include "calibration/base/lower_case.hpp"

namespace birdseye::host {

namespace {

struct PhaseWord {
  std::string_view word, phase;
};

constexpr std::string_view kNative = "native", kArterial = "arterial", kPortal = "portal venous", kDelayed = "delayed";

/// Whole words.
constexpr std::array kPhaseWords{
    PhaseWord{"native", kNative},
    PhaseWord{"nativ", kNative},
    PhaseWord{"nat", kNative},
    PhaseWord{"unenhanced", kNative},
    PhaseWord{"noncontrast", kNative},
    PhaseWord{"precontrast", kNative},
    PhaseWord{"ncct", kNative},
    PhaseWord{"basal", kNative},
    PhaseWord{"plain", kNative},
    PhaseWord{"non contrast", kNative},
    PhaseWord{"pre contrast", kNative},
    PhaseWord{"without contrast", kNative},
    PhaseWord{"no contrast", kNative},
    PhaseWord{"w o", kNative},
    PhaseWord{"wo", kNative},
    PhaseWord{"ohne km", kNative},
    PhaseWord{"sans injection", kNative},
    PhaseWord{"sans contraste", kNative},
    PhaseWord{"sin contraste", kNative},
    PhaseWord{"arterial", kArterial},
    PhaseWord{"arteriell", kArterial},
    PhaseWord{"arterielle", kArterial},
    PhaseWord{"arteriel", kArterial},
    PhaseWord{"artériel", kArterial},
    PhaseWord{"artérielle", kArterial},
    PhaseWord{"arteriosa", kArterial},
    PhaseWord{"art", kArterial},
    PhaseWord{"hap", kArterial},
    PhaseWord{"portal", kPortal},
    PhaseWord{"portale", kPortal},
    PhaseWord{"portalvenous", kPortal},
    PhaseWord{"portovenous", kPortal},
    PhaseWord{"portalvenös", kPortal},
    PhaseWord{"portalvenoes", kPortal},
    PhaseWord{"portovenös", kPortal},
    PhaseWord{"porto", kPortal},
    PhaseWord{"venous", kPortal},
    PhaseWord{"venös", kPortal},
    PhaseWord{"venoes", kPortal},
    PhaseWord{"venosa", kPortal},
    PhaseWord{"veineux", kPortal},
    PhaseWord{"veineuse", kPortal},
    PhaseWord{"ven", kPortal},
    PhaseWord{"pv", kPortal},
    PhaseWord{"pvp", kPortal},
    PhaseWord{"delayed", kDelayed},
    PhaseWord{"delay", kDelayed},
    PhaseWord{"late", kDelayed},
    PhaseWord{"equilibrium", kDelayed},
    PhaseWord{"spät", kDelayed},
    PhaseWord{"spaet", kDelayed},
    PhaseWord{"spätphase", kDelayed},
    PhaseWord{"spaetphase", kDelayed},
    PhaseWord{"tardif", kDelayed},
    PhaseWord{"tardive", kDelayed},
    PhaseWord{"tardía", kDelayed},
    PhaseWord{"tardiva", kDelayed},
};

/// " abd ven 1 0 " of "ABD_Ven-1.0": what is neither a letter nor of a longer UTF-8 letter parts words.
std::string parted(std::string_view text) {
  std::string out = " ";
  for (const char c : lower_case(text)) {
    const auto u = static_cast<unsigned char>(c);
    const bool in_word = (c >= 'a' && c <= 'z') || u >= 0x80;
    if (in_word || out.back() != ' ') out += in_word ? c : ' ';
  }
  out += ' ';
  return out;
}

}  // namespace

std::string phase_named_in(std::string_view text) {
  const std::string words = parted(text);
  std::set<std::string_view> named;
  for (const PhaseWord& known : kPhaseWords) {
    if (words.find(fmt::format(" {} ", known.word)) != std::string::npos) named.insert(known.phase);
  }
  // "late arterial" is the arterial phase that shows the liver's tumours.
  if (named.size() == 2 && named.contains(kArterial) && words.find(" late art") != std::string::npos)
    named.erase(kDelayed);
  return named.size() == 1 ? std::string(*named.begin()) : std::string();
}

}  // namespace birdseye::host
