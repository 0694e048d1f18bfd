#include "host/volume/series_list.hpp"

#include <nlohmann/json.hpp>
#include <optional>

#include "host/volume/decode.hpp"
#include "host/volume/decoder_process.hpp"

namespace birdseye::host {

namespace {

nlohmann::json json_of(const SeriesInfo& info) {
  nlohmann::json axes = nlohmann::json::array();
  for (int i = 0; i < 9; ++i) axes.push_back(info.axes(i));
  return {{"id", info.id},
          {"uid", info.uid},
          {"description", info.description},
          {"modality", info.modality},
          {"date", info.date},
          {"time", info.time},
          {"agent", info.agent},
          {"phase", info.phase},
          {"part", info.part},
          {"syntax", info.syntax},
          {"size", info.size},
          {"spacing_mm", {info.spacing_mm.x(), info.spacing_mm.y(), info.spacing_mm.z()}},
          {"axes", axes},
          {"problem", info.problem},
          {"passed_over", info.passed_over}};
}

SeriesInfo info_from(const nlohmann::json& json) {
  SeriesInfo info;
  for (const auto& [key, text] : {std::pair{"id", &info.id},
                                  {"uid", &info.uid},
                                  {"description", &info.description},
                                  {"modality", &info.modality},
                                  {"date", &info.date},
                                  {"time", &info.time},
                                  {"agent", &info.agent},
                                  {"phase", &info.phase},
                                  {"part", &info.part},
                                  {"syntax", &info.syntax},
                                  {"problem", &info.problem}}) {
    *text = json.at(key).get<std::string>();
  }
  info.size = json.at("size").get<std::array<int, 3>>();
  const auto spacing = json.at("spacing_mm").get<std::array<double, 3>>();
  info.spacing_mm = {spacing[0], spacing[1], spacing[2]};
  const auto axes = json.at("axes").get<std::array<double, 9>>();
  info.axes = Eigen::Matrix3d::Map(axes.data());
  info.passed_over = json.at("passed_over").get<bool>();
  return info;
}

std::optional<SeriesList> list_from(const std::string& text) {
  try {
    const auto json = nlohmann::json::parse(text);
    SeriesList list;
    for (const auto& one : json.at("series")) list.series.push_back(info_from(one));
    if (list.series.empty()) return std::nullopt;
    list.unreadable = json.at("unreadable").get<std::vector<std::string>>();
    return list;
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;  // what the decoder sends is not to be trusted
  }
}

}  // namespace

bool holds_dicom(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_directory(path, error) || begins_as_dicom(path);
}

Result<SeriesList> list_series(const VolumeSource& source) {
  if (auto there = check_can_be_opened(source.path); !there) return there.error();
  const auto work = [&source](const Announce& announce, std::span<ProcessCopy>) -> Result<SendDecoded> {
    const auto scan = scan_dicom(source, announce);
    if (!scan) return scan.error();
    nlohmann::json json{{"series", nlohmann::json::array()}, {"unreadable", nlohmann::json::array()}};
    for (const Series& series : scan->series) json["series"].push_back(json_of(series.info));
    for (const Error& unreadable : scan->tree.unreadable) json["unreadable"].push_back(unreadable.what);
    // Names of files need not be UTF-8.
    std::string text = json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    return SendDecoded([text = std::move(text)](const Send& send) { send_long_text(send, text); });
  };
  std::optional<SeriesList> list;
  const auto take = [&list](const Receive& receive) {
    const auto text = receive_long_text(receive);
    if (text) list = list_from(*text);
    return list.has_value();
  };
  if (auto ran = run_decoder(source.path, {}, work, take); !ran) return ran.error();
  return *std::move(list);
}

}  // namespace birdseye::host
