#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

namespace birdseye::host {

/// How many bytes of voxels an NRRD or MetaImage file holds, unpacked, in itself or in one file beside it. Empty where
/// it does not say so plainly: voxels in several files, written as text, or behind bytes that are to be skipped. The
/// header is one that unread_form() has nothing against. What is packed is counted until there are `enough`.
std::optional<std::size_t> voxel_bytes(const std::filesystem::path& path, std::size_t enough);

/// Why a file that holds a row more than its header says, or more, is refused, in words that go on from its name: read
/// by that header, each row would begin elsewhere.
std::string too_many(std::size_t held_bytes, std::size_t said_bytes);

}  // namespace birdseye::host
