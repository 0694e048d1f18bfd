#pragma once

namespace birdseye::host {

/// Processor time that the calling thread has used so far, s.
double thread_cpu_s();
/// The same of all threads of this process together.
double process_cpu_s();

}  // namespace birdseye::host
