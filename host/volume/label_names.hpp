#pragma once

#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/dicom/dicom_labels.hpp"

namespace birdseye::host {

/// A label as somebody asks for it: its number or its name.
struct LabelChoice {
  std::string text;

  LabelChoice(int number) : text(std::to_string(number)) {}   // NOLINT(google-explicit-constructor)
  LabelChoice(std::string named) : text(std::move(named)) {}  // NOLINT(google-explicit-constructor)
  LabelChoice(const char* named) : text(named) {}             // NOLINT(google-explicit-constructor)
  LabelChoice() = default;
};

/// Several choices as one.
std::vector<LabelChoice> all_of(std::initializer_list<std::vector<LabelChoice>> choices);
/// "1, liver".
std::string joined(std::span<const LabelChoice> labels, std::string_view between = ", ");

/// Whether it is asked for by that: its number, or its name, of which capitals count as small letters, blanks and
/// hyphens as underscores.
bool is_chosen(const LabelChoice& choice, const NamedLabel& label);

/// The values of the voxels that belong to one of these. Of names, capitals count as small
/// letters, blanks and hyphens as underscores. Where a segmentation has no list of its labels, names are those of
/// TotalSegmentator 2 (totalsegmentator_names). Errc::not_found names the first that is none, and some that are.
/// notes: gets a line for each name that was taken to be TotalSegmentator's, which whoever sees the structure has to be
/// told.
Result<std::vector<int>> values_of_labels(const std::vector<NamedLabel>& names, std::span<const LabelChoice> wanted,
                                          std::vector<std::string>* notes);

}  // namespace birdseye::host
