#pragma once
// From the gradient of the image to the gradients of the parameters, by any strategy (strategies.hpp):
//   prepare()  before the forward pass: footprints, tile map and LT buffer, where the strategy records
//   record(), targets()  what the forward pass is given
//   run()      gathers and scatters what the strategy says, then turns the moments of each Gaussian into the gradients
//              of its mean, log-scale, quaternion and opacity. Overwrites `gradients`. Given an error a pixel, [H][W],
//              it also attributes that to the Gaussians: the sum over a Gaussian's hits of weight times error.
//
// Memory beside the gradients: 48 bytes a Gaussian for the moments; where the strategy records, the LT buffer, 4 or
// 16 bytes for each pixel of each box, and where the tracer has none to lend, footprints of 36 bytes a Gaussian and
// lists of 8 a (primitive, tile) pair.

#include <gart/backward/matrix_gather.hpp>
#include <gart/backward/packet_gather.hpp>
#include <gart/backward/scatter.hpp>
#include <gart/backward/strategies.hpp>
#include <gart/render/antialiased.hpp>
#include <gart/render/forward.hpp>
#include <gart/tiles/tile_map.hpp>

#include <string>

namespace gart::inline GART_ISA {

namespace backward_kernels {

// Filter: no_filter, or the camera model's that the records were made through; `scene` is the stored one.
struct no_filter {};

template <class Filter>
struct finish {
  gaussians_view<float const> scene;
  span<ray_gaussian const> records;
  span<float const> moments;
  gaussians_view<float> gradients;
  Filter filter;
  GART_KERNEL void operator()(index_t i) const {
    ray_gaussian const g = records[i];
    geometry_gradient out{vec3(0.0f), vec3(0.0f), {0, 0, 0, 0}, 0};
    if (g.cutoff >= 0) out = gradient_of(moments.data() + std::size_t{moment_stride} * i, load_parameters(scene, i), g);
    for (int k = 0; k < 3; ++k) {
      gradients.mean[std::size_t{3} * i + k] = out.mean[k];
      gradients.log_scale[std::size_t{3} * i + k] = out.log_scale[k];
    }
    float* q = gradients.quaternion + std::size_t{4} * i;
    q[0] = out.rotation.w, q[1] = out.rotation.x, q[2] = out.rotation.y, q[3] = out.rotation.z;
    gradients.opacity[i] = out.opacity;
  }

 private:
  GART_HD GART_INLINE geometry_gradient gradient_of(float const* m, gaussian_parameters const& p,
                                                    ray_gaussian const& g) const {
    if constexpr (std::is_same_v<Filter, no_filter>) {
      return from_moments(m, p, g);
    } else {
      vec3 const mean = filter.from_camera(p);
      filter_at const at = filter.at(mean);
      return pull_back_widened(from_moments(m, widened(p, mean, at.sigma), g), m[0], p, mean, at);
    }
  }
};

}  // namespace backward_kernels

// The tiles that a tracer's footprints are cut into; 8 where it has none to lend.
template <class Tracer>
inline constexpr int tile_size_of = 8;
template <class Tracer>
requires requires { Tracer::tile_size; }
inline constexpr int tile_size_of<Tracer> = Tracer::tile_size;

template <execution E, class Strategy, int TileSize = 8>
class backward {
 public:
  using record_type = typename Strategy::template record<TileSize>;
  static constexpr bool records = Strategy::gather::any;
  static constexpr bool ordered = records && Strategy::ordered;
  static constexpr slot_validity validity = [] {
    if constexpr (!records)
      return slot_validity::cleared;
    else
      return Strategy::validity;
  }();

  explicit backward(E& exec) : moments_(exec), own_prints_(exec), map_(exec), slots_(exec), rows_(exec), last_(exec) {}

  // After the tracer's own preparation: a tracer that has the view's footprints lends them. False, and nothing
  // allocated, where the LT buffer would take more than byte_budget (0: no limit) or have more slots than there are
  // numbers of 32 bits, by which hits know theirs.
  template <class Tracer, class View>
  [[nodiscard]] bool prepare(E& exec, Tracer const& tracer, gaussians_view<float const> scene, View const& view,
                             float alpha_min, float near, u64 byte_budget = 0) {
    if constexpr (records) {
      grid_ = {view.width, view.height};
      if constexpr (requires { tracer.prints(); }) {
        prints_ = &tracer.prints();
      } else {
        own_prints_.template measure<typename Tracer::response_type>(exec, scene, view, alpha_min, near);
        prints_ = &own_prints_;
      }
      if (byte_budget && prints_->slots() * sizeof(entry) > byte_budget) return false;
      if (prints_->slots() >= tile_slots::none) return false;
      if constexpr (requires { tracer.map(); }) {
        lists_ = tracer.map();
      } else {
        map_.build(exec, grid_, *prints_, number_order{});
        lists_ = map_.view();
      }
      slots_.resize(prints_->slots());
      near_ = near;
      if constexpr (validity == slot_validity::recomputed) {
        last_.resize(static_cast<std::size_t>(view.width) * view.height);
      } else {
        stage_scope stage(exec, "clear");
        exec.fill(slots_.data(), 0xff, slots_.size() * sizeof(entry));  // a NaN: not written
      }
    }
    return true;
  }

  record_type record() const {
    if constexpr (records)
      return {prints_->ranges().data(), slots_.data()};
    else
      return {};
  }

  // What the forward pass writes for this pass: its colour, and where rays end if the slots' validity needs it.
  image_targets targets(float* color) {
    image_targets out;
    out.color = color;
    if constexpr (records && validity == slot_validity::recomputed) out.last = last_.data();
    return out;
  }

  // `color` and `color_gradient` are [H][W][3]; `gaussians_in_frame` and the tracer stand as the forward pass used
  // them. `scene` is the stored one, also where these were made from what a filter shows of it
  // (render/antialiased.hpp).
  template <int ShDegree, class Tracer, class View>
  void run(E& exec, Tracer& tracer, gaussians_view<float const> scene, span<ray_gaussian const> gaussians_in_frame,
           View const& view, render_options const& options, int active_degree, span<float const> color,
           span<float const> color_gradient, gaussians<E>& gradients, span<float const> error = {}) {
    using response = typename Tracer::response_type;
    stage_scope stage(exec, "backward");
    moments_.resize(std::size_t{moment_stride} * scene.count);
    // The ordered sums write every Gaussian themselves.
    if constexpr (!ordered || Strategy::scatter::any) moments_.zero();
    if constexpr (!ordered) gradients.sh.zero();
    if constexpr (records) {
      if constexpr (ordered) rows_.resize(prints_->pairs() * pair_gradient<ShDegree>::quads);
      gather_terms<ShDegree, response>(exec, gaussians_in_frame, tracer.rays(), active_degree, color, color_gradient,
                                       error, gradients);
      if constexpr (ordered)
        parallel_for(
            exec, "backward/sum", scene.count * pair_gradient<ShDegree>::quads,
            sum_pairs<ShDegree, typename Strategy::gather>{prints_->pair_offsets(), prints_->pairs(), rows_.data(),
                                                           gradients.sh.data(), moments_.data()});
    }
    if constexpr (Strategy::scatter::any) {
      pixel_order const order{view.width, view.height};
      scatter_program<ShDegree, response, typename Strategy::scatter, E> const program{tracer.rays(),
                                                                                       order,
                                                                                       scene.sh,
                                                                                       active_degree,
                                                                                       options.transmittance_min,
                                                                                       options.max_hits,
                                                                                       gaussians_in_frame.data(),
                                                                                       color.data(),
                                                                                       color_gradient.data(),
                                                                                       error.data(),
                                                                                       gradients.sh.data(),
                                                                                       moments_.data()};
      tracer.trace(exec, "backward/scatter", order.launch_size(), program);
    }
    auto const finish = [&]<class Filter>(Filter const& filter) {
      parallel_for(exec, "backward/finish", scene.count,
                   backward_kernels::finish<Filter>{scene, gaussians_in_frame, moments_, gradients.view(), filter});
    };
    if (options.antialias > 0)
      visit_camera(view, [&](auto const& model) { finish(model.filter(options.antialias)); });
    else
      finish(backward_kernels::no_filter{});
  }

  // Of the last run(), [N][moment_stride]: at error_place the error that is seen through each Gaussian, where run() was
  // given the pixels' errors.
  span<float const> moments() const { return moments_; }

  std::size_t lt_bytes() const { return records ? slots_.size() * sizeof(entry) : 0; }

  // What to throw where prepare() said no without a budget.
  out_of_memory no_room() const {
    u64 const slots = prints_ ? prints_->slots() : 0;
    return out_of_memory("LT buffer", slots * sizeof(entry), 0,
                         std::to_string(slots) +
                             " slots, and there are numbers for 2^32: render smaller, with fewer Gaussians, or take "
                             "row_request.backward = pixel, which needs none");
  }

 private:
  template <class R>
  struct entry_of {
    using type = float;  // no slots
  };
  template <class R>
  requires requires { typename R::entry; }
  struct entry_of<R> {
    using type = typename R::entry;
  };
  using entry = typename entry_of<record_type>::type;

  template <int ShDegree, class Response>
  void gather_terms(E& exec, span<ray_gaussian const> gaussians_in_frame, pixel_rays const& rays, int active_degree,
                    span<float const> image, span<float const> image_gradient, span<float const> error,
                    gaussians<E>& gradients) {
    constexpr gather_sums sums = ordered ? gather_sums::ordered : gather_sums::atomic;
    using by_lane = gather_kernel<ShDegree, Response, typename Strategy::gather, entry, TileSize, sums, validity, E>;
    auto const gather = [&]<class Kernel>(index_t lanes, std::type_identity<Kernel>) {
      parallel_for(exec, "backward/gather", tile_range{grid_.count(), lanes},
                   Kernel{rays, grid_, lists_, prints_->ranges().data(), slots_.data(), gaussians_in_frame.data(),
                          active_degree, image.data(), image_gradient.data(), error.data(), gradients.sh.data(),
                          moments_.data(), prints_->pair_offsets().data(), rows_.data(), last_.data(), near_});
    };
#if defined(__CUDACC__)
    if constexpr (matrix_gather<by_lane>::fits && !requires { Strategy::lane_by_lane; })
      gather(matrix_gather<by_lane>::block_size, std::type_identity<matrix_gather<by_lane>>{});
    else
      gather(64, std::type_identity<by_lane>{});
#else
    gather(1, std::type_identity<packet_gather<by_lane>>{});
#endif
  }

  buffer<float, E> moments_;
  footprints<E, TileSize> own_prints_;
  footprints<E, TileSize> const* prints_ = nullptr;
  tile_grid<TileSize> grid_;
  tile_map<E, TileSize> map_;
  tile_map_view lists_;
  buffer<entry, E> slots_;
  buffer<quad, E> rows_;
  buffer<last_hit, E> last_;
  float near_ = 0;
};

}  // namespace gart::inline GART_ISA
