#include "host/operation/patient_step.hpp"

#include <algorithm>

#include "host/render/engine_thread.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

Result<std::unique_ptr<Engine>> engine_by_name(const std::string& name, const Volume& volume,
                                               const TransferFunction& transfer) {
  return make_on_own_thread([&] { return make_engine(name, volume, transfer); });
}

PatientStep::PatientStep(const std::string& transfer, std::string engine, EngineMaker make_engine)
    : engine_name_(std::move(engine)), make_engine_(std::move(make_engine)) {
  auto loaded = load_transfer_function(transfer);
  if (loaded) {
    transfer_ = std::make_shared<const TransferFunction>(*std::move(loaded));
  } else {
    fault_ = loaded.error().what;
  }
}

/// The engine draws from the plan, and keeps it.
Result<std::shared_ptr<Engine>> PatientStep::make(const EngineMaker& maker, const std::string& name,
                                                  const std::shared_ptr<const PatientPlan>& plan,
                                                  const Transfer& transfer) {
  if (!transfer) return Error{Errc::bad_value, words("note_no_transfer")};
  auto made = maker(name, plan->shown, *transfer);
  if (!made) return made.error();
  return std::shared_ptr<Engine>(made->release(), [plan](Engine* engine) { delete engine; });
}

void PatientStep::load(const PatientFiles& files) {
  files_ = files;
  transfer_is_newer_ = false;
  loading_.start([files, maker = make_engine_, name = engine_name_, transfer = transfer_](const std::stop_token& stop,
                                                                                          const auto& say) {
    say(words("note_reading_ct"));
    auto read = read_patient(files, stop);
    if (!read) return Result<Loaded>(read.error());
    auto plan = std::make_shared<const PatientPlan>(*std::move(read));
    auto engine = make(maker, name, plan, transfer);
    return Result<Loaded>(Loaded{std::move(plan), std::move(engine), transfer});
  });
}

PatientStep::News PatientStep::tick() {
  News news;
  if (auto loaded = loading_.take()) {
    if (*loaded) {
      engine_.reset();
      plan_ = (*loaded)->plan;
      if (transfer_) fault_.clear();
      use(**loaded);
      markers_ = plan_->fiducials_in_patient_mm;
      landmarks_ = plan_->landmarks;
      news.patient = news.engine = true;
      // The search may take seconds, and the CT can be shown meanwhile.
      if (!markers_) {
        finding_.start([plan = plan_](const std::stop_token& stop, const auto& /*say*/) {
          return find_fiducials(plan->ct, stop);
        });
      }
    } else {
      fault_ = loaded->error().what;
    }
  }
  if (auto found = finding_.take(); found && !markers_) {
    markers_ = *std::move(found);
    news.markers = true;
  }
  if (auto made = recolouring_.take(); made && made->plan == plan_) news.engine = use(*made) || news.engine;
  recolour();
  return news;
}

std::optional<std::size_t> PatientStep::add_marker(const Eigen::Vector3d& place_in_patient_mm) {
  if (!markers_) return std::nullopt;
  markers_->push_back(place_in_patient_mm);
  return markers_->size() - 1;
}

std::optional<std::size_t> PatientStep::drop_marker(const Eigen::Vector3d& place_in_patient_mm) {
  if (!markers_ || markers_->empty()) return std::nullopt;
  const auto nearest = std::min_element(markers_->begin(), markers_->end(), [&](const auto& a, const auto& b) {
    return (a - place_in_patient_mm).norm() < (b - place_in_patient_mm).norm();
  });
  if ((*nearest - place_in_patient_mm).norm() > kMarkerReach_mm) return std::nullopt;
  const auto which = static_cast<std::size_t>(nearest - markers_->begin());
  markers_->erase(nearest);
  return which;
}

bool PatientStep::undo_landmark() {
  if (!plan_ || landmarks_.size() <= plan_->landmarks.size()) return false;
  landmarks_.pop_back();
  return true;
}

bool PatientStep::use(const Loaded& loaded) {
  if (!transfer_) return false;  // which is said already
  engine_fault_ = loaded.engine ? "" : loaded.engine.error().what;
  if (!loaded.engine) return false;
  engine_ = *loaded.engine;
  drawn_by_ = loaded.transfer;
  return true;
}

void PatientStep::set_transfer(const TransferFunction& transfer) {
  transfer_ = std::make_shared<const TransferFunction>(transfer);
  transfer_is_newer_ = true;
}

/// The picture keeps its old colours until there are new ones: it must not stand still.
void PatientStep::recolour() {
  if (!transfer_is_newer_ || !plan_ || recolouring_.running()) return;
  transfer_is_newer_ = false;
  recolouring_.start([plan = plan_, maker = make_engine_, name = engine_name_, transfer = transfer_](
                         const std::stop_token&, const auto&) {
    auto engine = make(maker, name, plan, transfer);
    return Loaded{plan, std::move(engine), transfer};
  });
}

}  // namespace birdseye::host
