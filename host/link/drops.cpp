#include "host/link/drops.hpp"

#include <fmt/format.h>

namespace birdseye::host {

std::string Drops::words() const {
  if (frames + others == 0) return {};
  return fmt::format("this machine fell behind, so {} frames and {} other messages were dropped", frames, others);
}

void Drops::tell(Verdict& verdict) const {
  if (frames + others > 0) verdict.add(others > 0 ? Grade::marginal : Grade::pass, words());
}

}  // namespace birdseye::host
