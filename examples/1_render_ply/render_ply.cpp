// Renders a splat file from in front of it: render_ply MODEL.ply OUT.png
#include <gart/core/error.hpp>
#include <gart/io/image_file.hpp>
#include <gart/io/ply.hpp>
#include <gart/runtime/renderer.hpp>

#include <algorithm>
#include <cstdio>
#include <exception>

// The p-th of the coordinates along one axis, 0 <= p <= 1: models have stray Gaussians far out, so no mean and no
// maximum.
double quantile(gart::gaussian_model const& model, int axis, double p) {
  std::vector<float> values;
  for (std::size_t i = 0; i < model.size(); ++i) values.push_back(model.mean[3 * i + axis]);
  auto const at = values.begin() + static_cast<std::ptrdiff_t>(p * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

int main(int argc, char** argv) try {
  if (argc != 3) return std::fprintf(stderr, "usage: render_ply MODEL.ply OUT.png\n"), 2;
  gart::gaussian_model const model = gart::read_splat_ply(argv[1]);
  if (model.size() == 0) throw gart::io_error(argv[1], "has no Gaussians");

  // Looks along +z at the middle of the model, y down, from as far as makes it fill the image.
  gart::camera view;
  view.width = 640, view.height = 480;
  view.fx = view.fy = 600, view.cx = 320, view.cy = 240;
  double size = 0;
  for (int axis = 0; axis < 3; ++axis) {
    view.position[axis] = quantile(model, axis, 0.5);
    size = std::max(size, quantile(model, axis, 0.95) - quantile(model, axis, 0.05));
  }
  view.position.z -= 1.8 * size + 0.1;

  gart::configuration_request request;
  request.sh_degree = model.sh_degree;
  auto const renderer = gart::make_renderer(request);
  renderer->set_model(model);
  gart::render_options options;
  options.background = gart::vec3(1.0f);
  gart::rendered const image = renderer->render(view, options);
  gart::write_png(argv[2], gart::to_8bit(image.color));
  std::printf("%zu Gaussians on %s -> %s\n", model.size(), to_string(renderer->configuration().backend), argv[2]);
  return 0;
} catch (std::exception const& e) {
  return std::fprintf(stderr, "render_ply: %s\n", e.what()), 1;
}
