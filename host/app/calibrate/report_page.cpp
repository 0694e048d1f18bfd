#include "host/app/calibrate/report_page.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <string_view>

namespace birdseye::host {

namespace {

constexpr const char* kStyle =
    "body{font:16px/1.5 system-ui,sans-serif;max-width:1000px;margin:2rem auto;padding:0 1rem;color:#1c2024;"
    "background:#fff}table{border-collapse:collapse;margin:1rem 0}td,th{padding:.2rem 1rem .2rem 0;text-align:left;"
    "border-bottom:1px solid #dde;font-variant-numeric:tabular-nums}tr.odd{color:#b3261e}figure{margin:1.5rem 0}"
    "img,svg{max-width:100%}figcaption{color:#556;font-size:.9rem}.verdict{padding:.1rem .6rem;border-radius:4px;"
    "color:#fff}.pass{background:#2e7d32}.marginal{background:#b26a00}.fail{background:#b3261e}";

std::string base64(std::string_view bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k)
      word = word << 8 | (k < count ? static_cast<std::uint8_t>(bytes[i + k]) : std::uint32_t{0});
    for (std::size_t k = 0; k < 4; ++k) out += k <= count ? kDigits[word >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

std::string list_of(const std::vector<std::string>& items) {
  std::string out;
  for (const std::string& item : items) out += "<li>" + escape_html(item) + "</li>";
  return "<ul>" + out + "</ul>\n";
}

}  // namespace

std::string escape_html(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

void ReportPage::heading(const std::string& text) {
  body_ += "<h2>" + escape_html(text) + "</h2>\n";
}

void ReportPage::paragraph(const std::string& text) {
  body_ += "<p>" + escape_html(text) + "</p>\n";
}

void ReportPage::table(const std::vector<std::vector<std::string>>& rows) {
  body_ += "<table>";
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const bool odd =
        r > 0 && !rows[r].empty() && (rows[r].back().starts_with("rejected") || rows[r].back().starts_with("outlier"));
    body_ += odd ? "<tr class='odd'>" : "<tr>";
    const char* cell = r == 0 ? "th" : "td";
    for (const std::string& text : rows[r]) body_ += fmt::format("<{0}>{1}</{0}>", cell, escape_html(text));
    body_ += "</tr>\n";
  }
  body_ += "</table>\n";
}

void ReportPage::svg(const std::string& svg, const std::string& caption) {
  body_ += "<figure>" + svg + "<figcaption>" + escape_html(caption) + "</figcaption></figure>\n";
}

void ReportPage::picture(const Picture& picture, const std::string& caption) {
  const std::string png = png_of(picture.rgb, picture.width_px, picture.height_px, 3);
  body_ += fmt::format("<figure><img src='data:image/png;base64,{}' alt='{}'><figcaption>{}</figcaption></figure>\n",
                       base64(png), escape_html(caption), escape_html(caption));
}

std::string ReportPage::html() const {
  std::string page = fmt::format(
      "<!doctype html>\n<html lang='en'><head><meta charset='utf-8'><title>{0}</title><style>{1}</style></head><body>\n"
      "<h1>{0}</h1>\n<p>Verdict: <span class='verdict {2}'>{2}</span></p>\n{3}",
      escape_html(title_), kStyle, name_of(verdict_.grade), list_of(verdict_.reasons));
  if (!verdict_.next_steps.empty()) page += "<p>Next:</p>" + list_of(verdict_.next_steps);
  return page + body_ + "</body></html>\n";
}

}  // namespace birdseye::host
