#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "device/wire/messages.hpp"
#include "host/files/film.hpp"
#include "host/operation/decision_log.hpp"
#include "host/operation/replay_setup.hpp"
#include "host/overlay/frame_painter.hpp"
#include "host/overlay/video_watch.hpp"

namespace birdseye::host {

/// Where replayed frames go, and how finely they are drawn.
struct ReplayOutput {
  std::filesystem::path folder;
  int every = 10;      ///< of the frames, one in so many is written as a picture
  double film_hz = 0;  ///< 0: no film
  OverlayLook look;
  std::string scope = "scope";  ///< its bird
  bool motion_check = true;     ///< nothing is drawn over video that does not move as the poses say
  bool error_known = true;      ///< else the table says nothing of the expected error
  /// What the live window decided then, by the frames' numbers.
  std::map<std::uint64_t, LoggedDecision> live;
};

/// What became of the frames so far.
struct Replayed {
  std::size_t frames = 0, overlaid = 0, whole = 0, other_size = 0;
  std::size_t pictures = 0;        ///< that were written
  std::size_t other_hardware = 0;  ///< of which the setup does not hold with the instruments
  std::map<std::string, std::size_t> reasons;
  bool video_told = false;     ///< whether the video has shown anything of whether it moves as the poses say
  std::uint32_t checksum = 0;  ///< CRC-32 of all pictures' pixels in order
  std::string table =
      "sequence,acquired_ns,pose,strength,reason,expected_mm,circle_mm,live_strength,live_reason,live_said,camera_from_"
      "patient\n";
};

/// How many frames there are for each reason, whatever figures it gives: reasons that differ in figures alone are one,
/// with ".." in the place of each.
std::map<std::string, std::size_t> alike_reasons(const std::map<std::string, std::size_t>& reasons);

/// Draws every frame of a recording, writes some as pictures and, where asked, all as a film.
class ReplayPlayer {
 public:
  /// margins: as the engine has the CT deformed; empty: there are none.
  ReplayPlayer(ReplayOutput output, const ReplaySetup& setup, const TrustFigures& figures, Engine& engine,
               std::optional<Margins> margins = std::nullopt);

  /// The poses of the scope tell how they scatter.
  void take(const wire::Birds& birds);
  /// Fails where a picture or the film cannot be written. other_hardware: why the setup does not hold with the
  /// instruments that the frame is of; empty where it does.
  Result<void> take(const wire::VideoFrame& frame, const std::string& other_hardware = {});
  /// Ends the film.
  Result<void> finish();

  [[nodiscard]] const Replayed& done() const { return done_; }

 private:
  ReplayOutput output_;
  Engine& engine_;
  [[nodiscard]] std::string row_of(const wire::VideoFrame& frame, const OverlayGate::Decision& decision,
                                   const std::optional<FramePainter::Painted>& painted) const;
  void watch(const wire::VideoFrame& frame);
  OverlayGate::Decision decide(const wire::VideoFrame& frame, const std::string& other_hardware);

  ScopeSetup scope_;
  VideoWatch video_;
  FramePainter painter_;
  bool held_back_ = false;
  std::optional<Film> film_;
  Replayed done_;
};

}  // namespace birdseye::host
