#include "host/confine/run_confined.hpp"

#include <cstdint>
#include <mutex>
#include <optional>
#include <utility>

#include "drivers/system/machine_time.hpp"
#include "drivers/system/process_copy.hpp"
#include "host/confine/confinement.hpp"
#include "host/confine/run_confined_to.hpp"

namespace birdseye::host {

namespace {

constexpr Duration kLongest = Duration::from_ms(60'000);  // also of a decoder that waits, or of a very large file
constexpr Duration kToAnswer = Duration::from_ms(90'000);

constexpr std::size_t kLongestReason = 1 << 12;

struct Request {
  ConfinedWork work = nullptr;
  std::size_t bytes = 0, most_bytes = 0;
};

/// What the copy sends before what it made, or before why it could not be confined.
struct Made {
  bool confined = false;
  std::size_t bytes = 0;
};

struct Answer {
  bool failed = false;
  Errc code = Errc::io;
  std::size_t bytes = 0;
};

Error of_decoder(const ProcessCopy& copy, const Error& error) {
  Error how = how_it_ended(copy, error);
  how.what.insert(0, "its decoder ");
  if (how.code == Errc::unsupported) how.what += "; save it uncompressed, or smaller";
  return how;
}

/// In a copy of the process that stands by.
Result<std::string> run_in_copy(const Request& request, std::string_view input) {
  auto copy = ProcessCopy::start([&](const ProcessCopy::Send& send) {
    const auto confined = confine_to_bytes(input.size());
    const std::string made = confined ? request.work(input) : confined.error().what;
    const Made head{confined.has_value(), made.size()};
    send(&head, sizeof head);
    send(made.data(), made.size());
  });
  if (!copy) return std::move(copy).error();
  const Deadline deadline = Deadline::after(kLongest);
  Made head;
  if (const auto came = copy->receive(&head, sizeof head, deadline); !came) return of_decoder(*copy, came.error());
  if (head.bytes > (head.confined ? request.most_bytes : kLongestReason))
    return Error{Errc::bad_value, "its decoder gave more than such a file can hold"};
  std::string made(head.bytes, '\0');
  if (const auto came = copy->receive(made.data(), made.size(), deadline); !came)
    return of_decoder(*copy, came.error());
  if (!head.confined) return Error{Errc::io, std::move(made)};
  return made;
}

/// What stands by does, until this process ends.
void stand_by(const ProcessCopy::Take& take, const ProcessCopy::Send& send) {
  const MachineTime in_the_machines_time;
  for (Request request; take(&request, sizeof request);) {
    std::string input(request.bytes, '\0');
    if (!take(input.data(), input.size())) return;
    const auto made = run_in_copy(request, input);
    const std::string& said = made ? *made : made.error().what;
    const Answer answer{!made, made ? Errc::io : made.error().code, said.size()};
    send(&answer, sizeof answer);
    send(said.data(), said.size());
  }
}

/// The process that stands by; none before it is needed.
struct Standing {
  std::mutex mutex;
  std::optional<ProcessCopy> process;

  static Standing& here() {
    static Standing standing;
    return standing;
  }
  Result<void> start() {
    if (process) return {};
    auto started = ProcessCopy::start_listening(stand_by);
    if (!started) return std::move(started).error();
    process.emplace(*std::move(started));
    return {};
  }
  /// Empty where the process that stands by has ended, or does not answer.
  std::optional<Result<std::string>> ask(const Request& request, std::string_view input) {
    const Deadline deadline = Deadline::after(kToAnswer);
    Answer answer;
    if (!process->give(&request, sizeof request, deadline) || !process->give(input.data(), input.size(), deadline) ||
        !process->receive(&answer, sizeof answer, deadline))
      return std::nullopt;
    std::string said(answer.bytes, '\0');
    if (!process->receive(said.data(), said.size(), deadline)) return std::nullopt;
    if (answer.failed) return Error{answer.code, std::move(said)};
    return said;
  }
};

}  // namespace

Result<std::string> run_confined(ConfinedWork work, std::string_view input, std::size_t most_bytes) {
#ifdef BIRDSEYE_FUZZED
  return work(input);
#endif
  const MachineTime in_the_machines_time;
  Standing& standing = Standing::here();
  const std::lock_guard lock(standing.mutex);
  const Request request{work, input.size(), most_bytes};
  // One that something else ended since the last time is made anew.
  for (int tries = 0; tries < 2; ++tries) {
    if (auto started = standing.start(); !started) return std::move(started).error();
    if (auto answer = standing.ask(request, input)) return *std::move(answer);
    standing.process.reset();
  }
  return Error{Errc::disconnected, "its decoder ended before it had sent all"};
}

void stand_by_to_confine() {
  Standing& standing = Standing::here();
  const std::lock_guard lock(standing.mutex);
  (void)standing.start();  // where it cannot, the first run_confined says why
}

}  // namespace birdseye::host
