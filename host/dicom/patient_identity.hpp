#pragma once

#include <string>

namespace birdseye::host {

/// Whose CT it is, as its files say. UTF-8, one line each; empty where the files do not say.
struct PatientIdentity {
  std::string name;        ///< "Phantom, Abdomen"
  std::string id;          ///< of the hospital that made the CT
  std::string birth_date;  ///< 1970-01-31
  std::string ct_date;     ///< when the CT was taken

  /// Whether the files say whose CT it is.
  [[nodiscard]] bool known() const { return !name.empty() || !id.empty(); }
  bool operator==(const PatientIdentity&) const = default;
};

/// Whose coordinates the places of an image are, as its DICOM files say; empty where they do not say, or are none.
struct PatientFrame {
  std::string patient_id;
  std::string uid;              ///< of the frame of reference, which all images of one position of the patient share
  std::string series_uid = {};  ///< of the images
  std::string patient_name = {};
};

/// A person's name (DICOM PS3.5, value representation PN) as people write it: "Family, Prefix Given Middle Suffix", of
/// the first of its spellings.
std::string person_name(const std::string& dicom_name);
/// Whether two names that people write are of one person, whatever their capitals, blanks and commas.
bool same_name(const std::string& one, const std::string& other);
/// A date (value representation DA) with dashes; empty where it is none.
std::string dashed_date(const std::string& dicom_date);

}  // namespace birdseye::host
