#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "host/operation/findings.hpp"
#include "host/operation/live_step.hpp"
#include "host/operation/step_states.hpp"
#include "host/registration/rigid/touch_detector.hpp"

namespace birdseye::host {

/// The registration of the patient by fiducials that the pointer touches.
class FiducialStep {
 public:
  /// One more; false: all that are wanted are touched (wanted 0: as many as come), and the fit asks for none. fit() is
  /// due then. Where what was touched before is held back, in doubt or suspected, a new touch begins anew: a fit is of
  /// touches of one setup.
  /// found_with: by which it was touched.
  bool add(const Touch& touch, std::size_t wanted, const Instruments& found_with);
  /// One is taken back, from 0; false: there is none. fit() is due then.
  bool take_back(std::size_t which);
  /// By the markers of the CT, empty as long as they are looked for. Three give a fit, one more, and as many as are
  /// wanted, make it done.
  /// Refuses, as fault(), touches that are mirrored or of another scale, and markers outside of the CT. ct: null where
  /// there is none.
  void fit(const std::optional<std::vector<Eigen::Vector3d>>& markers_in_patient_mm, std::size_t wanted,
           const Volume* ct);
  /// What is held back was to be fitted anew, as where a marker was dropped, and is back.
  [[nodiscard]] bool fit_is_due() const { return fit_is_due_ && !held_back_ && !touches_.empty(); }
  /// An earlier window's registration, which counts for nothing before confirm(): patient or transmitter may have been
  /// moved meanwhile. Not where fiducials were touched anew; false then. Touches too few for a fit are dropped.
  bool take_up(const std::optional<RegisteredPatient>& kept, const std::string& when);
  /// Somebody has looked, and the registration holds.
  void confirm() {
    confirmed_ = true;
    suspected_ = false;
  }
  /// Something may have moved since the first touch, or since it was confirmed.
  void suspect() {
    if (!suspected_) touches_precede_suspicion_ = suspected_ = registered_ || !touches_.empty();
  }
  [[nodiscard]] bool suspected() const { return suspected_; }
  /// The next touch drops the earlier ones: something spoke against them since, and they may be of another setup.
  [[nodiscard]] bool begins_anew() const {
    return !confirmed_ || (suspected_ && touches_precede_suspicion_ && !held_back_ && !touches_.empty());
  }
  /// Whether the registration holds is to be looked at anew; touches that gave none yet are dropped.
  void doubt();
  /// Holds back, touches and all, what was found with another tracker, and gives it back where that has come again.
  /// True: what is registered is no more what it was.
  bool judge(const ConnectedInstruments& connected);

  [[nodiscard]] const std::vector<TouchedFiducial>& touches() const { return touches_; }
  /// Empty where nothing is registered, or what was is held back.
  [[nodiscard]] std::optional<RegisteredPatient> registered() const { return held_back_ ? std::nullopt : registered_; }
  /// That too by which nothing is drawn, for its tracker is not connected.
  [[nodiscard]] const std::optional<RegisteredPatient>& registered_or_held_back() const { return registered_; }
  [[nodiscard]] bool held_back() const { return held_back_; }
  /// It is held back because nothing tells what is connected: a person may say that it is the same.
  [[nodiscard]] bool person_may_say() const { return held_back_ && person_may_say_; }
  [[nodiscard]] bool confirmed() const { return confirmed_; }
  [[nodiscard]] const std::string& fault() const { return fault_; }
  /// The touches do not fit the markers as touches do: one or more are off, or a marker is none.
  [[nodiscard]] bool fits_poorly() const { return fits_poorly_; }
  /// All that are wanted are touched, and nothing speaks against them.
  [[nodiscard]] bool fits() const { return note_.done && !fits_poorly_ && doubt_.empty(); }
  /// Of those that fit poorly the one that is off, from 0: without it the others fit, and without another plainly
  /// worse. Empty: it cannot be told.
  [[nodiscard]] const std::optional<std::size_t>& odd() const { return odd_; }
  [[nodiscard]] const StepNote& note() const { return note_; }

 private:
  std::vector<TouchedFiducial> touches_;
  std::optional<RegisteredPatient> registered_;
  Instruments found_with_;  ///< all touches, or what was taken up
  bool confirmed_ = true, suspected_ = false, held_back_ = false, person_may_say_ = false;
  std::string fault_, line_;                    ///< line_: of what is held back, as it was found
  bool touches_precede_suspicion_ = false;      ///< touches_ are of before it was suspected
  std::size_t dropped_ = 0;                     ///< touches that the first of touches_ took the place of
  bool done_ = false;                           ///< and whether the step was done by it
  bool fit_is_due_ = false;                     ///< of touches that are held back
  bool fits_poorly_ = false, may_add_ = false;  ///< may_add_: one more than wanted, which the fit asks for
  std::string doubt_;                           ///< of a fit, in words; empty: none
  std::optional<std::size_t> odd_;
  StepNote note_;
};

}  // namespace birdseye::host
