#pragma once

#include <array>
#include <string_view>

namespace birdseye::host {

/// A text of the window: its key, by which programs and languages name it, and what it is in English. {} is where a
/// figure or a name goes; a language may put them in another order, as {1} {0}.
struct EnglishText {
  std::string_view key, english;
};

/// All that the window says in its own words, by what shows it. What an instrument, a file or another program says
/// comes as it is.
inline constexpr std::array kEnglish{
    // The page before the first operation
    EnglishText{"first_more", "Birdseye needs a little more to begin."},
    EnglishText{"first_no_ct", "It was started without a CT."},
    EnglishText{"first_no_video", "It was started without a source of video."},
    EnglishText{"first_neither", "It was started with neither video nor a CT."},
    EnglishText{"first_asking", "This machine is asked what it has ..."},
    EnglishText{"first_all", "All at once: {}"},
    EnglishText{"first_doctor", "More about this machine: {}"},
    EnglishText{"first_simulated",
                "The simulated cart needs none of this: it brings a patient, a tracker and a scope of its own."},
    EnglishText{"first_start", "Start the simulated cart (Space)"},
    EnglishText{"first_close", "Close (Q)"},

    // The patient
    EnglishText{"patient_name", "{}"},
    EnglishText{"patient_id", "ID {}"},
    EnglishText{"patient_born", "born {}"},
    EnglishText{"patient_ct_date", "CT of {}"},
    EnglishText{"patient_no_name", "The CT names no patient."},
    EnglishText{"patient_no_ct_date", "The CT has no date."},
    EnglishText{"patient_file", "File: {}"},
    EnglishText{"patient_none", "No CT has been read yet."},
    EnglishText{"patient_ask", "Is this the patient on the table? Compare name, ID and date, then press Space."},
    EnglishText{"patient_confirmed", "confirmed"},
    EnglishText{"patient_pseudonym", "patient not named; CT {}"},
    EnglishText{"patient_unconfirmed", "nobody has confirmed the patient: compare name, ID and date, then press Space"},
    EnglishText{"patient_other", "this CT is another patient's"},
    EnglishText{"patient_wrong", "this CT is of ID {}, and the patient on the table has ID {}"},

    // The steps
    EnglishText{"step_connect", "connect"},
    EnglishText{"step_calibrate", "calibrate"},
    EnglishText{"step_fiducials", "fiducials"},
    EnglishText{"step_views", "views"},
    EnglishText{"step_deform", "deform"},
    EnglishText{"step_check", "check"},
    EnglishText{"step_run", "run"},
    EnglishText{"keys", "Space or the pedal: this. Enter: go on. 1 to 7: a step. F1: all keys."},
    EnglishText{"all_keys",
                "Space: the large button. Enter: go on. Backspace: take back. 1 to 7: a step. O: overlay on or off. "
                "U: outlines. H: hole. M: margins. G: surface in front. C: cutting plane. + and -: opacity. I: small "
                "picture. V: slices. In the slices P: fiducial here. X: no fiducial here. K: landmark here. T: stroke. "
                "F: freeze. S: snapshot. L: light or dark."},

    // What Space and the pedal do
    EnglishText{"do_confirm_patient", "this is the patient"},
    EnglishText{"do_other_ct", "close, and give the CT of this patient"},
    EnglishText{"do_wait", "wait for the appliance"},
    EnglishText{"do_go_on", "go on"},
    EnglishText{"do_begin", "begin"},
    EnglishText{"do_end_stations", "end with the stations so far"},
    EnglishText{"do_take_point", "take this point"},
    EnglishText{"do_keep_view", "keep this view"},
    EnglishText{"do_match", "match the CT with the views"},
    EnglishText{"do_cancel", "cancel"},
    EnglishText{"do_landmarks_fit", "the landmarks fit: go on"},
    EnglishText{"do_hide", "hide the overlay"},
    EnglishText{"do_show", "show the overlay"},
    EnglishText{"do_let_go", "let the picture go"},

    // Connect
    EnglishText{"instrument", "{}: {}"},

    // Calibrate
    EnglishText{"stations_taken", "{} stations taken"},
    EnglishText{"covered_picture", "Parts of the picture:"},
    EnglishText{"covered_tilts", "Tilts, small above and large below:"},
    EnglishText{"covered_turns", "Turns about the scope's length:"},
    EnglishText{"held_out_so_far", "So far {}: {:.2f} mm held out."},
    EnglishText{"verdict", "Verdict: {}."},
    EnglishText{"no_board", "No board is named. Start with --board, or give the appliance the scope's record."},

    // Fiducials
    EnglishText{"touch_each", "Touch each fiducial with the pointer. Rest there for half a second."},
    EnglishText{"touch_simulated", "The simulated operator touches each fiducial with the pointer: wait."},
    EnglishText{"markers_seen", "The CT shows {}."},
    EnglishText{"markers_wanted", "The CT shows {}; {} are wanted."},
    EnglishText{"markers_searched", "Markers are looked for in the CT."},
    EnglishText{"touch_residual", "{}: residual {:.2f} mm"},
    EnglishText{"touch_scatter", "{}: touched, scatter {:.2f} mm"},
    EnglishText{"fre", "FRE {:.2f} mm"},
    EnglishText{"undo_touch", "Backspace takes the last one back."},

    // Views
    EnglishText{"keep_views", "Keep five views or more of the organ, from different sides. Enter goes on without."},
    EnglishText{"stroke_begin", "stroke the organ with the pointer (T)"},
    EnglishText{"stroke_end", "end the stroke (T)"},
    EnglishText{"no_view_now", "No overlay now: a view cannot be kept."},
    EnglishText{"view_gain", "This view would shrink what is open by {:.0f} %, the best in reach by {:.0f} %."},
    EnglishText{"undo_view", "Backspace takes the last view or stroke back."},

    // Deform
    EnglishText{"match_views", "Match the CT with the kept views. Enter goes on without."},
    EnglishText{"undo_deform", "Backspace undoes it."},

    // Check
    EnglishText{"point_at_landmark",
                "Point at a landmark, and hold the pointer's tip to it. The distance should be near 0."},
    EnglishText{"point_simulated", "Nobody points at anything over the simulated cart: go on."},
    EnglishText{"no_pointer", "No pointer is seen, or the patient is not registered."},
    EnglishText{"tip_at", "The tip is at ({:.1f}, {:.1f}, {:.1f}) mm of the CT."},
    EnglishText{"from_nearest", "{:.1f} mm from {}"},

    // Run, and how the overlay is drawn
    EnglishText{"overlay_shown", "overlay (O)"},
    EnglishText{"opacity", "opacity"},
    EnglishText{"outlines", "outlines only (U)"},
    EnglishText{"hole", "round hole (H)"},
    EnglishText{"hole_radius", "radius"},
    EnglishText{"margins", "margins (M)"},
    EnglishText{"margin", "{:g} mm"},
    EnglishText{"no_margins", "No margins: start with --margins 5,10 and --targets."},
    EnglishText{"surface_in_front", "surface in front (G)"},
    EnglishText{"cutting_plane", "cutting plane (C)"},
    EnglishText{"left_to_right", "left to right"},
    EnglishText{"front_to_back", "front to back"},
    EnglishText{"feet_to_head", "feet to head"},
    EnglishText{"cut_at", "at {:.2f} of the CT"},
    EnglishText{"colours", "colours"},
    EnglishText{"presets", "presets"},
    EnglishText{"snapshot", "snapshot (S)"},
    EnglishText{"light_room", "light room (L)"},
    EnglishText{"dark_room", "dark room (L)"},

    // Slices
    EnglishText{"slices", "slices of the CT (V)"},
    EnglishText{"slices_close", "close the slices (V)"},
    EnglishText{"axial", "axial"},
    EnglishText{"coronal", "coronal"},
    EnglishText{"sagittal", "sagittal"},
    EnglishText{"slice_place", "({:.1f}, {:.1f}, {:.1f}) mm, {} HU"},
    EnglishText{"slice_outside", "({:.1f}, {:.1f}, {:.1f}) mm, outside of the CT"},
    EnglishText{"slice_help", "Click: the cross-hair goes there. Wheel: through the slices."},
    EnglishText{"slice_zoom", "zoom"},
    EnglishText{"slice_window", "window"},
    EnglishText{"soft_tissue", "soft tissue"},
    EnglishText{"bone_and_markers", "bone and markers"},
    EnglishText{"pick_marker", "fiducial here (P, or a double click)"},
    EnglishText{"drop_marker", "no fiducial here (X)"},
    EnglishText{"pick_landmark", "landmark here (K, or a double click)"},
    EnglishText{"pick_wait", "A marker is looked for there."},
    EnglishText{"picked_marker", "Fiducial {}: {} at ({:.1f}, {:.1f}, {:.1f}) mm, {:.1f} mm from where you pointed."},
    EnglishText{"picked_twice", "Fiducial {} is there already."},
    EnglishText{"picked_landmark", "{}: at ({:.1f}, {:.1f}, {:.1f}) mm."},
    EnglishText{"picked_landmark_marker", "{}: at the {}'s centre, {:.1f} mm from where you pointed."},
    EnglishText{"pick_too_soon", "Wait: markers are still looked for in the CT."},
    EnglishText{"dropped_marker", "Fiducial {} of the CT is not used any more."},
    EnglishText{"drop_none", "No fiducial lies within {:.0f} mm of there."},
    EnglishText{"landmark_name", "landmark {}"},

    // What the steps say of themselves
    EnglishText{"note_views_organ_moved", "the organ has moved since: keep views anew"},
    EnglishText{"note_views_touched_anew", "the fiducials were touched anew: keep views again"},
    EnglishText{"note_runs", "the overlay runs"},
    EnglishText{"note_no_tip", "no stroke: where the pointer's tip is, is not known"},
    EnglishText{"note_not_watched", "the surface is not checked: the views it was found by are not kept"},
    EnglishText{"note_most_views", "not kept: {} views are the most; undo the last one, or go on"},
    EnglishText{"note_no_overlay",
                "not kept: there is no overlay on this frame, so that where its camera was is not sure"},
    EnglishText{"note_same_place", "not kept: view {} was kept from here: move the scope by {:.0f} mm or more"},
    EnglishText{"note_views_kept", "{} views kept"},
    EnglishText{"note_few_views", "{} views are too few: keep {} or more, from different sides"},
    EnglishText{"note_folds", "what explains the views folds the organ: keep other views, or go on without"},
    EnglishText{"note_undone", "undone: the CT is shown as it was taken"},
    EnglishText{"note_matching", "matching"},
    EnglishText{"note_over_board", "hold the scope over the board"},
    EnglishText{"note_record_of", "by the scope's record of {}"},
    EnglishText{"note_kept_unknown", "what was kept does not say how far hand-eye is off: calibrate anew"},
    EnglishText{"note_appliance_is", "the appliance is {}"},
    EnglishText{"note_nothing_touched", "nothing was touched: the pointer was not seen, or moved faster than a stroke"},
    EnglishText{"note_stroking", "stroking: T ends the stroke"},
    EnglishText{"note_most_places", "{} places are the most: end the stroke (T)"},
    EnglishText{"note_cannot_tell", "for {:.0f} s it cannot be told whether the organ has moved: {}"},
    EnglishText{"fiducial_name", "fiducial {}"},
    EnglishText{"label_name", "middle of label {}"},
    EnglishText{"note_making", "making the patient"},
    EnglishText{"note_starting", "starting tracker, camera and appliance"},
    EnglishText{"note_touched", "{} touched"},
    EnglishText{"note_touched_fre", "{} touched, FRE {:.2f} mm"},
    EnglishText{"note_taken_up_fre", "{}, FRE {:.2f} mm"},
    EnglishText{"note_calibrated_anew", "the scope was calibrated anew: keep views again"},
    EnglishText{"note_taken_up", "taken up from {}"},
    EnglishText{"note_no_stroke", "no stroke: {}"},
    EnglishText{"note_surface", "surface: {}"},
    EnglishText{"note_not_kept", "not kept: {}"},
    EnglishText{"note_with_care", "with care: {}"},
    EnglishText{"note_connecting", "connecting to {}"},
    EnglishText{"note_connected", "connected to {}"},
    EnglishText{"note_playing", "playing {}"},

    // Why no overlay is drawn
    EnglishText{"why_camera_unknown", "how well the camera is calibrated is not known"},
    EnglishText{"why_camera_rms", "the camera is calibrated to {:.1f} px only"},
    EnglishText{"why_hand_eye_unknown", "how far hand-eye is off is not known"},
    EnglishText{"why_hand_eye_off", "hand-eye is off by {:.1f} px"},
    EnglishText{"why_fre_unknown", "how well the fiducials fit is not known"},
    EnglishText{"why_fre", "the fiducials fit to {:.1f} mm only"},
    EnglishText{"why_target_unknown", "how far the target may be off is not known"},
    EnglishText{"why_target", "fiducials as these leave the target open by {:.0f} mm: touch others, round about it"},
    EnglishText{"why_no_pose", "no pose"},
    EnglishText{"why_predicted", "the pose is predicted {:.0f} ms ahead"},
    EnglishText{"why_scatter", "the tracker scatters by {:.1f} mm"},
    EnglishText{"why_moved",
                "the organ has moved since the views ({:.0f} mm): keep views anew (or undo the deformation)"},
    EnglishText{"check_unknown_surface", "how well the deformed surface is known was not estimated"},
    EnglishText{"check_unknown_hand_eye", "how far hand-eye is off in mm is not known"},
    EnglishText{"check_broke_off", "the check broke off: {}"},
    EnglishText{"why_stopped", "the video has stopped, {:.1f} s ago"},
    EnglishText{"why_old_picture", "the picture is {:.0f} ms old"},
    EnglishText{"why_old_pose", "the newest pose is {:.0f} ms old"},
    EnglishText{"why_no_video", "no video has come yet"},
    EnglishText{"why_no_ct", "the CT is not ready"},
    EnglishText{"why_hidden", "it is switched off"},
    EnglishText{"why_calibration_held", "the calibration is not used: {}"},
    EnglishText{"why_registration_held", "the registration is not used: {}"},
    EnglishText{"why_other_size", "the video is {} x {} and the camera was calibrated at {} x {}"},
    EnglishText{"why_unregistered", "the patient is not registered yet"},
    EnglishText{
        "why_unconfirmed",
        "nobody has looked whether the registration still holds: point at landmarks in step 6, then press Space"},

    // What is held back, for other instruments are connected than those that it was found with
    EnglishText{"instrument_tracker", "tracker"},
    EnglishText{"instrument_camera", "camera"},
    EnglishText{"held_no_link", "nothing is connected"},
    EnglishText{"held_record", "the appliance has withdrawn its record ({})"},
    EnglishText{"held_other", "it was found with the {} whose {} is {}, and this one's is {}"},
    EnglishText{"held_other_untold", "it was found with the {} whose {} is {}, and this one does not say its own"},
    EnglishText{"held_untold", "nothing says whether the {} is the one that it was found with"},
    EnglishText{"instruments_ask",
                "Are tracker and camera the same as before? The server does not say. Space: yes, the same. If not: "
                "calibrate and register anew."},
    EnglishText{"do_same_instruments", "Same tracker and camera (Space)"},

    // Over the picture
    EnglishText{"banner_frozen", "FROZEN: this is no live picture"},
    EnglishText{"banner_stale", "NOT LIVE: {}"},
    EnglishText{"banner_simulated", "SIMULATED - {}"},
    EnglishText{"banner_whole", "overlay; {}"},
    EnglishText{"banner_target", "target within ±{:.1f} mm"},
    EnglishText{"banner_no_target", "target out of view"},
    EnglishText{"banner_unmatched", "overlay, not matched with the video: {} if the organ has not moved since the CT"},
    EnglishText{"banner_unwatched", "overlay, and nothing watches whether the organ moves; {}"},
    EnglishText{"banner_cut", "overlay, a part of the CT is cut away; {}"},
    EnglishText{"banner_opacity", "its opacity is 0"},
    EnglishText{"banner_fades", "overlay fades: {}"},
    EnglishText{"banner_none", "no overlay: {}"},
    EnglishText{"banner_recording", "RECORDING, not live - {}"},
    EnglishText{"target_error", "±{:.1f} mm"},
    EnglishText{"target_error_unmoved", "±{:.1f} mm, if it has not moved since the CT"},

    // The strip
    EnglishText{"ages", "Exposure to screen, ms: p50 {:.0f}, p95 {:.0f}, max {:.0f}"},
    EnglishText{"ages_up_to", "up to {:.0f} ms"},
    EnglishText{"rates", "{:.1f} frames/s, {} skipped; engine {}"},
    EnglishText{"tracker_rate", "Tracker {:.0f} Hz, {} doubted"},
    EnglishText{"saved", "Snapshot: {}"},
};

}  // namespace birdseye::host
