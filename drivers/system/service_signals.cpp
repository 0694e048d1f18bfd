#include "drivers/system/service_signals.hpp"

#include <ctime>

namespace birdseye {

ServiceSignals::ServiceSignals() {
  sigemptyset(&awaited_);
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&awaited_, signal);
  pthread_sigmask(SIG_BLOCK, &awaited_, nullptr);
  watcher_ = OwnedThread([this](const std::stop_token& done) { watch(done); });
}

void ServiceSignals::watch(const std::stop_token& done) {
  while (!done.stop_requested()) {
    const timespec tick{0, 100'000'000};
    const int signal = sigtimedwait(&awaited_, nullptr, &tick);
    if (signal == SIGHUP) reload_ = true;
    if (signal == SIGTERM || signal == SIGINT) stop_.request_stop();
  }
}

}  // namespace birdseye
