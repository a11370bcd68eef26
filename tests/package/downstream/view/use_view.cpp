// gart::view: a model is served, and its path and views are there.
#include <gart/runtime/renderer.hpp>
#include <gart/view/camera_path.hpp>
#include <gart/view/server.hpp>

#include <cstdio>

int main() {
  gart::gaussian_model model;
  model.resize(1, 0);
  model.quaternion[0] = 1;
  gart::configuration_request request;
  request.backend = gart::backend_kind::serial, request.sh_degree = 0;
  auto const renderer = gart::make_renderer(request);
  gart::view_server server(gart::scene_of("one", model, 2));
  auto const render = gart::render_of(*renderer, model, {});
  server.render_next(render, 0);
  gart::camera near, far;
  near.width = far.width = near.height = far.height = 8;
  near.fx = near.fy = far.fx = far.fy = 8;
  far.position.z = 3;
  bool const serves = server.control_address().starts_with("http://127.0.0.1:") && server.idle();
  if (!serves || gart::smooth_path({near, far}, 4).size() != 4) return 1;
  std::printf("view at port %d\n", server.port());
}
