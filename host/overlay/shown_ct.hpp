#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/overlay/margins.hpp"
#include "host/volume/label_names.hpp"
#include "host/volume/volume.hpp"
#include "host/volume/volume_source.hpp"

namespace birdseye::host {

/// What of a CT is to be drawn.
struct ShownChoice {
  std::filesystem::path labels;        ///< a segmentation on the CT's grid; empty: all of the CT is drawn
  std::vector<LabelChoice> keep;       ///< labels to draw, by name or number; empty: all of the CT is drawn
  std::vector<LabelChoice> margin_of;  ///< labels about which shells are drawn
  std::vector<double> margins_mm;      ///< how far the shells lie from them; empty: none are drawn
  bool summed = false;                 ///< asks for the sums of what is read, to compare with an operation's
};

/// A CT to draw.
struct ShownCt {
  Volume volume;
  std::optional<Margins> margins;
  std::vector<std::string> notes;  ///< what its reader should know, a line each
  std::string ct_sha256{};         ///< of all of the CT; where it was asked for
  std::string labels_sha256{};     ///< of their files; empty where there are none
};

/// Errors name the file. Errc::bad_value where a choice needs a segmentation and none is named.
/// check: of all of the CT, whatever of it is to be drawn; an error of it is given back.
Result<ShownCt> read_shown(const VolumeSource& source, const ShownChoice& choice,
                           const std::function<Result<void>(const Volume&)>& check = nullptr);

}  // namespace birdseye::host
