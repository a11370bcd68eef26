#pragma once
/// \file
/// Training views at other poses than their capture has them: those of a camera JSON (io/camera_file.hpp), as a run
/// writes the poses that it has learned (train_options::refine_poses). A scene that formed while its poses were still
/// off keeps some of that; formed anew from the poses found, it does not (docs/calibration.md).
///
/// Position, rotation and what a rolling shutter moves by are taken, by the views' names; size and lens stay the
/// capture's, so that the two may be of images of another size. Positions in the file are from no origin. Cameras of
/// other names do not matter, and test views stay where they are. Errors: io_error, naming the file, for a training
/// view that it has no camera of, or one of another shutter.

#include <gart/io/dataset.hpp>

#include <filesystem>

namespace gart {

/// O(views log views).
void place_training_views(dataset& data, std::filesystem::path const& cameras);

}  // namespace gart
