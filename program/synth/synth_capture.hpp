#pragma once
// What `gart synth` writes: a capture in the layout of NeRF-Synthetic (Blender).
//   DIR/transforms_train.json, DIR/transforms_test.json   camera_angle_x; camera to world, OpenGL axes
//   DIR/train/r_N.png, DIR/test/r_N.png                   RGBA, straight alpha
//   DIR/train/r_N_depth.png and so on                     where asked for: distances along the rays, 16 bits
//   DIR/points3d.ply                                      starting points on the surfaces, coloured; in double where
//                                                         an origin is added to all coordinates
//   DIR/scene.json                                        where asked for: the mirror that stands in the scene;
//                                                         a flat one is in DIR/mirror.ply
//   DIR/mesh.ply                                          where asked for: the scene itself, as triangles
//
// A training view through a rolling shutter has the poses of its first and last row. Through another camera than a
// pinhole the transforms name its model and parameters in place of camera_angle_x. The transforms are written last,
// each file whole: a capture that was interrupted is not taken for one.

#include "synth_scene.hpp"

#include <gart/scene/camera.hpp>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace gart_cli {

struct synth_options {
  std::filesystem::path out;
  int train = 48, test = 8;  // views
  int size = 160;            // pixels a side
  int samples = 32;          // paths a pixel
  int points = 10000;
  std::string camera;                        // as gart::seen_through has it; empty: a pinhole
  bool depth = false;                        // depth maps too
  bool mesh = false;                         // the scene's own mesh too
  synth_mirror mirror = synth_mirror::none;  // in the scene, and the file that says so
  std::string origin;                        // "x,y,z", added to all coordinates
  double rolling = 0;  // degrees that the camera turns by while a training view is read; 0: it stands still
  u64 seed = 1;
  int threads = 0;  // 0: all
};

struct synth_limits {
  int low, high;
};
inline constexpr synth_limits synth_views{1, 10000}, synth_size{8, 4096}, synth_samples{1, 4096},
    synth_points{1, 10'000'000}, synth_threads{0, 1024};

inline constexpr double synth_rolling_most = 90;

// Cameras over the upper hemisphere, all looking at the origin: a Fibonacci spiral, the test views between its turns.
std::vector<gart::camera> synth_cameras(int count, int size, bool test);

// Errors: invalid_argument for an option out of its range, unsupported without Embree. Also io_error for a folder that
// cannot be written, or that holds anything but an earlier capture of gart's own.
void write_synth_capture(synth_options const& options, std::function<void(int done, int total)> const& progress = {});

}  // namespace gart_cli
