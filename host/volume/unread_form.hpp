#pragma once

#include <filesystem>
#include <string>

namespace birdseye::host {

/// What the header of a NIfTI, NRRD or MetaImage file says that is not read, or lacks, or which of its files is not
/// there, with the remedy, in words that go on from the file's name. Empty where nothing of it is seen: a file that
/// then cannot be read is cut short or damaged.
std::string unread_form(const std::filesystem::path& path);

}  // namespace birdseye::host
