#pragma once
// Renders, gradients and hit lists of a small scene through the library's templates, for comparison with the oracle.

#include <gart/backward/backward.hpp>
#include <gart/trace/bvh_tracer.hpp>
#include <gart/trace/tile_tracer.hpp>
#if defined(GART_WITH_EMBREE)
#include <gart/trace/embree_tracer.hpp>
#endif

#include <stdexcept>
#include <string>
#include <vector>

namespace gart_test {

enum class tracer_kind { bvh, embree, tiles };

template <class E>
struct traced {
  std::vector<float> color, transmittance, depth;  // [H][W][3], [H][W], [H][W]
  std::vector<gart::u32> hits;                     // [H][W]
};

// Counts with a null list, then writes into the places found by the count.
struct list_program {
  using ray_type = gart::primary_ray;
  struct state {
    gart::vec3 direction;
    gart::u32 count = 0;
    gart::u32 at = 0;
    float transmittance = 1;
  };
  gart::pixel_rays rays;
  gart::pixel_order order;
  float transmittance_min;
  gart::u32 max_hits;
  gart::u32* counts;
  gart::u32 const* offsets;
  gart::hit* list;

  GART_HD bool active(gart::index_t i) const { return order.inside(order.at(i)); }
  GART_HD gart::pixel at(gart::index_t i) const { return order.at(i); }
  GART_HD state begin(gart::index_t i) const {
    state s;
    s.direction = gart::pixel_ray(rays, order.at(i)).direction;
    if (list) s.at = offsets[order.address(order.at(i))];
    return s;
  }
  GART_HD gart::primary_ray ray_of(gart::index_t, state const& s) const { return {s.direction}; }
  GART_HD bool on_hit(state& s, gart::hit const& h) const {
    if (list) list[s.at + s.count] = h;
    ++s.count;
    s.transmittance *= 1.0f - h.alpha;
    return s.transmittance >= transmittance_min && s.count != max_hits;
  }
  GART_HD void end(gart::index_t i, state const& s) const { counts[order.address(order.at(i))] = s.count; }
};

namespace detail {

template <class Response = gart::generalized_gaussian<>, class E, class F>
auto with_tracer(E& exec, tracer_kind kind, F&& body) {
  if (kind == tracer_kind::bvh) {
    gart::bvh_tracer<E, Response> tracer(exec);
    return body(tracer);
  }
  if (kind == tracer_kind::tiles) {
    gart::tile_tracer<E, 8, Response> tracer(exec);
    return body(tracer);
  }
#if defined(GART_WITH_EMBREE)
  if constexpr (!E::device) {
    gart::embree_tracer<E, Response> tracer(exec);
    return body(tracer);
  }
#endif
  throw std::runtime_error("no such tracer for this policy");
}

template <class F>
auto with_degree(int degree, F&& body) {
  switch (degree) {
    case 0:
      return body(std::integral_constant<int, 0>{});
    case 1:
      return body(std::integral_constant<int, 1>{});
    case 2:
      return body(std::integral_constant<int, 2>{});
    default:
      return body(std::integral_constant<int, 3>{});
  }
}

}  // namespace detail

template <int Degree, class Tracer, class E>
traced<E> render_by(E& exec, Tracer& tracer, gart::gaussian_model const& model, gart::camera const& view,
                    gart::render_options const& options, int active_degree) {
  gart::gaussians<E> scene(exec, model);
  gart::frame_records<E> records(exec);
  std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
  gart::buffer<float, E> color(exec, 3 * pixels), transmittance(exec, pixels), depth(exec, pixels);
  gart::buffer<gart::u32, E> hits(exec, pixels);
  auto const constant = std::as_const(scene).view();
  gart::antialiased<E> filter(exec);
  auto const seen = filter.of(exec, constant, view, options.antialias);
  records.template prepare<typename Tracer::response_type>(exec, seen, view.position, options.alpha_min);
  tracer.prepare(exec, seen, records.view(), view, options.alpha_min, options.near);
  gart::forward<Degree>(exec, tracer, constant, view, options, active_degree,
                        {color.data(), transmittance.data(), depth.data(), hits.data()}, gart::record_none{});
  return {color.to_host(), transmittance.to_host(), depth.to_host(), hits.to_host()};
}

template <class E>
traced<E> render_scene(E& exec, gart::gaussian_model const& model, gart::camera const& view,
                       gart::render_options const& options, int active_degree, tracer_kind kind) {
  return detail::with_tracer(exec, kind, [&](auto& tracer) {
    return detail::with_degree(model.sh_degree, [&](auto degree) {
      return render_by<degree>(exec, tracer, model, view, options, active_degree);
    });
  });
}

// An error a pixel, [H][W], and what of it the backward pass attributes to each Gaussian.
struct attributed_error {
  std::vector<float> of_pixels, of_gaussians;
};

template <int Degree, class Strategy, class Tracer, class E>
gart::gaussian_model gradients_by(E& exec, gart::gaussian_model const& model, gart::camera const& view,
                                  gart::render_options const& options, int active_degree,
                                  std::vector<float> const& color_gradient, attributed_error* error = nullptr) {
  Tracer tracer(exec);
  gart::gaussians<E> scene(exec, model);
  gart::gaussians<E> gradients(exec, scene.size(), model.sh_degree);
  gart::frame_records<E> records(exec);
  gart::backward<E, Strategy, gart::tile_size_of<Tracer>> pass(exec);
  std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
  gart::buffer<float, E> color(exec, 3 * pixels), gradient(exec, color_gradient);
  auto const constant = std::as_const(scene).view();
  gart::antialiased<E> filter(exec);
  auto const seen = filter.of(exec, constant, view, options.antialias);
  records.template prepare<typename Tracer::response_type>(exec, seen, view.position, options.alpha_min);
  tracer.prepare(exec, seen, records.view(), view, options.alpha_min, options.near);
  if (!pass.prepare(exec, tracer, seen, view, options.alpha_min, options.near)) throw pass.no_room();
  gart::forward<Degree>(exec, tracer, constant, view, options, active_degree, pass.targets(color.data()),
                        pass.record());
  gart::buffer<float, E> pixel_error(exec, error ? error->of_pixels : std::vector<float>{});
  pass.template run<Degree>(exec, tracer, constant, records.view(), view, options, active_degree, color, gradient,
                            gradients, pixel_error);
  if (error) {
    std::vector<float> moments(pass.moments().size());
    exec.copy_out(moments.data(), pass.moments().data(), moments.size() * sizeof(float));
    for (std::size_t i = 0; i < model.size(); ++i)
      error->of_gaussians.push_back(moments[gart::moment_stride * i + gart::error_place]);
  }
  return gradients.to_host();
}

// Which strategies are compiled here for a tracer and a degree: each strategy and each tracer at every degree, the
// other combinations at degree 3 only, for the sake of the compiler's time.
inline std::vector<std::string> strategies_for(tracer_kind kind, int degree) {
  if (kind == tracer_kind::embree) return {"pixel"};
  if (kind == tracer_kind::tiles)
    return degree == 3 ? std::vector<std::string>{"pixel", "hybrid", "primitive", "deterministic", "cleared", "lane"}
                       : std::vector<std::string>{"primitive"};
  return degree == 3 ? std::vector<std::string>{"pixel", "hybrid", "primitive"} : std::vector<std::string>{"pixel"};
}

template <class E>
gart::gaussian_model scene_gradients(E& exec, gart::gaussian_model const& model, gart::camera const& view,
                                     gart::render_options const& options, int active_degree, tracer_kind kind,
                                     std::string const& strategy, std::vector<float> const& color_gradient,
                                     attributed_error* error = nullptr) {
  using bvh = gart::bvh_tracer<E>;
  using tiles = gart::tile_tracer<E>;
  return detail::with_degree(model.sh_degree, [&](auto degree) -> gart::gaussian_model {
    auto const by = [&]<class Strategy, class Tracer>(Strategy, std::type_identity<Tracer>) {
      return gradients_by<degree, Strategy, Tracer>(exec, model, view, options, active_degree, color_gradient, error);
    };
    if (kind == tracer_kind::bvh && strategy == "pixel") return by(gart::pixel_strategy{}, std::type_identity<bvh>{});
    if (kind == tracer_kind::tiles && strategy == "primitive")
      return by(gart::primitive_strategy{}, std::type_identity<tiles>{});
    if constexpr (degree == 3) {
      if (kind == tracer_kind::bvh && strategy == "hybrid")
        return by(gart::hybrid_strategy{}, std::type_identity<bvh>{});
      if (kind == tracer_kind::bvh && strategy == "primitive")
        return by(gart::primitive_strategy{}, std::type_identity<bvh>{});
      if (kind == tracer_kind::tiles && strategy == "pixel")
        return by(gart::pixel_strategy{}, std::type_identity<tiles>{});
      if (kind == tracer_kind::tiles && strategy == "hybrid")
        return by(gart::hybrid_strategy{}, std::type_identity<tiles>{});
      if (kind == tracer_kind::tiles && strategy == "deterministic")
        return by(gart::deterministic_strategy{}, std::type_identity<tiles>{});
      if (kind == tracer_kind::tiles && strategy == "cleared")
        return by(gart::cleared_strategy{}, std::type_identity<tiles>{});
      if (kind == tracer_kind::tiles && strategy == "lane")
        return by(gart::lane_strategy{}, std::type_identity<tiles>{});
    }
#if defined(GART_WITH_EMBREE)
    if constexpr (!E::device)
      if (kind == tracer_kind::embree && strategy == "pixel")
        return by(gart::pixel_strategy{}, std::type_identity<gart::embree_tracer<E>>{});
#endif
    throw std::runtime_error("not compiled here: " + strategy);
  });
}

template <class Response = gart::generalized_gaussian<>, class E>
std::vector<std::vector<gart::hit>> hit_lists(E& exec, gart::gaussian_model const& model, gart::camera const& view,
                                              gart::render_options const& options, tracer_kind kind) {
  return detail::with_tracer<Response>(exec, kind, [&](auto& tracer) {
    gart::gaussians<E> scene(exec, model);
    gart::frame_records<E> records(exec);
    std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
    gart::buffer<gart::u32, E> counts(exec, pixels), starts(exec);
    gart::buffer<gart::hit, E> list(exec);
    auto const constant = std::as_const(scene).view();
    gart::antialiased<E> filter(exec);
    auto const seen = filter.of(exec, constant, view, options.antialias);
    records.template prepare<Response>(exec, seen, view.position, options.alpha_min);
    tracer.prepare(exec, seen, records.view(), view, options.alpha_min, options.near);
    gart::pixel_order const order{view.width, view.height};
    list_program program{tracer.rays(), order,  options.transmittance_min, options.max_hits, counts.data(),
                         nullptr,       nullptr};
    tracer.trace(exec, "count", order.launch_size(), program);
    std::vector<gart::u32> const count = counts.to_host();
    std::vector<gart::u32> offset(pixels + 1, 0);
    for (std::size_t i = 0; i < pixels; ++i) offset[i + 1] = offset[i] + count[i];
    starts.assign(offset);
    list.resize(offset.back() + 1);
    program.offsets = starts.data(), program.list = list.data();
    tracer.trace(exec, "list", order.launch_size(), program);
    std::vector<gart::hit> const flat = list.to_host();
    std::vector<std::vector<gart::hit>> lists(pixels);
    for (std::size_t i = 0; i < pixels; ++i) lists[i].assign(flat.begin() + offset[i], flat.begin() + offset[i + 1]);
    return lists;
  });
}

}  // namespace gart_test
