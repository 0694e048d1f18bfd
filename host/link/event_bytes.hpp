#pragma once

#include <cstddef>

#include "device/wire/messages.hpp"

namespace birdseye::host {

/// What an event holds in memory, roughly: its pixels and texts, which are what another machine decides on.
std::size_t bytes_of(const wire::Event& event);

}  // namespace birdseye::host
