#pragma once
// The checksums of a capture's names, cameras and images, which a resumed run must find again.

#include <gart/io/dataset.hpp>

#include <nlohmann/json.hpp>

namespace gart_cli {

// {"names", "cameras", "images"}: of the training views and then the test views, with their masks.
nlohmann::json checksums_of(gart::dataset const& data);

}  // namespace gart_cli
