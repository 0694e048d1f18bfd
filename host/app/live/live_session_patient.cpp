// The part of the session that reads the patient, and makes the engine that draws the CT.
#include "host/app/live/live_session.hpp"
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
    return Result<Loaded>(Loaded{std::move(patient), std::move(engine)});
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
  use(std::move(loaded->engine));
  // The search may take seconds, and the CT can be shown meanwhile.
  markers_in_patient_mm_ = patient_->fiducials_in_patient_mm;
  if (!markers_in_patient_mm_)
    finding_.start([patient = patient_](const std::stop_token&, const auto&) { return find_fiducials(patient->ct); });
  fit();
  // What was touched meanwhile counts more than what is resumed, and is fitted first.
  if (markers_in_patient_mm_ || touches_.empty()) resume();
}

void LiveSession::use(Result<std::unique_ptr<Engine>> engine) {
  picture_.set_engine(nullptr);
  engine_.reset();
  if (!transfer_) return;  // which is said already
  if (!engine) {
    fault_ = engine.error().what;
    return;
  }
  engine_ = *std::move(engine);
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
  if (auto made = recolouring_.take(); made && made->patient == patient_) use(std::move(made->engine));
  if (!transfer_is_newer_ || !patient_ || recolouring_.running()) return;
  transfer_is_newer_ = false;
  recolouring_.start(
      [patient = patient_, name = settings_.engine, transfer = transfer_](const std::stop_token&, const auto&) {
        auto engine = engine_of(name, *patient, transfer);
        return Loaded{patient, std::move(engine)};
      });
}

}  // namespace birdseye::host
