#include "drivers/minibird/settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace birdseye::drivers::minibird {

namespace {

bool within_half_turn(const std::optional<AnglesDeg>& angles) {
  return !angles || std::max({std::abs(angles->azimuth), std::abs(angles->elevation), std::abs(angles->roll)}) <= 180;
}

void find_filter_faults(const FilterSettings& filters, std::vector<std::string>& faults) {
  for (std::size_t band = 0; band < 7; ++band) {
    const auto outside = [](double value) { return !(value > 0 && value <= 1); };
    if (filters.dc_vm && ((*filters.dc_vm)[band] < 0 || (*filters.dc_vm)[band] > 32767)) {
      faults.push_back(fmt::format("dc_vm: {} in band {} is outside 0 to 32767", (*filters.dc_vm)[band], band + 1));
    }
    for (const auto* table : {&filters.dc_alpha_min, &filters.dc_alpha_max}) {
      if (*table && outside((**table)[band])) {
        faults.push_back(fmt::format("dc_alpha_{}: {:g} in band {} is not over 0 and up to 1",
                                     table == &filters.dc_alpha_min ? "min" : "max", (**table)[band], band + 1));
      }
    }
    if (filters.dc_alpha_min && filters.dc_alpha_max &&
        (*filters.dc_alpha_min)[band] >= (*filters.dc_alpha_max)[band]) {
      faults.push_back(fmt::format("dc_alpha_min: not below dc_alpha_max in band {}", band + 1));
    }
  }
}

}  // namespace

RecordFormat format_of(const MiniBirdSettings& settings, std::size_t index) {
  if (index < settings.per_bird.size() && settings.per_bird[index].format) return *settings.per_bird[index].format;
  return settings.format;
}

Hemisphere hemisphere_of(const MiniBirdSettings& settings, std::size_t index) {
  if (index < settings.per_bird.size() && settings.per_bird[index].hemisphere) {
    return *settings.per_bird[index].hemisphere;
  }
  return settings.hemisphere;
}

std::vector<std::string> faults_of(const MiniBirdSettings& settings) {
  std::vector<std::string> faults;
  if (settings.birds < 1 || settings.birds > 14) {
    faults.push_back(fmt::format("birds: {}; a flock in normal addressing has 1 to 14", settings.birds));
    return faults;
  }
  if (settings.per_bird.size() > static_cast<std::size_t>(settings.birds)) {
    faults.push_back(fmt::format("bird: {} are described, but birds = {}", settings.per_bird.size(), settings.birds));
  }
  if (!(settings.rate_hz >= 14 && settings.rate_hz <= 144)) {
    faults.push_back(fmt::format("rate_hz: {:g} is outside 14 to 144", settings.rate_hz));
  }
  if (report_rate_command(settings.report_every).empty()) {
    faults.push_back(fmt::format("report_every: {} is none of 1, 2, 8, 32", settings.report_every));
  }
  if (settings.line_frequency_hz && *settings.line_frequency_hz != 50 && *settings.line_frequency_hz != 60) {
    faults.push_back(fmt::format("line_frequency_hz: {} is neither 50 nor 60", *settings.line_frequency_hz));
  }
  if (!within_half_turn(settings.reference_frame)) faults.emplace_back("reference_frame: an angle over 180 degrees");
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(settings.birds); ++i) {
    if (i < settings.per_bird.size() && !within_half_turn(settings.per_bird[i].angle_align)) {
      faults.push_back(fmt::format("angle_align of bird {}: an angle over 180 degrees", i + 1));
    }
    bytes += 2 * word_count(format_of(settings, i)) + (settings.button_byte ? 1 : 0) + (settings.birds > 1 ? 1 : 0);
  }
  // What the line can carry: ten bits a byte.
  if (settings.baud > 0 && settings.report_every > 0 &&
      static_cast<double>(bytes) * 10 * settings.rate_hz / settings.report_every > settings.baud) {
    faults.push_back(fmt::format("rate_hz: {:g} Hz of {} birds does not fit into {} baud", settings.rate_hz,
                                 settings.birds, settings.baud));
  }
  if (settings.filters) find_filter_faults(*settings.filters, faults);
  return faults;
}

}  // namespace birdseye::drivers::minibird
