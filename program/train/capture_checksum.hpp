#pragma once
// What a run that goes on must find again: the checksums of a capture's names, cameras and images.

#include <gart/io/dataset.hpp>

#include <nlohmann/json.hpp>

namespace gart_cli {

// {"names", "cameras", "images"}: of the training views and then the test views, with their masks.
nlohmann::json checksums_of(gart::dataset const& data);

}  // namespace gart_cli
