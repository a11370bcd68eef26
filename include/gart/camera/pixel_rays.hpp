#pragma once
/// \file
/// The rays of a view's pixels, as kernels take them, whatever the camera. Kernels cast a pinhole's rays themselves.
/// Any other model with one centre casts its rays once a view into a table of directions, 12 bytes a pixel. So a kernel
/// knows one model, and a lens that is costly to invert is inverted once a pixel. Rays without one centre have a table
/// of origins too. They have a type of their own, so that kernels for other rays stay as they are.

#include <gart/camera/models.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/exec/stage.hpp>

namespace gart { inline namespace GART_ISA {

/// Trivially copyable: kernels hold one by value.
struct pixel_rays {
  using ray_type = primary_ray;          ///< of a pixel
  static constexpr bool central = true;  ///< all begin at the frame's origin
  pinhole view;                          ///< of another model: its size and position
  vec3 const* directions = nullptr;      ///< [H][W], of a model that is no pinhole

  /// Through the middle of a pixel of the image.
  GART_HD GART_INLINE primary_ray of(int x, int y) const {
    if (directions) return {directions[static_cast<std::size_t>(y) * view.width + x]};
    return view.ray(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
  }
};

/// The same of rays with an origin each.
struct origin_rays {
  using ray_type = ray;                   ///< of a pixel
  static constexpr bool central = false;  ///< all begin at the frame's origin
  pinhole view;                           ///< its size and position
  vec3 const* directions = nullptr;       ///< [H][W]
  vec3 const* origins = nullptr;          ///< [H][W]; null: the view's rays have one centre

  /// Through the middle of a pixel of the image.
  GART_HD GART_INLINE ray of(int x, int y) const {
    std::size_t const at = static_cast<std::size_t>(y) * view.width + x;
    return {origins[at], directions[at]};
  }
};

/// Kernels take either.
template <class R>
concept rays_of_pixels = std::same_as<R, pixel_rays> || std::same_as<R, origin_rays>;

namespace camera_kernels {

// An index is a pixel.
template <camera_model M>
struct cast_origins {
  M model;
  vec3 *directions, *origins;
  GART_KERNEL void operator()(index_t i) const {
    index_t const width = static_cast<index_t>(model.width);
    ray const r = model.ray(static_cast<float>(i % width) + 0.5f, static_cast<float>(i / width) + 0.5f);
    directions[i] = r.direction, origins[i] = r.origin;
  }
};

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
  explicit camera_rays(E& exec) : directions_(exec), origins_(exec) {}

  /// View: a camera or a camera model.
  template <class View>
  void cast(E& exec, View const& view) {
    visit_camera(view, [&](auto const& model) { cast_model(exec, model); });
  }

  /// Until the next cast. Of a model without one centre there are none.
  pixel_rays view() const { return rays_; }
  /// The same, of a model without one centre alone.
  origin_rays with_origins() const { return from_origins_; }

 private:
  void cast_model(E&, pinhole const& model) { set(model), rays_.view = model; }
  template <camera_model M>
  void cast_model(E& exec, M const& model) {
    std::size_t const pixels = static_cast<std::size_t>(model.width) * model.height;
    directions_.resize(pixels), origins_.resize(pixels);
    parallel_for(exec, "rays", static_cast<index_t>(pixels),
                 camera_kernels::cast_origins<M>{model, directions_.data(), origins_.data()});
    set(model);
    from_origins_ = {rays_.view, directions_.data(), origins_.data()};
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
    rays_ = {}, from_origins_ = {};
    static_cast<camera_base&>(rays_.view) = model;
  }

  buffer<vec3, E> directions_, origins_;
  pixel_rays rays_;
  origin_rays from_origins_;
};

}}  // namespace gart::GART_ISA
