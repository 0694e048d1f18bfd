#include "host/operation/replay_hardware.hpp"

#include <algorithm>
#include <utility>

#include "calibration/record/identity.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

ReplayHardware::ReplayHardware(std::vector<ReplayBinding> bindings, Instruments first_told, bool by_own_record)
    : bindings_(std::move(bindings)), told_(std::move(first_told)), by_own_record_(by_own_record) {
  judge();
}

void ReplayHardware::take(const wire::Event& event) {
  if (const auto* health = std::get_if<wire::Health>(&event)) {
    take_identities(*health, told_);
    judge();
  }
  const auto* told = std::get_if<wire::Calibration>(&event);
  if (told == nullptr || !by_own_record_) return;
  // Before the first time that it is in force, the appliance has no other.
  was_in_force_ = was_in_force_ || told->in_force;
  withdrawn_.clear();
  if (told->in_force || !was_in_force_) return;
  withdrawn_ = told->why_not.empty() ? words("why_withdrawn") : words("why_withdrawn_for", told->why_not);
  remedy_ = "give a record that holds for these frames (--calibration)";
}

void ReplayHardware::judge() {
  misfit_.clear();
  for (const ReplayBinding& binding : bindings_) {
    judge(binding, "tracker", binding.found_with.tracker, told_.tracker);
    if (binding.depends_on == DependsOn::tracker_and_camera)
      judge(binding, "camera", binding.found_with.camera, told_.camera);
  }
}

void ReplayHardware::judge(const ReplayBinding& binding, const std::string& what, const calibration::Identity& found,
                           const calibration::Identity& told) {
  if (found.empty() || told.empty()) {
    const std::string note = words("why_unproven", binding.of, what);
    if (std::find(unproven_.begin(), unproven_.end(), note) == unproven_.end()) unproven_.push_back(note);
    return;
  }
  if (!misfit_.empty()) return;
  misfit_ = calibration::misfit(what, found, told, binding.of);
  if (!misfit_.empty()) remedy_ = binding.remedy;
}

}  // namespace birdseye::host
