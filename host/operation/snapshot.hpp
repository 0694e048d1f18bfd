#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "device/wire/messages.hpp"
#include "host/operation/findings.hpp"
#include "host/operation/patient.hpp"
#include "host/overlay/live_picture.hpp"
#include "host/render/scene/transfer_function.hpp"

namespace birdseye::host {

/// All that a picture in the window was made of.
struct Snapshot {
  wire::VideoFrame frame;
  std::vector<std::uint8_t> picture;  ///< RGB, as it was shown
  ShownPicture shown;                 ///< but for its pixels
  PictureHardware taken_with;
  std::optional<Setup> setup;                                     ///< empty: nothing was registered
  std::optional<Transform<Camera, Patient>> camera_from_patient;  ///< empty: nothing was drawn
  OverlayLook look;
  std::string engine;
  std::shared_ptr<const TransferFunction> transfer;
  PatientFiles patient;
  std::shared_ptr<const DeformedOrgan> deformed;  ///< null: the CT as it was taken
  std::optional<double> fre_mm;
  std::string not_signed;                   ///< what no known machine signed, as OperationView has it
  std::optional<PatientIdentity> identity;  ///< empty: the snapshot is not to name the patient
};

/// In folder, which it makes: video.png as it came, picture.png as it was shown, and, where the CT was drawn, what it
/// was drawn by, with snapshot.json holding the figures and the arguments by which `birdseye render` draws it again.
Result<void> write_snapshot(const std::filesystem::path& folder, const Snapshot& snapshot);

/// What the snapshot says that the picture was taken with. Nothing of a picture that is no snapshot's; refuses a sheet
/// that cannot be read.
Result<PictureHardware> read_taken_with(const std::filesystem::path& picture);

}  // namespace birdseye::host
