#include "host/window/banner.hpp"

#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

/// Of an overlay that is whole: what it leaves open, and how far off the target may be.
Banner whole_overlay(const OperationView& operation, const OverlayLook& look) {
  if (look.opacity <= 0) return {words("banner_none", words("banner_opacity"))};
  const auto& target = operation.target;
  const std::string error = target ? words("banner_target", target->error.radius95_mm()) : words("banner_no_target");
  if (look.render.clip) return {words("banner_cut", error)};
  if (!operation.deformed) return {words("banner_unmatched", error)};
  if (!operation.watched) return {words("banner_unwatched", error)};
  if (operation.surface_unchecked) return {words("banner_surface_unchecked", error)};
  if (!operation.surface_told) return {words("banner_surface_untold", error)};
  if (!operation.checked) return {words("banner_unchecked", error)};
  return {words("banner_checked", operation.checked->off_mm, operation.checked->name, error), Grade::pass};
}

/// Before it is said what the picture is of, and by whose files.
Banner plain_banner(const OperationView& operation, const ShownPicture& shown, const OverlayLook& look) {
  if (operation.frozen) return {words("banner_frozen")};
  if (!shown.any) return {shown.reason, Grade::fail};
  if (shown.stale) return {words("banner_stale", shown.reason), Grade::fail};
  if (!operation.patient_fault.empty()) return {words("banner_none", shown.reason), Grade::fail};
  if (shown.overlaid && shown.reason.empty()) return whole_overlay(operation, look);
  if (shown.overlaid) return {words("banner_fades", shown.reason)};
  if (operation.overlay_hidden) return {words("banner_none", shown.reason), std::nullopt};
  return {words("banner_none", shown.reason)};
}

}  // namespace

Banner banner_of(const OperationView& operation, const ShownPicture& shown, const PanelFacts& facts) {
  Banner banner = plain_banner(operation, shown, facts.look);
  if (!operation.not_signed.empty()) {
    if (banner.grade != Grade::fail) banner.grade = Grade::marginal;
    banner.text = words("banner_unsigned", operation.not_signed, banner.text);
  }
  if (facts.recorded) banner.text = words("banner_recording", banner.text);
  if (operation.simulated) banner.text = words("banner_simulated", banner.text);
  return banner;
}

WatchLine watch_line_of(const OperationView& operation) {
  const bool referenced = !operation.reference.empty();
  const std::string reference =
      referenced ? words("watch_reference", operation.reference) : words("watch_no_reference");
  const std::string organ = !operation.watched            ? words("watch_no_organ")
                            : operation.organ_moved       ? words("watch_organ_moved")
                            : operation.surface_unchecked ? words("watch_organ_unchecked")
                            : !operation.surface_told     ? words("watch_organ_untold")
                                                          : words("watch_organ");
  const bool organ_holds = operation.watched && operation.surface_told && !operation.organ_moved;
  return {words("watch", reference, organ), referenced && organ_holds};
}

}  // namespace birdseye::host
