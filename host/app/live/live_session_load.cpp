// The part of the session that reads the patient and makes what draws it, both beside the window.
#include <future>

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
    auto patient = std::make_shared<PatientPlan>(*std::move(read));
    std::future<std::vector<Eigen::Vector3d>> found;
    if (files.fiducials.empty())
      found = std::async(std::launch::async, [&patient] { return find_fiducials(patient->ct); });
    auto engine = engine_of(name, *patient, transfer);
    if (found.valid()) patient->markers_in_patient_mm = found.get();
    return Result<Loaded>(Loaded{std::move(patient), std::move(engine)});
  });
}

void LiveSession::take_loaded() {
  if (auto loaded = loading_.take()) {
    if (*loaded) {
      picture_.set_engine(nullptr);
      engine_.reset();  // it draws the patient that goes
      patient_ = std::move((*loaded)->patient);
      ++shapes_;
      if (transfer_) fault_.clear();
      use(std::move((*loaded)->engine));
      fit();
      resume();
    } else {
      fault_ = loaded->error().what;
    }
  }
  if (auto made = recolouring_.take(); made && *made && (**made).patient == patient_) use(std::move((**made).engine));
  if (transfer_is_newer_ && patient_ && !recolouring_.running()) recolour();
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

/// The picture keeps its old colours meanwhile: it must not stand still.
void LiveSession::recolour() {
  transfer_is_newer_ = false;
  recolouring_.start(
      [patient = patient_, name = settings_.engine, transfer = transfer_](const std::stop_token&, const auto& /*say*/) {
        auto engine = engine_of(name, *patient, transfer);
        return Result<Loaded>(Loaded{patient, std::move(engine)});
      });
}

}  // namespace birdseye::host
