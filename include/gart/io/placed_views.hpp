#pragma once
/// \file
/// Training views with poses from a camera JSON (io/camera_file.hpp) in place of the capture's. A run writes its
/// learned poses as one (train_options::refine_poses). A scene keeps some errors from the time when its poses were
/// wrong. Training anew from the learned poses avoids them (docs/calibration.md).
///
/// Position, rotation and a rolling shutter's motion are taken, by the views' names. Size and lens stay the capture's,
/// so images may have another size. Positions in the file are from no origin. Cameras of other names do not matter, and
/// test views stay where they are. Errors: io_error, naming the file, for a training view that it has no camera of, or
/// one of another shutter.

#include <gart/io/dataset.hpp>

#include <filesystem>

namespace gart {

/// O(views log views).
void place_training_views(dataset& data, std::filesystem::path const& cameras);

}  // namespace gart
