// checkpoint.gart, through a small serial session: what it accepts must be a state that it can go on from, and what it
// refuses must leave it where it was.

#include "fuzz/support.hpp"

#include <gart/runtime/session.hpp>

#include <memory>

namespace gart_fuzz {
namespace {

gart::dataset two_views() {
  gart::dataset data;
  for (int i = 0; i < 2; ++i) {
    gart::dataset_view v;
    v.name = std::to_string(i);
    v.view.width = v.view.height = 4;
    v.view.fx = v.view.fy = 4;
    v.view.cx = v.view.cy = 2;
    v.view.position.z = -2.0 - i;
    v.image = gart::image8(4, 4, 3, 128);
    data.train.push_back(v);
  }
  return data;
}

std::unique_ptr<gart::session> small_session(gart::dataset const& data, gart::densify_kind densify) {
  gart::gaussian_model start;
  start.resize(2, 0);
  start.quaternion[0] = start.quaternion[4] = 1;
  gart::train_options options;
  options.iterations = 2000, options.max_gaussians = 8, options.densify = densify;
  return gart::make_session({gart::backend_kind::serial, gart::tracer_kind::bvh, "pixel", 0}, options, data, &start);
}

bool same(gart::gaussian_model const& a, gart::gaussian_model const& b) {
  return a.mean == b.mean && a.log_scale == b.log_scale && a.quaternion == b.quaternion && a.opacity == b.opacity &&
         a.sh == b.sh;
}

bool goes_on_from(scratch_folder const& folder, fs::path const& file, gart::densify_kind densify) {
  static gart::dataset const data = two_views();
  std::unique_ptr<gart::session> const session = small_session(data, densify);
  gart::gaussian_model const before = session->model();
  bool const loaded = accepted(folder, [&] { session->load(file); });
  if (!loaded) {
    promise(session->steps_done() == 0 && same(session->model(), before), "a refused checkpoint that left its mark");
    return false;
  }
  int const step = session->steps_done();
  promise(step >= 0, "a negative step");
  promise(session->step().step == step + 1, "a step that does not count");
  return true;
}

}  // namespace

bool checkpoint(std::string_view input) {
  static scratch_folder const folder("checkpoint");
  fs::path const file = folder.put("checkpoint.gart", input);
  bool const first = goes_on_from(folder, file, gart::densify_kind::mcmc);
  bool const second = goes_on_from(folder, file, gart::densify_kind::adc);
  promise(first == second, "a checkpoint that only one kind of densification accepts");
  return first;
}

}  // namespace gart_fuzz
