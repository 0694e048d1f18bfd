#include "host/dicom/patient_identity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <sstream>

#include "calibration/base/lower_case.hpp"

namespace birdseye::host {

std::string person_name(const std::string& dicom_name) {
  std::istringstream parts(dicom_name.substr(0, dicom_name.find('=')));
  enum { family, given, middle, prefix, suffix };
  std::array<std::string, 5> part;
  for (std::string& one : part) {
    std::getline(parts, one, '^');
    one.erase(0, one.find_first_not_of(' '));
    one.erase(one.find_last_not_of(' ') + 1);
  }
  std::string out = part[family];
  const char* before = out.empty() ? "" : ", ";
  for (const int next : {prefix, given, middle, suffix}) {
    const std::string& one = part[static_cast<std::size_t>(next)];
    if (one.empty()) continue;
    out += before + one;
    before = " ";
  }
  return out;
}

bool same_name(const std::string& one, const std::string& other) {
  const auto letters = [](const std::string& name) {
    std::string left = lower_case(name);
    std::erase_if(left, [](char c) { return c == ' ' || c == ','; });
    return left;
  };
  return letters(one) == letters(other);
}

std::string dashed_date(const std::string& dicom_date) {
  constexpr std::size_t kDigits = 8;
  const bool sound = dicom_date.size() >= kDigits && std::all_of(dicom_date.begin(), dicom_date.begin() + kDigits,
                                                                 [](unsigned char c) { return c >= '0' && c <= '9'; });
  if (!sound) return {};
  return fmt::format("{}-{}-{}", dicom_date.substr(0, 4), dicom_date.substr(4, 2), dicom_date.substr(6, 2));
}

}  // namespace birdseye::host
