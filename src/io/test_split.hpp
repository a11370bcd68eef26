#pragma once
// Which frames of a capture are trained on, and which are kept for testing.

#include "capture.hpp"

#include <gart/io/dataset.hpp>

#include <string>

namespace gart::io {

// Gives every frame its role; returns the rule in words.
std::string assign_roles(capture& c, dataset_options const& options);

}  // namespace gart::io
