#pragma once
// Where results go. Folders are made, and seen to be writable, before any work starts.

#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>

namespace gart_cli {

// Makes a missing folder. io_error, naming it, where files cannot be put there.
void prepare_folder(std::filesystem::path const& folder);
// Whether that can be done; it leaves nothing behind.
void try_folder(std::filesystem::path const& folder);
// The same for the folder of a file that will be written.
void prepare_file(std::filesystem::path const& file);

void write_json(std::filesystem::path const& file, nlohmann::json const& value);
// io_error, naming the file and the place in it, for invalid JSON.
nlohmann::json read_json(std::filesystem::path const& file);

}  // namespace gart_cli
