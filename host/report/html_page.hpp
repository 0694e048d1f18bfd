#pragma once

#include <string>
#include <utility>
#include <vector>

#include "calibration/base/verdict.hpp"
#include "host/files/picture.hpp"

namespace birdseye::host {

/// A picture as an address that holds all of it, for an <img> or, in an SVG, an <image>.
std::string data_url(const Picture& picture);

/// The page of a result: an HTML file that loads nothing from a network. It holds title, verdict and then what was
/// added, in that order. Texts are escaped; SVGs are not.
class HtmlPage {
 public:
  explicit HtmlPage(std::string title) : title_(std::move(title)) {}

  void set_verdict(const Verdict& verdict) { verdict_ = verdict; }
  void heading(const std::string& text);
  void paragraph(const std::string& text);
  /// The first row holds the columns' names; a row whose last cell begins with "rejected" or "outlier" is marked.
  void table(const std::vector<std::vector<std::string>>& rows);
  void svg(const std::string& svg, const std::string& caption);
  void picture(const Picture& picture, const std::string& caption);  ///< kept inside the page, as a PNG
  /// Files that lie beside the page, two in a row where there are several.
  void picture_files(const std::vector<std::string>& files, const std::string& caption);
  void film_file(const std::string& file, const std::string& caption);

  [[nodiscard]] std::string html() const;

 private:
  void figure(const std::string& content, const std::string& caption);

  std::string title_, body_;
  Verdict verdict_;
};

}  // namespace birdseye::host
