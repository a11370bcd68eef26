#pragma once
/// \file
/// The viewer's server, camera paths and pacing.

#include <gart/view/camera_path.hpp>
#include <gart/view/image_modes.hpp>
#include <gart/view/pacing.hpp>
#include <gart/view/server.hpp>
