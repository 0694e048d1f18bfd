#pragma once

#include <cstdint>
#include <filesystem>

#include "host/confine/allowance.hpp"

namespace birdseye::host {

/// What of a confinement the kernel holds this process to.
struct Confinement {
  bool system_calls = false;  ///< no network, no other program, no file written (seccomp)
  bool files = false;         ///< of files, the input's and the system's libraries are read, and no others (Landlock)
};

/// Confines this process, and the copies that it makes, for good: it may read the input and compute, within the
/// allowance of the input's size and at most half of the machine's memory, and write to what is open. For a decoder's
/// process (ProcessCopy), which has one thread. docs/decisions/0039-confined-decoders.md says what is left out.
Confinement confine_to(const std::filesystem::path& input);
/// The same of an input of so many bytes that this process has already: it opens no file at all, and makes no copies.
Confinement confine_to_bytes(std::uintmax_t bytes);

/// In a confined process, before it reads a file of its input: the processor time that this file justifies begins now.
/// A process that takes longer ends by SIGXCPU.
void allow_time_for(const std::filesystem::path& file);

}  // namespace birdseye::host
