#pragma once
// The scene in a policy's memory, prepared for its view as a training step prepares it. Also the tracers to prepare it
// with.

#include "support/bench.hpp"
#include "support/scene.hpp"

#include <gart/render/frame.hpp>
#include <gart/trace/bvh_tracer.hpp>
#include <gart/trace/tile_tracer.hpp>

#include <random>

namespace gart_bench {

struct by_bvh {
  template <gart::execution E>
  using tracer = gart::bvh_tracer<E>;
};

template <int TileSize = 8>
struct by_tiles {
  template <gart::execution E>
  using tracer = gart::tile_tracer<E, TileSize>;
};

template <gart::execution E, class By = by_bvh>
struct frame {
  gart::camera view;
  gart::render_options options;
  gart::gaussians<E> gaussians;
  using traced_type = gart::frame<E, gart::scene_traits<sh_degree>, typename By::template tracer<E>>;
  traced_type traced;

  explicit frame(E& exec) : view(the_scene().view()), gaussians(exec, the_scene().model), traced(exec) {}

  gart::gaussians_view<float const> scene() const { return gaussians.view(); }
  std::size_t pixels() const { return static_cast<std::size_t>(view.width) * view.height; }

  // What a traced pass needs.
  void prepare() { traced.prepare(scene(), view, options); }
};

// What stands for an image's gradient, and for a photo.
inline std::vector<float> noise(std::size_t n, float scale) {
  std::mt19937 random(1);
  std::normal_distribution<float> normal(0, scale);
  std::vector<float> out(n);
  for (float& x : out) x = normal(random);
  return out;
}

inline std::vector<gart::u8> noise_bytes(std::size_t n) {
  std::mt19937 random(2);
  std::vector<gart::u8> out(n);
  for (gart::u8& x : out) x = static_cast<gart::u8>(random() >> 24);
  return out;
}

}  // namespace gart_bench
