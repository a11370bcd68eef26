#pragma once
/// \file
/// Files written whole or not at all. Each goes to a temporary name beside the target, is flushed to the disk, then
/// renamed. A full disk, or a folder that is missing or not writable, is an io_error naming the target. It leaves no
/// half-written file.

#include <gart/core/types.hpp>

#include <filesystem>
#include <functional>
#include <iosfwd>
#include <string>
#include <string_view>
#include <vector>

namespace gart {

/// All bytes of a file.
std::vector<u8> read_file(std::filesystem::path const& path);
/// @{ Writes these bytes.
void write_file(std::filesystem::path const& path, std::string_view bytes);
void write_file(std::filesystem::path const& path, std::vector<u8> const& bytes);
/// @}
/// For contents too large to hold: `body` writes to the stream; it is checked and renamed after.
void write_file(std::filesystem::path const& path, std::function<void(std::ostream&)> const& body);

}  // namespace gart
