#pragma once
// compare.html: several training runs in one page that needs no other file and no network. Its contents are from their
// metrics.json, config.json and history.json, and the images of their renders/.

#include "history.hpp"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace gart_cli {

// Lines that a reader can tell apart.
inline constexpr std::size_t most_compared = 6;

// A finished run, from its folder.
struct compared_run {
  std::filesystem::path folder;
  std::string name;  // the end of the folder's path, as long as it takes to tell the runs apart
  nlohmann::json metrics, options;
  history course{1};
};

// What `gart train` left in the folders, in their order. io_error for one that no run finished in.
std::vector<compared_run> read_runs(std::vector<std::filesystem::path> const& folders);

// An option or choice that differs between runs: its name and a value for each run, "-" for none.
struct difference {
  std::string name;
  std::vector<std::string> values;
};
std::vector<difference> differences(std::vector<compared_run> const& runs);

// io_error where an image of a run cannot be read.
std::string compare_page(std::vector<compared_run> const& runs);

}  // namespace gart_cli
