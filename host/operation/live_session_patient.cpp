// The part of the session that reads the patient, and makes the engine that draws the CT.
#include "host/operation/live_session.hpp"
#include "host/render/engine_thread.hpp"

namespace birdseye::host {

namespace {

/// On a thread of its own: the window's OpenGL stays the window's.
Result<std::unique_ptr<Engine>> engine_of(const std::string& name, const PatientPlan& patient,
                                          const std::optional<TransferFunction>& transfer) {
  if (!transfer) return Error{Errc::bad_value, "there is no transfer function to draw the CT by"};
  return make_on_own_thread([&] { return make_engine(name, patient.shown, *transfer); });
}

}  // namespace

void LiveSession::load(const PatientFiles& files) {
  if (deforming()) return;  // it reads the patient that there is
  settings_.patient = files;
  transfer_is_newer_ = false;
  loading_.start([files, name = settings_.engine, transfer = transfer_](const std::stop_token&, const auto& say) {
    say("reading the CT");
    auto read = read_patient(files);
    if (!read) return Result<Loaded>(read.error());
    auto patient = std::make_shared<const PatientPlan>(*std::move(read));
    auto engine = engine_of(name, *patient, transfer);
    return Result<Loaded>(Loaded{std::move(patient), std::move(engine), transfer});
  });
}

void LiveSession::finish_loading(Result<Loaded> loaded) {
  if (!loaded) {
    fault_ = loaded.error().what;
    return;
  }
  picture_.set_engine(nullptr);
  engine_.reset();
  patient_ = std::move(loaded->patient);
  ++shapes_;
  if (transfer_) fault_.clear();
  use(*loaded);
  markers_in_patient_mm_ = patient_->fiducials_in_patient_mm;
  fit();
  // What was touched meanwhile counts more than what is resumed, and is fitted first.
  if (markers_in_patient_mm_ || touches_.empty()) resume();
  // The search may take seconds, and the CT can be shown meanwhile.
  if (!markers_in_patient_mm_) {
    finding_.start([patient = patient_](const std::stop_token& stop, const auto& /*say*/) {
      return find_fiducials(patient->ct, stop);
    });
  }
}

void LiveSession::use(Loaded& loaded) {
  if (!transfer_) return;  // which is said already
  engine_fault_ = loaded.engine ? "" : loaded.engine.error().what;
  if (!loaded.engine) return;
  picture_.set_engine(nullptr);
  engine_ = *std::move(loaded.engine);
  drawn_by_ = loaded.transfer;
  if (deformation_) engine_->deform(deformation_->field);
  picture_.set_engine(engine_.get());
  picture_.redraw();
}

void LiveSession::set_transfer(const TransferFunction& transfer) {
  transfer_ = transfer;
  transfer_is_newer_ = true;
}

/// The picture keeps its old colours until there are new ones: it must not stand still.
void LiveSession::finish_recolouring() {
  if (auto made = recolouring_.take(); made && made->patient == patient_) use(*made);
  if (!transfer_is_newer_ || !patient_ || recolouring_.running()) return;
  transfer_is_newer_ = false;
  recolouring_.start(
      [patient = patient_, name = settings_.engine, transfer = transfer_](const std::stop_token&, const auto&) {
        auto engine = engine_of(name, *patient, transfer);
        return Loaded{patient, std::move(engine), transfer};
      });
}

}  // namespace birdseye::host
