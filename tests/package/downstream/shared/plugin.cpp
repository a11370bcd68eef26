// gart::cpu inside a shared object.
#include <gart/runtime/renderer.hpp>

extern "C" float brightest() {
  gart::gaussian_model model;
  model.resize(1, 0);
  model.mean = {0, 0, 3}, model.log_scale = {-1, -1, -1}, model.quaternion = {1, 0, 0, 0};
  model.opacity = {4}, model.sh = {1.5f, 0, 0};
  gart::camera view;
  view.width = view.height = 16, view.fx = view.fy = 16, view.cx = view.cy = 8;
  gart::configuration_request request;
  request.backend = gart::backend_kind::openmp, request.sh_degree = 0;
  auto const renderer = gart::make_renderer(request);
  renderer->set_model(model);
  float most = 0;
  for (float const v : renderer->render(view, {}).color.data) most = v > most ? v : most;
  return most;
}
