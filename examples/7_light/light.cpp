// A mirror ball and a lamp put into a model, seen by the first camera of a capture, better with every pass.
// light MODEL.ply CAPTURE X Y Z RADIUS OUT.png, the ball's place and size in the capture's own coordinates
#include <gart/io/dataset.hpp>
#include <gart/io/image_file.hpp>
#include <gart/runtime/model_file.hpp>
#include <gart/runtime/path_renderer.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>

int main(int argc, char** argv) try {
  if (argc != 8) return std::fprintf(stderr, "usage: light MODEL.ply CAPTURE X Y Z RADIUS OUT.png\n"), 2;
  gart::model_file const file = gart::load_model(argv[1]);
  gart::camera view = gart::load_cameras(argv[2]).at(0).view;
  view.position -= file.origin;  // what the model's coordinates are from
  gart::vec3d place(std::atof(argv[3]), std::atof(argv[4]), std::atof(argv[5]));
  gart::vec3 const center(place - file.origin);
  float const radius = std::strtof(argv[6], nullptr);

  // A ball of triangles; its normals make it smooth.
  gart::light::mesh ball;
  gart::u32 const around = 96, down = 48;
  for (gart::u32 j = 0; j <= down; ++j)
    for (gart::u32 i = 0; i <= around; ++i) {
      float const a = 6.2831853f * static_cast<float>(i) / around, b = 3.1415927f * static_cast<float>(j) / down;
      gart::vec3 const n(std::sin(b) * std::sin(a), std::cos(b), std::sin(b) * std::cos(a));
      ball.positions.push_back(center + radius * n), ball.normals.push_back(n);
      gart::u32 const at = j * (around + 1) + i, below = at + around + 1;
      if (i == around || j == down) continue;
      if (j > 0) ball.triangles.insert(ball.triangles.end(), {at, below, at + 1});
      if (j + 1 < down) ball.triangles.insert(ball.triangles.end(), {at + 1, below, below + 1});
    }
  gart::light::scene scene;
  scene.meshes.push_back(std::move(ball));
  scene.materials.resize(1), scene.lights.resize(1);
  scene.materials[0].kind = gart::light::material_kind::mirror;
  scene.materials[0].base_color = gart::vec3(0.95f);
  scene.lights[0].position = gart::vec3(view.position);  // a point, as by itself
  scene.lights[0].color = gart::vec3(30 * radius * radius);

  gart::configuration_request request;
  request.sh_degree = file.model.sh_degree, request.kernel_degree = file.kernel_degree;
  auto const tracer = gart::make_path_renderer(request);
  tracer->set_model(file.model);
  tracer->set_scene(scene);
  gart::render_options options = file.render;
  options.antialias = 0;  // paths have no filter
  tracer->begin(view, options, {});
  while (tracer->samples() < 64) {
    tracer->add(8);
    gart::write_png(argv[7], tracer->picture_8bit());
    std::printf("%d samples a pixel -> %s\n", tracer->samples(), argv[7]);
  }
  return 0;
} catch (std::exception const& e) {
  return std::fprintf(stderr, "light: %s\n", e.what()), 1;
}
