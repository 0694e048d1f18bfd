#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/system/background.hpp"
#include "host/operation/patient.hpp"
#include "host/render/engine.hpp"
#include "host/render/scene/transfer_function.hpp"

namespace birdseye::host {

/// By which the engine is made that draws a CT; a simulator that looks at no picture gives its own.
using EngineMaker = std::function<Result<std::unique_ptr<Engine>>(const std::string& name, const Volume& volume,
                                                                  const TransferFunction& transfer)>;
/// It draws on a thread of its own: the window's OpenGL stays the window's.
Result<std::unique_ptr<Engine>> engine_by_name(const std::string& name, const Volume& volume,
                                               const TransferFunction& transfer);

/// Reads the patient, finds the fiducials in the CT, and makes the engine that draws it: each on a thread of its own.
class PatientStep {
 public:
  /// transfer: a preset or a file; engine: its name.
  PatientStep(const std::string& transfer, std::string engine, EngineMaker make_engine = engine_by_name);

  /// Of one that is still being read nothing comes any more.
  void load(const PatientFiles& files);
  /// The picture has these colours once an engine is made that draws by them.
  void set_transfer(const TransferFunction& transfer);

  struct News {
    bool patient = false;  ///< another: nothing of the one before holds
    bool engine = false;   ///< another, or none any more
    bool markers = false;  ///< a search has found the fiducials
  };
  /// Collects what the threads have finished.
  News tick();

  [[nodiscard]] const PatientFiles& files() const { return files_; }
  [[nodiscard]] const std::shared_ptr<const PatientPlan>& plan() const { return plan_; }
  /// The fiducials in the CT; empty as long as they are looked for.
  [[nodiscard]] const std::optional<std::vector<Eigen::Vector3d>>& markers_in_patient_mm() const { return markers_; }
  /// One more, or one less: the nearest within reach of a place. Which it is, from 0; empty: none is there, or they are
  /// still looked for.
  std::optional<std::size_t> add_marker(const Eigen::Vector3d& place_in_patient_mm);
  std::optional<std::size_t> drop_marker(const Eigen::Vector3d& place_in_patient_mm);
  static constexpr double kMarkerReach_mm = 10;
  /// Those of the plan, and those that a person has picked; of the CT as it was taken.
  [[nodiscard]] const std::vector<NamedPoint>& landmarks() const { return landmarks_; }
  void add_landmark(NamedPoint landmark) { landmarks_.push_back(std::move(landmark)); }
  /// Takes the last one back that a person has picked.
  bool undo_landmark();
  /// Draws what is shown of the plan, which it holds. Null: there is none yet.
  [[nodiscard]] const std::shared_ptr<Engine>& engine() const { return engine_; }
  /// Null where the name that was given is none.
  [[nodiscard]] const std::shared_ptr<const TransferFunction>& transfer() const { return transfer_; }
  /// By which the engine draws: that before, as long as an engine for another is being made.
  [[nodiscard]] const std::shared_ptr<const TransferFunction>& drawn_by() const { return drawn_by_; }
  /// What is wrong with the files, and with the engine.
  [[nodiscard]] const std::string& fault() const { return fault_; }
  [[nodiscard]] const std::string& engine_fault() const { return engine_fault_; }

 private:
  using Transfer = std::shared_ptr<const TransferFunction>;
  struct Loaded {
    std::shared_ptr<const PatientPlan> plan;
    Result<std::shared_ptr<Engine>> engine;
    Transfer transfer;  ///< that the engine draws by
  };
  static Result<std::shared_ptr<Engine>> make(const EngineMaker& maker, const std::string& name,
                                              const std::shared_ptr<const PatientPlan>& plan, const Transfer& transfer);
  bool use(const Loaded& loaded);
  void recolour();

  PatientFiles files_;
  std::string engine_name_, fault_, engine_fault_;
  EngineMaker make_engine_;
  Transfer transfer_, drawn_by_;
  bool transfer_is_newer_ = false;  ///< than what engine_, or that of the CT that is being read, draws by
  std::shared_ptr<const PatientPlan> plan_;
  std::optional<std::vector<Eigen::Vector3d>> markers_;
  std::vector<NamedPoint> landmarks_;
  std::shared_ptr<Engine> engine_;
  Background<Result<Loaded>> loading_;
  Background<std::vector<Eigen::Vector3d>> finding_;
  Background<Loaded> recolouring_;
};

}  // namespace birdseye::host
