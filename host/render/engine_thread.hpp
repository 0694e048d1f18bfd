#pragma once

#include <functional>
#include <memory>

#include "host/render/engine.hpp"

namespace birdseye::host {

/// An engine that is made, used and ended on a thread of its own, for callers whose thread draws already: an OpenGL
/// context that the engine makes does not take the place of the window's there. Calls wait for the engine's thread.
Result<std::unique_ptr<Engine>> make_on_own_thread(const std::function<Result<std::unique_ptr<Engine>>()>& make);

}  // namespace birdseye::host
