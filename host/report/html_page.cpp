#include "host/report/html_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <string_view>

#include "host/report/svg.hpp"

namespace birdseye::host {

namespace {

constexpr const char* kStyle =
    "body{font:16px/1.5 system-ui,sans-serif;max-width:1000px;margin:2rem auto;padding:0 1rem;color:#1c2024;"
    "background:#fff}h1{margin-bottom:1rem}h2{margin-top:2.5rem}table{border-collapse:collapse;margin:1rem 0}"
    "td,th{padding:.2rem 1rem .2rem 0;text-align:left;vertical-align:top;border-bottom:1px solid #dde;"
    "font-variant-numeric:tabular-nums}tr.odd{color:#b3261e}figure{margin:1.5rem 0}img,svg,video{max-width:100%;"
    "height:auto}img.half{width:49.5%}figcaption{color:#556;font-size:.9rem}.verdict{padding:.6rem 1rem;"
    "border-left:10px solid;border-radius:4px;background:#f4f6f8}.verdict>b{font-size:1.2rem}.verdict ul{margin:.2rem "
    "0;"
    "padding-left:1.2rem;color:#1c2024}.verdict p{margin:.6rem 0 0;color:#1c2024}.pass{color:#2e7d32}"
    ".marginal{color:#b26a00}.fail{color:#b3261e}";

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
  for (const std::string& item : items) out += "<li>" + escape_markup(item) + "</li>";
  return "<ul>" + out + "</ul>\n";
}

}  // namespace

std::string data_url(const Picture& picture) {
  return "data:image/png;base64," + base64(png_of(picture.view()));
}

void HtmlPage::heading(const std::string& text) {
  std::string capital = text;
  if (!capital.empty()) capital[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(capital[0])));
  body_ += "<h2>" + escape_markup(capital) + "</h2>\n";
}

void HtmlPage::paragraph(const std::string& text) {
  body_ += "<p>" + escape_markup(text) + "</p>\n";
}

void HtmlPage::table(const std::vector<std::vector<std::string>>& rows) {
  body_ += "<table>";
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const bool odd =
        r > 0 && !rows[r].empty() && (rows[r].back().starts_with("rejected") || rows[r].back().starts_with("outlier"));
    body_ += odd ? "<tr class='odd'>" : "<tr>";
    const char* cell = r == 0 ? "th" : "td";
    for (const std::string& text : rows[r]) body_ += fmt::format("<{0}>{1}</{0}>", cell, escape_markup(text));
    body_ += "</tr>\n";
  }
  body_ += "</table>\n";
}

void HtmlPage::figure(const std::string& content, const std::string& caption) {
  body_ += "<figure>" + content + "<figcaption>" + escape_markup(caption) + "</figcaption></figure>\n";
}

void HtmlPage::svg(const std::string& svg, const std::string& caption) {
  figure(svg, caption);
}

void HtmlPage::picture(const Picture& picture, const std::string& caption) {
  figure(fmt::format("<img src='{}' alt='{}'>", data_url(picture), escape_markup(caption)), caption);
}

void HtmlPage::picture_files(const std::vector<std::string>& files, const std::string& caption) {
  std::string images;
  for (const std::string& file : files)
    images +=
        fmt::format("<img {0}src='{1}' alt='{1}'>\n", files.size() > 1 ? "class='half' " : "", escape_markup(file));
  figure(images, caption);
}

void HtmlPage::film_file(const std::string& file, const std::string& caption) {
  figure(fmt::format("<video src='{}' controls loop muted></video>", escape_markup(file)), caption);
}

std::string HtmlPage::html() const {
  std::string verdict =
      fmt::format("<div class='verdict {0}'><b>{0}</b>{1}", name_of(verdict_.grade), list_of(verdict_.reasons));
  if (!verdict_.next_steps.empty()) verdict += "<p>Next:</p>" + list_of(verdict_.next_steps);
  return fmt::format(
      "<!doctype html>\n<html lang='en'><head><meta charset='utf-8'><title>{0}</title><style>{1}</style></head><body>\n"
      "<h1>{0}</h1>\n{2}</div>\n{3}</body></html>\n",
      escape_markup(title_), kStyle, verdict, body_);
}

}  // namespace birdseye::host
