#pragma once
/// \file
/// The rays of a view's pixels, as kernels take them, whatever the camera. Kernels cast a pinhole's themselves; those
/// of any other model with one centre are cast once a view into a table of directions, 12 bytes a pixel, and read. So a
/// kernel knows one model, and a lens that is dear to invert is inverted once a pixel.

#include <gart/camera/models.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/exec/stage.hpp>

namespace gart::inline GART_ISA {

/// Trivially copyable: kernels hold one by value.
struct pixel_rays {
  pinhole view;                      ///< of another model: its size and position
  vec3 const* directions = nullptr;  ///< [H][W], of a model that is no pinhole

  /// Through the middle of a pixel of the image.
  GART_HD GART_INLINE primary_ray of(int x, int y) const {
    if (directions) return {directions[static_cast<std::size_t>(y) * view.width + x]};
    return view.ray(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
  }
};

namespace camera_kernels {

// On a host an index is a run of lane_count pixels of a row, elsewhere a pixel.
template <central_camera M>
struct cast_rays {
#if defined(__CUDACC__)
  static constexpr int run = 1;
#else
  static constexpr int run = lane_count;
#endif
  M model;
  vec3* directions;

  GART_HD index_t runs() const { return static_cast<index_t>((model.width + run - 1) / run); }
  GART_KERNEL void operator()(index_t i) const {
    int const first = static_cast<int>(i % runs()) * run, y = static_cast<int>(i / runs());
    vec3* const out = directions + static_cast<std::size_t>(y) * model.width;
    float const u = static_cast<float>(first) + 0.5f, v = static_cast<float>(y) + 0.5f;
#if defined(__CUDACC__)
    out[first] = model.ray(u, v).direction;
#else
    lanes column;
    for (int l = 0; l < run; ++l) column.v[l] = u + static_cast<float>(l);
    vec3_of<lanes> const d = model.ray(column, lanes(v)).direction;
    for (int l = 0; l < run && first + l < model.width; ++l) out[first + l] = {d.x.v[l], d.y.v[l], d.z.v[l]};
#endif
  }
};

}  // namespace camera_kernels

/// Casts the rays of a view, and holds their table.
template <execution E>
class camera_rays {
 public:
  /// No rays yet.
  explicit camera_rays(E& exec) : directions_(exec) {}

  /// View: a camera or a camera model.
  template <class View>
  void cast(E& exec, View const& view) {
    visit_camera(view, [&](auto const& model) { cast_model(exec, model); });
  }

  /// Until the next cast. Of a model without one centre there are none.
  pixel_rays view() const { return rays_; }

 private:
  void cast_model(E&, pinhole const& model) { rays_ = {model, nullptr}; }
  template <camera_model M>
  void cast_model(E&, M const& model) {
    set(model);
  }
  template <central_camera M>
  void cast_model(E& exec, M const& model) {
    directions_.resize(static_cast<std::size_t>(model.width) * model.height);
    camera_kernels::cast_rays<M> const kernel{model, directions_.data()};
    parallel_for(exec, "rays", kernel.runs() * static_cast<index_t>(model.height), kernel);
    set(model);
    rays_.directions = directions_.data();
  }
  void set(camera_base const& model) {
    rays_ = {};
    static_cast<camera_base&>(rays_.view) = model;
  }

  buffer<vec3, E> directions_;
  pixel_rays rays_;
};

}  // namespace gart::inline GART_ISA
