#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "calibration/latency/latency.hpp"
#include "host/report/html_page.hpp"

namespace birdseye::host {

/// What the two streams are, in words: "tracker" and "video".
struct StreamNames {
  std::string a, b;
  std::string unit;  ///< of their speeds, as the curves hold them
};

/// The figures; offsets are null where the verdict is fail.
nlohmann::json latency_json(const calibration::Latency& latency, const Verdict& verdict);
/// A page with title and pictures: both motions before and after the offset is taken away, the scan of lags, the offset
/// over time.
HtmlPage latency_page(const calibration::Latency& latency, const Verdict& verdict, const StreamNames& names,
                      const std::string& advice);

}  // namespace birdseye::host
