#pragma once

#include <filesystem>
#include <functional>
#include <stop_token>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/time/clock.hpp"
#include "drivers/system/process_copy.hpp"
#include "host/confine/isolated.hpp"

namespace birdseye::host {

/// Copies of a confined process that it may work with: made before it reads anything, since it can make none later, and
/// confined as it is. Each does `work` until it is given nothing more.
struct ConfinedCopies {
  int count = 0;
  std::function<void(const ProcessCopy::Take&, const ProcessCopy::Send&)> work;
};

/// run_isolated of work in a process that is confined to what reads the input (confine_to). work: gets as many of the
/// copies as could be made. Where the kernel has no Landlock, a line on stderr says so once in a run. Errors, beside
/// those of run_isolated: Errc::io: no process is free, or it cannot be confined, and nothing was read: its words go on
/// from the input's name; and how_it_ended's.
Result<void> run_confined_to(const std::filesystem::path& input, const ConfinedCopies& copies,
                             const std::function<void(const Send&, std::vector<ProcessCopy>&)>& work,
                             const std::function<void(const Receive&)>& take, Duration silence,
                             const std::stop_token& stop = {});

/// What a confined copy's end, as receive() told it, says of its file: Errc::unsupported where it took longer than the
/// file justifies. Its words go on from "its decoder".
Error how_it_ended(const ProcessCopy& copy, Error told);

}  // namespace birdseye::host
