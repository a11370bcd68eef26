#pragma once
// Rays through a tracer by the tree, and what each Gaussian says by itself, without a tree or windows.

#include <gart/render/frame.hpp>
#include <gart/trace/bvh_tracer.hpp>
#include <gart/trace/k_buffer_visitor.hpp>
#include <support/policies.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace gart_test {

using gart::hit;
using gart::u32;
using gart::vec3;

inline bool in_order(hit const& a, hit const& b) { return gart::before(a.t, a.id, b.t, b.id); }
inline bool same(hit const& a, hit const& b) { return a.t == b.t && a.id == b.id && a.alpha == b.alpha; }
inline bool same(std::vector<hit> const& a, std::vector<hit> const& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](hit const& x, hit const& y) { return same(x, y); });
}

// Ray i is rays[i]; its hits go to list[i][most], up to `wanted` of them.
struct collect : gart::ray_program_base {
  using ray_type = gart::ray;
  struct state {
    u32 ray, count;
  };
  gart::ray const* rays;
  hit* list;
  u32* counts;
  u32 number, most, wanted;
  GART_HD bool active(gart::index_t i) const { return i < number; }
  GART_HD state begin(gart::index_t i) const { return {i, 0}; }
  GART_HD gart::ray ray_of(gart::index_t i, state const&) const { return rays[i]; }
  GART_HD bool on_hit(state& s, hit const& h) const {
    if (s.count < most) list[static_cast<std::size_t>(s.ray) * most + s.count] = h;
    return ++s.count < wanted;
  }
  GART_HD void end(gart::index_t i, state const& s) const { counts[i] = s.count; }
};

// Every Gaussian as candidate: the windows without a tree.
template <int Capacity>
struct brute_windows {
  gart::traced_scene scene;
  collect program;
  GART_KERNEL void operator()(gart::index_t i) const {
    gart::trace_windows<Capacity>(scene, program, i, [this](auto const&, auto& visitor) {
      for (u32 k = 0; k < scene.count; ++k) visitor.leaf(k);
    });
  }
};

// One evaluation each, without windows.
struct evaluate_all {
  gart::traced_scene scene;
  gart::ray ray;
  hit* hits;  // t = -1: no hit
  GART_KERNEL void operator()(gart::index_t k) const {
    gart::ray_gaussian const g = scene.gaussians[k];
    gart::ray_peak const r = gart::evaluate(g, ray);
    hits[k] = {gart::is_hit(g, r, scene.near) ? r.t : -1.0f, k, gart::hit_alpha(g, r.d2)};
  }
};

inline void add(gart::gaussian_model& m, vec3 at, float scale, float opacity = 0.0f) {
  for (int k = 0; k < 3; ++k) m.mean.push_back(at[k]), m.log_scale.push_back(std::log(scale)), m.sh.push_back(0);
  for (float q : {1.0f, 0.0f, 0.0f, 0.0f}) m.quaternion.push_back(q);
  m.opacity.push_back(opacity);
}

// Windows without a tree go over all Gaussians again for each window: left out where the case is one of walks.
enum class windows { with_and_without_tree, with_tree };

template <class E>
void check_rays(E& exec, gart::gaussian_model const& model, std::vector<gart::ray> const& rays, float near,
                std::size_t least_hits, windows by = windows::with_and_without_tree) {
  gart::gaussians<E> const scene(exec, model);
  u32 const n = scene.size(), number = static_cast<u32>(rays.size());
  gart::camera at_origin;
  at_origin.width = at_origin.height = 1, at_origin.fx = at_origin.fy = 1;
  gart::render_options options;
  options.near = near;
  gart::frame<E, gart::scene_traits<0>, gart::bvh_tracer<E>> frame(exec);
  frame.prepare(scene.view(), at_origin, options);
  gart::traced_scene const traced{frame.gaussians().data(), n, near};
  gart::buffer<gart::ray, E> in(exec, rays);
  gart::buffer<hit, E> list(exec, std::size_t{number} * n), single(exec, n);
  gart::buffer<u32, E> counts(exec, number);

  std::vector<std::vector<hit>> expected;
  for (gart::ray const& r : rays) {
    gart::parallel_for(exec, "evaluate", n, evaluate_all{traced, r, single.data()});
    expected.emplace_back();
    for (hit const& h : single.to_host())
      if (h.t > near) expected.back().push_back(h);
    std::sort(expected.back().begin(), expected.back().end(), in_order);
    CHECK(expected.back().size() >= least_hits);
  }
  auto const compare = [&](char const* what, u32 wanted) {
    auto const flat = list.to_host();
    auto const found = counts.to_host();
    CAPTURE(what);
    CAPTURE(wanted);
    for (u32 i = 0; i < number; ++i) {
      auto want = expected[i];
      if (want.size() > wanted) want.resize(wanted);
      REQUIRE(found[i] == want.size());
      CHECK(same({flat.begin() + std::size_t{i} * n, flat.begin() + std::size_t{i} * n + found[i]}, want));
    }
  };
  for (u32 wanted : {0xffffffffu, 16u, 17u, 1u}) {
    collect const program{{}, in.data(), list.data(), counts.data(), number, n, wanted};
    frame.trace("bvh", number, program);
    compare("bvh", wanted);
    if (by == windows::with_tree) continue;
    gart::parallel_for(exec, "brute", number, brute_windows<16>{traced, program});
    compare("window of 16", wanted);
  }
  if (by == windows::with_tree) return;
  gart::parallel_for(exec, "brute", number,
                     brute_windows<1>{traced, {{}, in.data(), list.data(), counts.data(), number, n, 40}});
  compare("window of 1", 40);
}

}  // namespace gart_test
