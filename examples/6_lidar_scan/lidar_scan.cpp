// A lidar in a model: the points that a spinning sensor of 64 beams measures from a place, as a point cloud.
// lidar_scan MODEL.ply X Y Z OUT.ply, X Y Z and the points in the capture's own coordinates
#include <gart/core/error.hpp>
#include <gart/rays/lidar.hpp>
#include <gart/runtime/model_file.hpp>
#include <gart/runtime/renderer.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>

int main(int argc, char** argv) try {
  if (argc != 6) return std::fprintf(stderr, "usage: lidar_scan MODEL.ply X Y Z OUT.ply\n"), 2;
  gart::model_file const file = gart::load_model(argv[1]);

  // 64 beams from 25 degrees below the horizon to 15 above, 1024 columns once around.
  std::vector<float> elevations;
  for (int beam = 0; beam < 64; ++beam) elevations.push_back(0.26f - 0.70f * static_cast<float>(beam) / 63);
  // Captures have y down: the sensor's forward is the world's z, its left -x, its up -y. It drives half a unit forward
  // while it looks about.
  gart::sensor_pose pose{.rotation = gart::mat3(0, 0, 1, -1, 0, 0, 0, -1, 0)};
  for (int k = 0; k < 3; ++k) pose.position[k] = std::atof(argv[2 + k]);
  pose.position -= file.origin;  // what the model's coordinates are from
  pose.travel.x = 0.5f;
  gart::ray_list const rays = gart::rays_of(gart::spinning_lidar(elevations, 1024), pose);

  gart::configuration_request request;
  request.sh_degree = file.model.sh_degree, request.kernel_degree = file.kernel_degree;
  auto const renderer = gart::make_renderer(request);
  renderer->set_model(file.model);
  gart::render_options options = file.render;
  options.antialias = 0;  // rays have no pixels
  gart::traced_rays const seen = renderer->trace(rays.batch(), options);

  // A ray that half is stopped measures the distance where that is.
  std::size_t const n = seen.median.size();
  auto const returns = std::count_if(seen.median.begin(), seen.median.end(), [](float t) { return t != gart::no_hit; });
  std::ofstream out(argv[5]);
  out << "ply\nformat ascii 1.0\nelement vertex " << returns << "\nproperty double x\nproperty double y\n"
      << "property double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
  out.precision(12);
  for (std::size_t i = 0; i < n; ++i) {
    if (seen.median[i] == gart::no_hit) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      int const axis = static_cast<int>(k);
      out << file.origin[axis] +
                 (rays.frame[axis] + rays.origins[3 * i + k] + seen.median[i] * rays.directions[3 * i + k])
          << ' ';
    }
    for (std::size_t c = 0; c < 3; ++c)
      out << static_cast<int>(255 * std::clamp(seen.color[3 * i + c], 0.0f, 1.0f)) << (c < 2 ? ' ' : '\n');
  }
  out.close();
  if (!out) throw gart::io_error(argv[5], "cannot be written", "give a path in a folder that is there");
  std::printf("%zu rays, %td points on %s -> %s\n", n, returns, to_string(renderer->configuration().backend), argv[5]);
  return 0;
} catch (std::exception const& e) {
  return std::fprintf(stderr, "lidar_scan: %s\n", e.what()), 1;
}
