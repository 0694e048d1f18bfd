#include "host/app/overlay_options.hpp"

namespace birdseye::host {

void add_shown_options(CLI::App& command, ShownChoice& choice) {
  CLI::Option* const labels =
      command.add_option("--labels", choice.labels, "its segmentation: DICOM SEG, or labels on the CT's grid")
          ->type_name("FILE");
  CLI::Option* const keep =
      command.add_option("--keep,--show", choice.keep, "the labels to show, by name or number")->delimiter(',');
  CLI::Option* const margin_of =
      command.add_option("--margin-of", choice.margin_of, "labels about which --margins are drawn, as the tumour's")
          ->delimiter(',');
  command.add_option("--margins", choice.margins_mm, "shells so many mm from what --margin-of names, up to four: 5,10")
      ->delimiter(',')
      ->type_name("MM")
      ->needs(margin_of)
      ->needs(labels);
  keep->needs(labels);
}

std::vector<CLI::Option*> add_look_options(CLI::App& command, OverlayLook& look) {
  return {command.add_option("--opacity", look.opacity, "of what is drawn over a picture (default 1)")
              ->check(CLI::Range(0.0, 1.0)),
          command.add_flag("--surface-in-front", look.surface_in_front,
                           "the video's edges and highlights stay before what is drawn, which so reads as inside"),
          command.add_flag_callback(
              "--outlines", [&look] { look.style = OverlayStyle::outlines; },
              "draw the outlines of structures alone, so that the video stays free within"),
          command
              .add_option("--hole", look.hole_radius,
                          "draw within a round hole about the picture's middle alone; its radius as a part of the "
                          "picture's height")
              ->check(CLI::Range(0.05, 1.0))};
}

}  // namespace birdseye::host
