#pragma once

#include <string>
#include <utility>
#include <vector>

#include "calibration/base/verdict.hpp"
#include "host/app/picture.hpp"

namespace birdseye::host {

/// The page of one calibration: a single HTML file that loads nothing, built from top to bottom. Texts are escaped;
/// SVGs are not.
class ReportPage {
 public:
  explicit ReportPage(std::string title) : title_(std::move(title)) {}

  void set_verdict(const Verdict& verdict) { verdict_ = verdict; }
  void heading(const std::string& text);
  void paragraph(const std::string& text);
  /// The first row holds the columns' names; a row whose last cell begins with "rejected" or "outlier" is marked.
  void table(const std::vector<std::vector<std::string>>& rows);
  void svg(const std::string& svg, const std::string& caption);
  void picture(const Picture& picture, const std::string& caption);  ///< kept inside the page, as a PNG

  [[nodiscard]] std::string html() const;

 private:
  std::string title_, body_;
  Verdict verdict_;
};

/// &, <, > and quotes as HTML writes them.
std::string escape_html(const std::string& text);

}  // namespace birdseye::host
