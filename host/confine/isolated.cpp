#include "host/confine/isolated.hpp"

#include "drivers/system/machine_time.hpp"

namespace birdseye::host {

Result<void> run_isolated(const std::function<void(const Send&)>& work, const std::function<void(const Receive&)>& take,
                          Duration silence, const std::stop_token& stop) {
  const MachineTime in_the_machines_time;
  auto copy = ProcessCopy::start(work);
  if (!copy) return std::move(copy).error();
  Result<void> received;
  take([&](void* to, std::size_t size) {
    if (received) received = copy->receive(to, size, Deadline::after(silence), stop);
    return received.has_value();
  });
  return received;
}

}  // namespace birdseye::host
