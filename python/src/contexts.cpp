// Rays that no image has, and what a forward pass leaves for its backward pass.
#include "bindings.hpp"

namespace gart_python {

namespace {

using shared_renderer = std::shared_ptr<python_renderer>;

struct context {
  shared_renderer owner;  // outlives what it made
  std::unique_ptr<gart::forward_context> it;
  std::vector<std::int64_t> shape;  // of what was shown: [H, W], or [R]
  std::vector<lent> rays;           // are read again
  lent bound_features;              // the same
  std::int64_t features = 0;        // of a Gaussian
  ~context() {
    std::lock_guard<std::mutex> const one(owner->mutex);
    it.reset();
  }
};

std::vector<std::int64_t> with_channels(std::vector<std::int64_t> shape, std::int64_t channels = 3) {
  shape.push_back(channels);
  return shape;
}

gart::span<float const> span_of(lent const& given) {
  float const* const data = given.data<float>();
  return {data, data ? given.size() : 0};
}

std::unique_ptr<context> forward(shared_renderer const& r, gart::camera const& view, py::object const& options,
                                 std::array<py::object, 6> const& targets, py::kwargs const& given) {
  gart::render_options const o = options_of(options, given, r->usual);
  std::vector<lent> kept;
  gart::render_targets const to = targets_of(*r, view, "Renderer.forward", targets, kept);
  auto out = std::make_unique<context>();
  out->owner = r, out->shape = {view.height, view.width};
  out->features = r->features, out->bound_features = r->bound_features;
  out->it = without_gil(r->mutex, [&] { return r->it->forward(view, o, to); });
  return out;
}

// Directions, and origins and ends where they are given.
gart::ray_batch rays_of(std::string const& call, py::object const& directions, py::object const& origins,
                        py::object const& t_max, std::array<double, 3> const& frame, place const& where,
                        std::vector<lent>& kept) {
  std::string const names[] = {call + ": directions", call + ": origins", call + ": t_max"};
  kept.clear();
  kept.push_back(lent::of<float>(directions, {names[0].c_str(), {-1, 3}}, where));
  std::int64_t const n = kept[0].shape()[0];
  kept.push_back(lent::if_given<float>(origins, {names[1].c_str(), {n, 3}}, where));
  kept.push_back(lent::if_given<float>(t_max, {names[2].c_str(), {n}}, where));
  return {gart::vec3d(frame[0], frame[1], frame[2]), span_of(kept[1]), span_of(kept[0]), span_of(kept[2])};
}

std::unique_ptr<context> forward_rays(shared_renderer const& r, py::object const& directions, py::object const& origins,
                                      py::object const& t_max, std::array<double, 3> const& frame,
                                      py::object const& color, py::object const& transmittance, py::object const& depth,
                                      py::object const& features, py::object const& options, py::kwargs const& given) {
  gart::render_options const o = options_of(options, given, r->usual);
  auto out = std::make_unique<context>();
  out->owner = r, out->features = r->features, out->bound_features = r->bound_features;
  gart::ray_batch const rays = rays_of("Renderer.forward_rays", directions, origins, t_max, frame, r->where, out->rays);
  out->shape = {rays.count()};
  std::int64_t const n = rays.count();
  lent const to[] = {
      lent::if_given<float>(color, {"Renderer.forward_rays: color", {n, 3}, true}, r->where),
      lent::if_given<float>(transmittance, {"Renderer.forward_rays: transmittance", {n}, true}, r->where),
      lent::if_given<float>(depth, {"Renderer.forward_rays: depth", {n}, true}, r->where),
      lent::if_given<float>(features, {"Renderer.forward_rays: features", {n, r->features}, true}, r->where)};
  gart::batch_targets targets;
  targets.color = to[0].data<float>(), targets.transmittance = to[1].data<float>(), targets.depth = to[2].data<float>();
  targets.channels.features = to[3].data<float>();
  out->it = without_gil(r->mutex, [&] { return r->it->forward(rays, o, targets); });
  return out;
}

void backward(context& c, py::object const& color, py::object const& depth, py::object const& transmittance,
              std::array<py::object, 5> const& gaussians, py::object const& pose, py::object const& origins,
              py::object const& directions, py::object const& by_features, py::object const& features, bool detached) {
  place const& where = c.owner->where;
  lent const by[] = {
      lent::if_given<float>(color, {"Context.backward: color_gradient", with_channels(c.shape)}, where),
      lent::if_given<float>(depth, {"Context.backward: depth_gradient", c.shape}, where),
      lent::if_given<float>(transmittance, {"Context.backward: transmittance_gradient", c.shape}, where),
      lent::if_given<float>(by_features, {"Context.backward: features_gradient", with_channels(c.shape, c.features)},
                            where)};
  std::vector<lent> kept;
  gart::gradient_targets to;
  if (!gaussians[0].is_none())
    to.gaussians = parameters_of<float>(gaussians, "Context.backward", c.owner->count, where, kept);
  std::vector<std::int64_t> const of_rays{c.shape[0], 3};
  lent const more[] = {
      lent::if_given<float>(pose, {"Context.backward: pose", {gart::pose_gradient::floats}, true}, where),
      lent::if_given<float>(origins, {"Context.backward: origins", of_rays, true}, where),
      lent::if_given<float>(directions, {"Context.backward: directions", of_rays, true}, where),
      lent::if_given<float>(features, {"Context.backward: features", {c.owner->count, c.features}, true}, where)};
  to.pose = more[0].data<float>();
  to.rays = {more[1].data<float>(), more[2].data<float>()};
  if (auto* const data = more[3].data<float>())
    to.channels.features = {data, static_cast<gart::index_t>(c.owner->count), static_cast<int>(c.features)};
  gart::output_gradients const all{span_of(by[0]), span_of(by[1]), span_of(by[2]), {span_of(by[3]), detached}};
  without_gil(c.owner->mutex, [&] { c.it->backward(all, to); });
}

// Memory by its address, of tensors that gart.torch made itself: their types, shapes and places are known. 0: none.
using addresses = std::array<std::uintptr_t, 4>;  // of colour, transmittance, depth, features

float* at(std::uintptr_t address) { return reinterpret_cast<float*>(address); }

std::unique_ptr<context> forward_at(shared_renderer const& r, gart::camera const& view, gart::render_options const& o,
                                    addresses const& to, bool record) {
  gart::render_targets const targets{at(to[0]), at(to[1]), at(to[2]), nullptr, nullptr, {at(to[3])}};
  if (!record) {
    without_gil(r->mutex, [&] { r->it->render_to(view, o, targets); });
    return nullptr;
  }
  auto out = std::make_unique<context>();
  out->owner = r, out->shape = {view.height, view.width};
  out->features = r->features, out->bound_features = r->bound_features;
  out->it = without_gil(r->mutex, [&] { return r->it->forward(view, o, targets); });
  return out;
}

// To the five arrays of Gaussians, features, the pose, directions and origins.
void backward_at(context& c, addresses const& by, std::array<std::uintptr_t, 9> const& out) {
  auto const elements = static_cast<std::size_t>(c.shape.size() == 2 ? c.shape[0] * c.shape[1] : c.shape[0]);
  auto const span = [&](std::size_t k, std::size_t channels) {
    return gart::span<float const>{at(by[k]), by[k] ? elements * channels : 0};
  };
  auto const n = static_cast<gart::index_t>(c.owner->count);
  gart::gradient_targets to;
  if (out[0]) {
    to.gaussians.mean = at(out[0]), to.gaussians.log_scale = at(out[1]), to.gaussians.quaternion = at(out[2]);
    to.gaussians.opacity = at(out[3]), to.gaussians.sh = at(out[4]);
    to.gaussians.count = n, to.gaussians.sh_degree = c.owner->request.sh_degree;
  }
  if (out[5]) to.channels.features = {at(out[5]), n, static_cast<int>(c.features)};
  to.pose = at(out[6]), to.rays = {at(out[8]), at(out[7])};
  auto const channels = static_cast<std::size_t>(c.features);
  gart::output_gradients const all{span(0, 3), span(2, 1), span(1, 1), {span(3, channels), false}};
  without_gil(c.owner->mutex, [&] { c.it->backward(all, to); });
}

py::dict trace(python_renderer& r, py::object const& directions, py::object const& origins, py::object const& t_max,
               std::array<double, 3> const& frame, py::object const& options, bool features, py::kwargs const& given) {
  gart::render_options const o = options_of(options, given, r.usual);
  std::vector<lent> kept;
  gart::ray_batch const rays = rays_of("Renderer.trace", directions, origins, t_max, frame, {}, kept);
  gart::traced_rays seen = without_gil(r.mutex, [&] { return r.it->trace(rays, o, features); });
  std::int64_t const n = rays.count();
  py::dict out;
  if (features && r.features > 0) out["features"] = owned_array({n, r.features}, std::move(seen.features));
  out["color"] = owned_array({n, 3}, std::move(seen.color));
  out["transmittance"] = owned_array({n}, std::move(seen.transmittance));
  out["depth"] = owned_array({n}, std::move(seen.depth)), out["median"] = owned_array({n}, std::move(seen.median));
  out["first"] = owned_array({n}, std::move(seen.first)), out["hits"] = owned_array({n}, std::move(seen.hits));
  out["first_id"] = owned_array({n}, std::move(seen.first_id));
  out["median_id"] = owned_array({n}, std::move(seen.median_id));
  out["top_id"] = owned_array({n}, std::move(seen.top_id));
  return out;
}

py::dict list_hits(python_renderer& r, py::object const& directions, py::object const& origins, py::object const& t_max,
                   std::array<double, 3> const& frame, py::object const& options, py::kwargs const& given) {
  gart::render_options const o = options_of(options, given, r.usual);
  std::vector<lent> kept;
  gart::ray_batch const rays = rays_of("Renderer.list_hits", directions, origins, t_max, frame, {}, kept);
  gart::hit_lists hits = without_gil(r.mutex, [&] { return r.it->list_hits(rays, o); });
  auto const n = static_cast<std::int64_t>(hits.ids.size());
  py::dict out;
  out["offsets"] = owned_array({static_cast<std::int64_t>(rays.count()) + 1}, std::move(hits.offsets));
  out["ids"] = owned_array({n}, std::move(hits.ids)), out["t"] = owned_array({n}, std::move(hits.t));
  out["alpha"] = owned_array({n}, std::move(hits.alpha)), out["weight"] = owned_array({n}, std::move(hits.weight));
  return out;
}

}  // namespace

void bind_contexts(py::module_& m, renderer_class& renderer) {
  auto const none = py::none();
  std::array<double, 3> const origin{0, 0, 0};
  py::class_<context>(m, "Context",
                      R"(What a forward pass leaves for its backward pass, of Renderer.forward or forward_rays.

Others may run in between. Bound Gaussians, features and rays must stay as they are until the last backward; where the
renderer has another model by then it raises InvalidArgument.)")
      .def(
          "backward",
          [](context& c, py::object const& color, py::object const& depth, py::object const& transmittance,
             py::object a, py::object b, py::object d, py::object e, py::object f, py::object const& pose,
             py::object const& origins, py::object const& directions, py::object const& by_features,
             py::object const& features, bool detached) {
            backward(c, color, depth, transmittance, {a, b, d, e, f}, pose, origins, directions, by_features, features,
                     detached);
          },
          py::arg("color_gradient") = none, py::kw_only(), py::arg("depth_gradient") = none,
          py::arg("transmittance_gradient") = none, py::arg("mean") = none, py::arg("log_scale") = none,
          py::arg("quaternion") = none, py::arg("opacity") = none, py::arg("sh") = none, py::arg("pose") = none,
          py::arg("origins") = none, py::arg("directions") = none, py::arg("features_gradient") = none,
          py::arg("features") = none, py::arg("detached") = false,
          R"(From dL/d what was shown to what is asked for, all float32 in memory of the policy; may be called again.

color_gradient                           [H, W, 3] or [R, 3]; None: zero
depth_gradient, transmittance_gradient   [H, W] or [R]; of a view faster by a Renderer with depth=True
features_gradient                        [H, W, F] or [R, F]; detached=True: by them features alone have gradients
mean, log_scale, quaternion, opacity, sh dL/d each, of Model's shapes, overwritten; all of them or none
pose                                     [6], of a view: dL/d the camera's position, world units, then by a small turn w
                                         of the camera about it, world axes: a direction d becomes d + w x d
origins, directions                      [R, 3], dL/d rays
features                                 [N, F], dL/d features, overwritten)")
      .def("_backward_at", &backward_at);

  renderer.def("_forward_at", &forward_at)
      .def(
          "forward",
          [](shared_renderer const& r, gart::camera const& view, py::object const& options, py::object a, py::object b,
             py::object c, py::object d, py::object e, py::object f, py::kwargs const& given) {
            return forward(r, view, options, {a, b, c, d, e, f}, given);
          },
          py::arg("camera"), py::arg("options") = none, py::kw_only(), py::arg("color") = none,
          py::arg("transmittance") = none, py::arg("depth") = none, py::arg("hits") = none, py::arg("rgba") = none,
          py::arg("features") = none, py::others("settings"),
          "As render_to, with what gradients need: returns a Context.")
      .def("forward_rays", &forward_rays, array_arg("directions"), py::arg("origins") = none, py::arg("t_max") = none,
           py::arg("frame") = origin, py::kw_only(), py::arg("color") = none, py::arg("transmittance") = none,
           py::arg("depth") = none, py::arg("features") = none, py::arg("options") = none, py::others("settings"),
           R"(What rays see, from and to memory of the policy, with what gradients need: returns a Context.

Rays as of trace; color [R, 3], transmittance and depth [R], features [R, F], float32.)")
      .def("trace", &trace, array_arg("directions"), py::arg("origins") = none, py::arg("t_max") = none,
           py::arg("frame") = origin, py::arg("options") = none, py::kw_only(), py::arg("features") = false,
           py::others("settings"),
           R"(What rays see that no image has, from arrays of the host, as a dictionary of new numpy arrays.

directions  float32 [R, 3], of any length but 0
origins     float32 [R, 3], relative to frame, a point in double; None: all rays begin there
t_max       float32 [R], where rays end, world units along the ray; None: nowhere

color [R, 3], transmittance, depth (sum of weight * t), median (t of the hit that brings the transmittance below 0.5) and
first (t of the first hit; -1 where there is none) [R]; hits, first_id, median_id, top_id (of the largest weight) uint32 [R]. With
features=True, where there are any, features [R, F].)")
      .def("list_hits", &list_hits, array_arg("directions"), py::arg("origins") = none, py::arg("t_max") = none,
           py::arg("frame") = origin, py::arg("options") = none, py::others("settings"),
           R"(All hits of rays in order, as trace takes them: a dictionary of new numpy arrays.

offsets  uint64 [R + 1]: hits of ray r are [offsets[r], offsets[r + 1]) of the others
ids uint32, t, alpha, weight float32: Gaussian, distance, opacity, transmittance before the hit times alpha)");
}

}  // namespace gart_python
