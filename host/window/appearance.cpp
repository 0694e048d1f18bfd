#include "host/window/appearance.hpp"

#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "host/volume/patient_box.hpp"

namespace birdseye::host {

namespace {

constexpr double kMostExtinction = 2.5;  // per mm, at the chart's upper edge

/// Where HU and extinction lie in the chart, and back. Extinction goes with the square of the height: what is faint has
/// room.
struct Chart {
  ImVec2 from, size;

  [[nodiscard]] ImVec2 at(double hu, double extinction) const {
    const double x = (hu - HuHistogram::kLowestHu) / (HuHistogram::kHighestHu - HuHistogram::kLowestHu);
    const double y = std::sqrt(std::clamp(extinction / kMostExtinction, 0.0, 1.0));
    return {from.x + size.x * static_cast<float>(std::clamp(x, 0.0, 1.0)),
            from.y + size.y * (1 - static_cast<float>(y))};
  }
  [[nodiscard]] double hu(float x) const {
    return HuHistogram::kLowestHu +
           (HuHistogram::kHighestHu - HuHistogram::kLowestHu) * std::clamp((x - from.x) / size.x, 0.0F, 1.0F);
  }
  [[nodiscard]] double extinction(float y) const {
    const double part = std::clamp(1 - (y - from.y) / size.y, 0.0F, 1.0F);
    return kMostExtinction * part * part;
  }
};

ImU32 colour_of(const TransferPoint& point) {
  return ImGui::GetColorU32(ImVec4(static_cast<float>(point.rgb.x()), static_cast<float>(point.rgb.y()),
                                   static_cast<float>(point.rgb.z()), 1));
}

}  // namespace

HuHistogram::HuHistogram(const Volume& volume) {
  std::vector<std::size_t> counts(kBins, 0);
  // Of some millions the shape is the same, and the window waits for it. A prime number meets every column.
  const std::size_t every = volume.hu.size() > 10'000'000 ? 31 : 1;
  for (std::size_t voxel = 0; voxel < volume.hu.size(); voxel += every) {
    const double part = (volume.hu[voxel] - kLowestHu) / (kHighestHu - kLowestHu);
    if (part >= 0 && part < 1) ++counts[static_cast<std::size_t>(part * static_cast<double>(kBins))];
  }
  const auto most = static_cast<float>(std::max<std::size_t>(1, *std::max_element(counts.begin(), counts.end())));
  for (std::size_t i = 0; i < kBins; ++i) heights_[i] = std::sqrt(static_cast<float>(counts[i]) / most);
}

ClipPlane clip_plane(const CuttingPlane& plane, const Volume& volume) {
  const PatientBox box = patient_box(volume);
  const double low_mm = box.low_mm[plane.axis], high_mm = box.high_mm[plane.axis];
  ClipPlane out;
  out.normal = Eigen::Vector3d::Unit(plane.axis);
  out.offset_mm = low_mm + plane.part * (high_mm - low_mm);
  return out;
}

void TransferEditor::set_points(std::vector<TransferPoint> points) {
  points_ = std::move(points);
  chosen_ = 0;
}

std::optional<std::vector<TransferPoint>> TransferEditor::draw(const HuHistogram& histogram, float scale) {
  const Chart chart{ImGui::GetCursorScreenPos(), ImVec2(ImGui::GetContentRegionAvail().x, 110 * scale)};
  ImDrawList* const list = ImGui::GetWindowDrawList();
  const ImVec2 to(chart.from.x + chart.size.x, chart.from.y + chart.size.y);
  list->AddRectFilled(chart.from, to, IM_COL32(24, 26, 28, 255));
  const float bar = chart.size.x / static_cast<float>(HuHistogram::kBins);
  for (std::size_t i = 0; i < HuHistogram::kBins; ++i) {
    const float x = chart.from.x + bar * static_cast<float>(i);
    list->AddRectFilled(ImVec2(x, to.y - chart.size.y * histogram.heights()[i]), ImVec2(x + bar, to.y),
                        IM_COL32(70, 76, 82, 255));
  }
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const ImVec2 here = chart.at(points_[i].hu, points_[i].extinction_per_mm);
    if (i > 0) {
      list->AddLine(chart.at(points_[i - 1].hu, points_[i - 1].extinction_per_mm), here, IM_COL32(220, 220, 220, 255),
                    1.5F * scale);
    }
    list->AddCircleFilled(here, 6 * scale, colour_of(points_[i]));
    list->AddCircle(here, 6 * scale, i == chosen_ ? IM_COL32(255, 255, 255, 255) : IM_COL32(0, 0, 0, 255), 0,
                    1.5F * scale);
  }
  ImGui::InvisibleButton("transfer function", chart.size);
  const ImVec2 mouse = ImGui::GetIO().MousePos;
  if (ImGui::IsItemActivated()) {
    const auto distance = [&](const TransferPoint& point) {
      const ImVec2 at = chart.at(point.hu, point.extinction_per_mm);
      return std::hypot(at.x - mouse.x, at.y - mouse.y);
    };
    const auto nearest = std::min_element(points_.begin(), points_.end(),
                                          [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
    if (nearest != points_.end()) chosen_ = static_cast<std::size_t>(nearest - points_.begin());
  }
  if (ImGui::IsItemActive() && ImGui::IsMouseDragging(ImGuiMouseButton_Left, 1) && chosen_ < points_.size()) {
    // Between its neighbours: points stay in order of HU.
    const double low = chosen_ > 0 ? points_[chosen_ - 1].hu + 1 : TransferFunction::kLowestHu;
    const double high = chosen_ + 1 < points_.size() ? points_[chosen_ + 1].hu - 1 : TransferFunction::kHighestHu;
    points_[chosen_].hu = std::clamp(chart.hu(mouse.x), low, std::max(low, high));
    points_[chosen_].extinction_per_mm = chart.extinction(mouse.y);
    dragged_ = true;
  }
  bool changed = ImGui::IsItemDeactivated() && dragged_;
  if (chosen_ < points_.size()) {
    const Eigen::Vector3f now = points_[chosen_].rgb.cast<float>();
    float rgb[3] = {now.x(), now.y(), now.z()};
    if (ImGui::ColorEdit3("colour", rgb, ImGuiColorEditFlags_NoInputs)) {
      points_[chosen_].rgb = Eigen::Vector3f(rgb[0], rgb[1], rgb[2]).cast<double>();
      changed = true;
    }
    ImGui::SameLine();
    ImGui::AlignTextToFramePadding();
    ImGui::Text("%.0f HU", points_[chosen_].hu);
  }
  if (!changed) return std::nullopt;
  dragged_ = false;
  return points_;
}

}  // namespace birdseye::host
