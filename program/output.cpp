#include "output.hpp"

#include <gart/core/error.hpp>
#include <gart/io/file.hpp>
#include <gart/io/json_fault.hpp>

#include <unistd.h>

namespace gart_cli {

namespace fs = std::filesystem;

void prepare_folder(fs::path const& folder) {
  std::error_code failure;
  fs::create_directories(folder, failure);
  if (failure || !fs::is_directory(folder)) {
    throw gart::io_error(folder.string(),
                         "cannot be made a folder: " + (failure ? failure.message() : "a file is there"),
                         "choose another --out");
  }
  fs::path const probe = folder / (".gart_probe_" + std::to_string(getpid()));
  try {
    gart::write_file(probe, "x");
  } catch (gart::io_error const& e) {
    throw gart::io_error(folder.string(), std::string("files cannot be written there: ") + e.what(),
                         "choose another --out, or free some space");
  }
  fs::remove(probe, failure);
}

void try_folder(fs::path const& folder) {
  std::vector<fs::path> made;  // by this, the innermost first
  std::error_code failure;
  for (fs::path at = fs::absolute(folder).lexically_normal(); !fs::exists(at, failure); at = at.parent_path())
    made.push_back(at);
  prepare_folder(folder);
  for (fs::path const& at : made) fs::remove(at, failure);
}

void prepare_file(fs::path const& file) {
  if (fs::is_directory(file)) throw gart::io_error(file.string(), "is a folder", "name a file");
  prepare_folder(file.has_parent_path() ? file.parent_path() : fs::path("."));
}

void write_json(fs::path const& file, nlohmann::json const& value) {
  // File names may hold bytes that are not UTF-8: replaced, since a report is better than none.
  gart::write_file(file, value.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

nlohmann::json read_json(fs::path const& file) {
  auto const bytes = gart::read_file(file);
  // nlohmann parses any depth, but copies and prints a value by recursion.
  auto const bounded = [&](int depth, nlohmann::json::parse_event_t, nlohmann::json&) {
    if (depth > 32) throw gart::io_error(file.string(), "is nested more than 32 deep", "restore it, or start anew");
    return true;
  };
  try {
    return nlohmann::json::parse(bytes.begin(), bytes.end(), bounded);
  } catch (nlohmann::json::exception const& e) {
    gart::json_fault const fault = gart::json_fault_of(e.what());
    throw gart::io_error(
        file.string(), "is not JSON: " + fault.what,
        fault.cut ? "it is truncated: restore it, or start anew" : "correct it at that place, or start anew");
  }
}

}  // namespace gart_cli
