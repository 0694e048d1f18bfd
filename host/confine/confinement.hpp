#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "calibration/base/result.hpp"
#include "host/confine/allowance.hpp"

namespace birdseye::host {

/// What holds of a confined process beside its filter of system calls and its limits, without which none is.
struct Confinement {
  bool files = false;  ///< it reads its input and the system's files, and no others (Landlock)
};

/// Confines this process for good: it may read the input and compute, within the allowance of the input's size and at
/// most half of the machine's memory, and write to what is open. For a decoder's process (ProcessCopy), which has one
/// thread. docs/decisions/0039-confined-decoders.md says what is left out. before_last: done when the files and the
/// limits are bounded and the system calls are not: it may make copies, which it then may no more; each of them calls
/// confine_copy() first. Errors: what is missing on this machine, and the remedy (Errc::io); or the input has too many
/// files (Errc::unsupported); the process must read nothing then. Their words go on from the input's name.
Result<Confinement> confine_to(const std::filesystem::path& input, const std::function<void()>& before_last = {});
/// What a copy that is made in confine_to's before_last still lacks; it ends with the process that made it.
Result<void> confine_copy();
/// The same of an input of so many bytes that this process has already: it opens no file at all, by the filter, with
/// Landlock or without.
Result<void> confine_to_bytes(std::uintmax_t bytes);

/// In a confined process, before it reads a file of its input: the processor time that this file justifies begins now,
/// within what all its files justify. A process that takes longer ends by SIGXCPU, and by SIGKILL where it does not
/// heed that.
void allow_time_for(const std::filesystem::path& file);

}  // namespace birdseye::host
