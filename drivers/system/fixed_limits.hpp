#pragma once

namespace birdseye {

/// From now on this process, and the copies that it makes, can raise no limit (setrlimit) beyond its hard one, whoever
/// runs it: root gives up the right to (CAP_SYS_RESOURCE). False: it could not.
bool fix_limits();

}  // namespace birdseye
