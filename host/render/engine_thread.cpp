#include "host/render/engine_thread.hpp"

#include <exception>
#include <mutex>
#include <optional>
#include <utility>

#include "drivers/system/condition.hpp"
#include "drivers/system/thread.hpp"

namespace birdseye::host {

namespace {

/// Does one thing after the other, each while its asker waits, who gets what it throws.
class Worker {
 public:
  Worker() : thread_([this](const std::stop_token& stop) { work(stop); }) {}

  void run(const std::function<void()>& what) {
    const std::lock_guard one_asker(asking_);
    std::unique_lock lock(mutex_);
    todo_ = &what;
    changed_.notify_all();
    changed_.wait(lock, std::stop_token(), [this] { return todo_ == nullptr; });
    if (thrown_) std::rethrow_exception(std::exchange(thrown_, nullptr));
  }

 private:
  void work(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (changed_.wait(lock, stop, [this] { return todo_ != nullptr; })) {
      try {
        (*todo_)();
      } catch (...) {
        thrown_ = std::current_exception();
      }
      todo_ = nullptr;
      changed_.notify_all();
    }
  }

  std::mutex asking_, mutex_;
  Condition changed_;
  const std::function<void()>* todo_ = nullptr;
  std::exception_ptr thrown_;
  OwnedThread thread_;
};

class EngineThread final : public Engine {
 public:
  Result<void> make(const std::function<Result<std::unique_ptr<Engine>>()>& make) {
    std::optional<Error> fault;
    worker_.run([&] {
      auto made = make();
      if (made) {
        engine_ = *std::move(made);
        set_choice(engine_->choice());
      } else {
        fault = made.error();
      }
    });
    return fault ? Result<void>(*fault) : Result<void>();
  }
  ~EngineThread() override {
    worker_.run([this] { engine_.reset(); });
  }
  EngineThread() = default;
  EngineThread(const EngineThread&) = delete;
  EngineThread& operator=(const EngineThread&) = delete;

  void deform(const DisplacementField& field) override {
    worker_.run([&] { engine_->deform(field); });
  }
  void undeform() override {
    worker_.run([this] { engine_->undeform(); });
  }
  ImageRgba render(const CameraModel& camera, const Transform<Camera, Patient>& camera_from_patient,
                   const RenderSettings& settings) override {
    ImageRgba out;
    worker_.run([&] { out = engine_->render(camera, camera_from_patient, settings); });
    return out;
  }
  [[nodiscard]] std::string name() const override { return engine_->name(); }
  [[nodiscard]] std::string fault() const override { return engine_->fault(); }
  [[nodiscard]] std::size_t bytes() const override { return engine_->bytes(); }

 private:
  std::unique_ptr<Engine> engine_;
  Worker worker_;  // last: it ends before what it works on
};

}  // namespace

Result<std::unique_ptr<Engine>> make_on_own_thread(const std::function<Result<std::unique_ptr<Engine>>()>& make) {
  auto made = std::make_unique<EngineThread>();
  if (auto fault = made->make(make); !fault) return fault.error();
  return std::unique_ptr<Engine>(std::move(made));
}

}  // namespace birdseye::host
