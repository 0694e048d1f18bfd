#pragma once

#include <sys/stat.h>

namespace birdseye {

/// Whether two names, or a name and what is open, are of one file.
inline bool is_same_file(const struct stat& one, const struct stat& other) {
  return one.st_dev == other.st_dev && one.st_ino == other.st_ino;
}

}  // namespace birdseye
