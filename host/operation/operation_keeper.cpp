#include "host/operation/operation_keeper.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <system_error>
#include <utility>

#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

OperationKeeper::OperationKeeper(std::filesystem::path out, std::filesystem::path resume, Authors authors)
    : out_(std::move(out)), resume_(std::move(resume)), authors_(std::move(authors)) {}

Result<std::optional<Operation>> OperationKeeper::take_up(const std::string& ct_sha256,
                                                          const std::string& labels_sha256,
                                                          const Eigen::Vector3d& target_at_rest_mm) {
  const std::filesystem::path folder = std::exchange(resume_, {});
  if (folder.empty()) return std::optional<Operation>();
  auto operation = read_operation(folder, authors_);
  if (operation) {
    auto same = check_patient(*operation, ct_sha256, labels_sha256);
    if (same) same = check_target(*operation, target_at_rest_mm);
    if (!same)
      operation = Error{same.error().code,
                        fmt::format("{}: {}, or go on without --resume", folder.string(), same.error().what)};
  }
  if (!operation) {
    std::error_code ignored;
    if (!std::filesystem::equivalent(out_, folder, ignored)) return operation.error();
    out_.clear();
    return Error{operation.error().code, words("note_nothing_kept", operation.error().what)};
  }
  return std::optional(*std::move(operation));
}

OperationKeeper::~OperationKeeper() {
  finish();
}

void OperationKeeper::finish() {
  if (std::exchange(finished_, true)) return;
  if (!wait_and_hear() || (newest_ == written_ && !again_)) return;
  write();
  wait_and_hear();
}

bool OperationKeeper::wait_and_hear() {
  constexpr Duration kLook = Duration::from_ms(5);
  const Deadline deadline = Deadline::after(Background<Result<void>>::kEndsWithin);
  while (writing_.running()) {
    if (deadline.passed()) {
      fault_ = words("note_not_kept", fmt::format("{}: the disk does not answer", out_.string()));
      return false;
    }
    sleep_for(kLook);
  }
  hear();
  return true;
}

void OperationKeeper::keep(Operation operation) {
  if (out_.empty() || !resume_.empty()) return;
  operation.made_utc = utc_now();
  newest_ = std::make_shared<const Operation>(std::move(operation));
  tick();
}

void OperationKeeper::write() {
  again_.reset();
  written_ = newest_;
  writing_.start([out = out_, machine = authors_.machine, kept = newest_](const std::stop_token&, const auto&) {
    return write_operation(out, *kept, *machine);
  });
}

void OperationKeeper::hear() {
  constexpr Duration kAgainAfter = Duration::from_ms(5000);
  const auto written = writing_.take();
  if (!written) return;
  fault_ = *written ? "" : words("note_not_kept", written->error().what);
  if (!*written) again_ = Deadline::after(kAgainAfter);
}

void OperationKeeper::tick() {
  // What is being written ends first: what became of it would be lost otherwise, and a disk that is full and slow would
  // not be told of where something new is found again and again.
  if (writing_.running()) return;
  hear();
  if (newest_ != written_ || (again_ && again_->passed())) write();
}

}  // namespace birdseye::host
