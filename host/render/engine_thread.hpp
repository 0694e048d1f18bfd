#pragma once

#include <functional>
#include <memory>

#include "host/render/engine.hpp"

namespace birdseye::host {

/// An engine that is made, used and ended on a thread of its own, for whoever calls it from a thread that draws
/// already: the OpenGL context that an engine makes there does not take the place of a window's. Calls wait for it.
Result<std::unique_ptr<Engine>> make_on_own_thread(const std::function<Result<std::unique_ptr<Engine>>()>& make);

}  // namespace birdseye::host
