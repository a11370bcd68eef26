#pragma once
/// \file
/// Captures, models, meshes and images in and out. The other parts of gart.hpp are runtime.hpp, view.hpp and
/// templates.hpp.

#include <gart/core/version.hpp>
#include <gart/io/camera_file.hpp>
#include <gart/io/dataset.hpp>
#include <gart/io/image_file.hpp>
#include <gart/io/mesh_file.hpp>
#include <gart/io/origin.hpp>
#include <gart/io/ply.hpp>
#include <gart/io/scene_file.hpp>
#include <gart/io/splat_file.hpp>
#include <gart/scene/similarity.hpp>
