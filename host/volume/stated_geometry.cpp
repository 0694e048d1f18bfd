#include "host/volume/stated_geometry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <fstream>
#include <initializer_list>
#include <sstream>
#include <string_view>
#include <vector>

#include "calibration/base/lower_case.hpp"
#include "host/dicom/refused.hpp"
#include "host/volume/header_fields.hpp"
#include "host/volume/image_file.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

namespace {

/// The numbers of a list as "1 1 2" or "(1,0,0) (0,1,0)"; fewer where one is no number.
std::vector<double> numbers_in(std::string text) {
  for (char& c : text) {
    if (c == '(' || c == ')' || c == ',') c = ' ';
  }
  std::vector<double> numbers;
  std::istringstream words(text);
  for (double number = 0; words >> number;) numbers.push_back(number);
  return numbers;
}

bool are_spacings(const std::vector<double>& numbers) {
  return numbers.size() >= 3 &&
         std::all_of(numbers.begin(), numbers.begin() + 3, [](double mm) { return std::isfinite(mm) && mm > 0; });
}

bool are_place(const std::vector<double>& numbers) {
  return numbers.size() >= 3 &&
         std::all_of(numbers.begin(), numbers.end(), [](double mm) { return std::isfinite(mm); });
}

/// How many of a NRRD's axes have a direction: of "none (0,1,0) (0,0,2)" two, and one that is not finite is none.
int directions_in(const std::string& text) {
  int count = 0;
  for (auto from = text.find('('); from != std::string::npos; from = text.find('(', from + 1)) {
    if (are_place(numbers_in(text.substr(from, text.find(')', from) - from)))) ++count;
  }
  return count;
}

/// The first of these fields that is said a second time with another value; empty where none is.
std::string said_again(const HeaderFields& fields, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    const auto again = fields.find(name + std::string(kAgain));
    if (again == fields.end()) continue;
    return fmt::format("says \"{}\" twice: {} and {}; keep the line that is right, or export it again", name,
                       fields.at(name).substr(0, 80), again->second.substr(0, 80));
  }
  return {};
}

/// Two of these names of one thing that differ by more than `most`; empty where no two do.
std::string two_differ(const HeaderFields& fields, std::initializer_list<const char*> names, double most) {
  const char* first = nullptr;
  for (const char* name : names) {
    const auto found = fields.find(name);
    if (found == fields.end()) continue;
    if (first == nullptr) {
      first = name;
      continue;
    }
    const std::string& text = fields.at(first);
    const auto a = numbers_in(text), b = numbers_in(found->second);
    const bool alike = std::equal(a.begin(), a.end(), b.begin(), b.end(),
                                  [most](double p, double q) { return std::abs(p - q) <= most; });
    if (!alike) {
      return fmt::format("twice, differently: {} {}, {} {}; keep the line that is right, or export it again", first,
                         text.substr(0, 80), name, found->second.substr(0, 80));
    }
  }
  return {};
}

GeometryGaps gaps_of_nrrd(const HeaderFields& fields) {
  static constexpr std::array<std::string_view, 6> kSpaces = {
      "right-anterior-superior", "ras", "left-anterior-superior", "las", "left-posterior-superior", "lps"};
  const auto value = [&fields](const char* name) {
    const auto found = fields.find(name);
    return found == fields.end() ? std::string() : found->second;
  };
  GeometryGaps gaps;
  gaps.beyond = said_again(fields, {"dimension", "sizes", "space", "space dimension", "space directions",
                                    "space origin", "space units", "spacings", "units", "measurement frame"});
  if (!gaps.beyond.empty()) return gaps;
  const std::string space = value("space"), directions = value("space directions");
  if (directions.empty()) {
    if (!are_spacings(numbers_in(value("spacings")))) {
      gaps.spacing =
          "does not say how far apart its voxels are (it has neither \"space directions\" nor \"spacings\" of its "
          "axes)";
    }
    gaps.orientation = "does not say which way its axes point (it has no \"space directions\")";
  } else if (directions_in(directions) < 3) {
    // Its reader takes an axis without a direction for one of 1 mm.
    const std::string which = fmt::format("(its \"space directions\" are {})", directions.substr(0, 80));
    gaps.spacing = fmt::format("does not say how far apart its voxels are along each axis {}", which);
    gaps.orientation = fmt::format("does not say which way each of its axes points {}", which);
  }
  if (space.empty()) {
    gaps.orientation = "does not say which way its axes point (it has no \"space\", as left-posterior-superior)";
  } else if (std::find(kSpaces.begin(), kSpaces.end(), lower_case(space)) == kSpaces.end()) {
    gaps.orientation = fmt::format(
        "does not say which way its axes point (it is in the space \"{}\", which says nothing of the patient)",
        space.substr(0, 80));
  }
  if (!are_place(numbers_in(value("space origin"))))
    gaps.place = "does not say where its first voxel lies (it has no \"space origin\")";
  // The reader passes units over.
  const std::string units = lower_case(value("space units") + " " + value("units"));
  std::string spaced = units;
  std::replace(spaced.begin(), spaced.end(), '"', ' ');
  std::istringstream words(spaced);
  for (std::string unit; words >> unit;) {
    if (unit != "mm" && unit.rfind("millimet", 0) != 0)
      gaps.beyond = fmt::format("has lengths in {}; export it in mm", without_blanks(units).substr(0, 80));
  }
  return gaps;
}

/// Letters of MetaImage's AnatomicalOrientation, which say where axes come from, as those where the axes point to.
std::string turned_letters(const std::string& from) {
  static constexpr std::string_view kFrom = "RLAPIS", kTo = "LRPASI";
  std::string to;
  for (const char letter : from) {
    const auto at = kFrom.find(static_cast<char>(std::toupper(static_cast<unsigned char>(letter))));
    if (at == std::string_view::npos) return {};
    to += kTo[at];
  }
  return to;
}

GeometryGaps gaps_of_meta_image(const HeaderFields& fields) {
  const auto value = [&fields](std::initializer_list<const char*> names) {
    for (const char* name : names) {
      if (const auto found = fields.find(name); found != fields.end()) return found->second;
    }
    return std::string();
  };
  GeometryGaps gaps;
  gaps.beyond = said_again(fields, {"NDims",
                                    "DimSize",
                                    "ElementSpacing",
                                    "ElementSize",
                                    "Offset",
                                    "Position",
                                    "Origin",
                                    "TransformMatrix",
                                    "Rotation",
                                    "Orientation",
                                    "AnatomicalOrientation",
                                    "DistanceUnits",
                                    "ElementToIntensityFunctionSlope",
                                    "ElementToIntensityFunctionOffset",
                                    "HeaderSize",
                                    "ImagePosition",
                                    "ElementType",
                                    "ElementNumberOfChannels",
                                    "BinaryData",
                                    "BinaryDataByteOrderMSB",
                                    "ElementByteOrderMSB",
                                    "CompressedData",
                                    "CompressedDataSize"});
  if (!gaps.beyond.empty()) return gaps;
  // The reader passes units over.
  if (const std::string unit = value({"DistanceUnits"}); !unit.empty() && unit != "?" && lower_case(unit) != "mm") {
    gaps.beyond = fmt::format("has lengths in {} (DistanceUnits); export it in mm", unit.substr(0, 80));
    return gaps;
  }
  const std::string dimensions = value({"NDims"});
  if (dimensions.size() != 1 || dimensions < "1" || dimensions > "9") {
    gaps.beyond = "does not say how many dimensions it has (NDims); export it again";
    return gaps;
  }
  if (dimensions < "3") return gaps;  // a picture, which is refused as such
  const auto apart = numbers_in(value({"ElementSpacing"})), wide = numbers_in(value({"ElementSize"}));
  if (!are_spacings(apart) && !are_spacings(wide)) {
    gaps.spacing = "does not say how far apart its voxels are (it has no ElementSpacing of its axes)";
  } else if (are_spacings(apart) && are_spacings(wide) &&
             !std::equal(apart.begin(), apart.begin() + 3, wide.begin(),
                         [](double a, double b) { return std::abs(a - b) < 1e-3 * a; })) {
    gaps.spacing = fmt::format("says two spacings of its voxels: ElementSpacing {}, ElementSize {}",
                               value({"ElementSpacing"}), value({"ElementSize"}));
  }
  if (const std::string two = two_differ(fields, {"Offset", "Position", "Origin"}, 1e-3); !two.empty()) {
    gaps.beyond = fmt::format("says where its first voxel lies {}", two);
  } else if (!are_place(numbers_in(value({"Offset", "Position", "Origin"})))) {
    gaps.place = "does not say where its first voxel lies (it has no Offset)";
  }
  if (const std::string two = two_differ(fields, {"TransformMatrix", "Rotation", "Orientation"}, 1e-4); !two.empty())
    gaps.beyond = fmt::format("says which way its axes point {}", two);
  const auto turn = numbers_in(value({"TransformMatrix", "Rotation", "Orientation"}));
  if (turn.empty()) {
    gaps.orientation = "does not say which way its axes point (it has no TransformMatrix)";
    return gaps;
  }
  const std::string letters = turned_letters(value({"AnatomicalOrientation"}));
  if (turn.size() != 9 || !axes_of_letters(letters)) return gaps;
  Eigen::Affine3d axes = Eigen::Affine3d::Identity();
  axes.linear() = Eigen::Matrix3d::Map(turn.data());
  if (const std::string by_turn = orientation_letters(axes); by_turn != letters) {
    gaps.orientation = fmt::format("says two orientations: {} by its TransformMatrix, {} by its AnatomicalOrientation",
                                   by_turn, letters);
  }
  return gaps;
}

std::string mm_of(const Eigen::Vector3d& mm) {
  return fmt::format("{:.4g} x {:.4g} x {:.4g} mm", mm.x(), mm.y(), mm.z());
}

enum class TextForm { none, nrrd, meta_image };

struct TextHeader {
  TextForm form = TextForm::none;
  HeaderFields fields;
};

TextHeader text_header(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string first(4, '\0');
  file.read(first.data(), static_cast<std::streamsize>(first.size()));
  if (first == "NRRD") return {TextForm::nrrd, nrrd_fields(file)};
  const std::string ending = lower_case(path.extension().string());
  if (ending != ".mha" && ending != ".mhd") return {};
  file.clear();
  file.seekg(0);
  return {TextForm::meta_image, meta_image_header(file).fields};
}

/// Of the first of these fields that the header has: what it says of three numbers, the first of them at `from`, that
/// were read as others, further off than `most`; empty where they were read so.
std::string misread_field(const HeaderFields& fields, std::initializer_list<const char*> names, std::size_t from,
                          const Eigen::Vector3d& read, double most) {
  const auto* const name = std::find_if(names.begin(), names.end(), [&](auto key) { return fields.contains(key); });
  if (name == names.end()) return {};
  const std::string& text = fields.at(*name);
  const auto numbers = numbers_in(text);
  if (numbers.size() < from + 3) return {};
  if ((Eigen::Vector3d::Map(numbers.data() + from) - read).cwiseAbs().maxCoeff() <= most) return {};
  return fmt::format(
      "says {} {} in its header, of which {:.6g} {:.6g} {:.6g} is read: the header is not written as "
      "MetaImage wants it; export it again by a program that writes it, as 3D Slicer",
      *name, text.substr(0, 80), read.x(), read.y(), read.z());
}

}  // namespace

GeometryGaps text_header_gaps(const std::filesystem::path& path) {
  const TextHeader header = text_header(path);
  if (header.form == TextForm::nrrd) return gaps_of_nrrd(header.fields);
  return header.form == TextForm::meta_image ? gaps_of_meta_image(header.fields) : GeometryGaps();
}

std::string misread_geometry(const std::filesystem::path& path, const ImageFile& image) {
  const auto [form, fields] = text_header(path);
  const std::string dimensions = field_of(fields, "NDims");
  if (form != TextForm::meta_image || dimensions.empty()) return {};
  // A spacing or a direction is read as it is written; of names of one place that differ by a rounding one is read.
  constexpr double kSpacing_mm = 1e-5, kPlace_mm = 1e-3, kDirection = 1e-4;
  std::string told = misread_field(fields, {"ElementSpacing", "ElementSize"}, 0, image.spacing_mm, kSpacing_mm);
  if (told.empty()) told = misread_field(fields, {"Offset", "Position", "Origin"}, 0, image.origin_mm, kPlace_mm);
  const auto row = static_cast<std::size_t>(dimensions[0] - '0');
  for (int axis = 0; axis < 3 && told.empty(); ++axis) {
    told = misread_field(fields, {"TransformMatrix", "Rotation", "Orientation"}, row * static_cast<std::size_t>(axis),
                         image.axes.col(axis), kDirection);
  }
  return told;
}

std::string turned_vectors(const std::filesystem::path& path) {
  const auto [form, fields] = text_header(path);
  if (form != TextForm::nrrd) return {};
  const std::string space = field_of(fields, "space"), frame = field_of(fields, "measurement frame");
  if (lower_case(space) != "left-posterior-superior" && lower_case(space) != "lps") {
    return fmt::format(
        "is a displacement field in the space \"{}\", whose vectors would be taken for left-posterior-superior ones; "
        "write it in the space left-posterior-superior, the vectors too, as ITK and 3D Slicer do",
        space.substr(0, 80));
  }
  if (frame.empty()) return {};
  const auto numbers = numbers_in(frame);
  constexpr double kRounding = 1e-6;
  if (numbers.size() == 9 && Eigen::Matrix3d::Map(numbers.data()).isIdentity(kRounding)) return {};
  return fmt::format(
      "is a displacement field with the \"measurement frame\" {}, by which its vectors are not turned; write the "
      "vectors in left-posterior-superior, without that line",
      frame.substr(0, 80));
}

Result<void> check_stated(const VolumeSource& source, GeometryFrom from, const GeometryGaps& gaps) {
  const auto& path = source.path;
  if (!gaps.beyond.empty()) return refused(Errc::bad_format, path, gaps.beyond);
  const auto judge = [&](const std::string& gap, bool stated, const char* what, const char* option) -> Result<void> {
    if (stated && gap.empty()) {
      return refused(Errc::bad_value, path, fmt::format("says {} itself: leave {} out", what, option));
    }
    if (stated || gap.empty()) return {};
    return refused(Errc::bad_format, path,
                   fmt::format("{}; export it again by a program that writes it, as 3D Slicer{}", gap,
                               from == GeometryFrom::file ? "" : fmt::format(", or state it: {}", option)));
  };
  const bool in_case = source.stated.in_case;
  const bool spaced = source.stated.spacing_mm.has_value(), turned = !source.stated.orientation.empty();
  if (auto known = judge(gaps.spacing, spaced, "how far apart its voxels are",
                         in_case ? "spacing = [x, y, z] (mm) in [volume] of the case" : "--spacing x,y,z (mm)");
      !known) {
    return known;
  }
  return judge(gaps.orientation, turned, "which way its axes point",
               in_case ? "orientation = \"LPS\", or what it is, in [volume] of the case"
                       : "--orientation, as --orientation LPS");
}

std::vector<std::string> options_of(const StatedGeometry& stated) {
  std::vector<std::string> out;
  if (const auto& mm = stated.spacing_mm) out = {"--spacing", fmt::format("{},{},{}", mm->x(), mm->y(), mm->z())};
  if (!stated.orientation.empty()) out.insert(out.end(), {"--orientation", stated.orientation});
  return out;
}

void put_stated(const VolumeSource& source, const VoxelPlace* place, ImageFile& image) {
  if (source.stated.spacing_mm) {
    image.spacing_mm = *source.stated.spacing_mm;
    image.notes.push_back(
        fmt::format("its spacing, {}, was stated by a person ({}): the file does not say it, or says two",
                    mm_of(image.spacing_mm), source.stated.in_case ? "in the case" : "--spacing"));
  }
  if (source.stated.orientation.empty()) return;
  if (place != nullptr) {
    image.axes = place->axes;
    image.origin_mm = place->origin_mm;
  } else {
    image.axes = *axes_of_letters(source.stated.orientation);
    image.origin_mm.setZero();
  }
  image.notes.push_back(fmt::format(
      "its orientation, {}, was stated by a person ({}): {}", source.stated.orientation,
      source.stated.in_case ? "in the case" : "--orientation",
      place != nullptr ? "the file says two"
                       : "the file does not say it, nor where the patient's origin is, which is taken to be "
                         "the first voxel"));
}

}  // namespace birdseye::host
