#pragma once
// A small scene through a tracer and a method that are chosen at run time: templates over the policy, whose bodies
// are in scene_images.cpp and scene_gradients.cpp, compiled once for all tests (gart_test's BODIES scene_by_kind).

#include <gart/camera/models.hpp>
#include <gart/render/options.hpp>
#include <gart/runtime/kinds.hpp>
#include <gart/scene/gaussians.hpp>
#include <gart/trace/hit.hpp>
#include <support/test_methods.hpp>

#include <concepts>
#include <string>
#include <type_traits>
#include <vector>

namespace gart_test {

using gart::tracer_kind;

namespace detail {

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

template <class E>
struct traced {
  std::vector<float> color, transmittance, depth;  // [H][W][3], [H][W], [H][W]
  std::vector<gart::u32> hits;                     // [H][W]
};

// An error a pixel, [H][W], and what of it the backward pass attributes to each Gaussian.
struct attributed_error {
  std::vector<float> of_pixels, of_gaussians;
};

// Whether a method is compiled here for a tracer and a degree: at degree 3 all for tile lists, for a BVH those that
// record or scatter otherwise (others differ in the gather alone, which does not know the tracer); at other degrees one
// for each tracer, for the sake of the compiler's time.
template <class Method>
inline constexpr bool differs_in_gather =
    std::derived_from<Method, gart::primitive_method> && !std::same_as<Method, gart::primitive_method>;

template <class Method>
constexpr bool compiled_for(tracer_kind kind, int degree) {
  if (kind == tracer_kind::embree || (kind == tracer_kind::bvh && degree != 3))
    return std::same_as<Method, gart::pixel_method>;
  if (kind == tracer_kind::bvh) return !differs_in_gather<Method>;
  return degree == 3 || std::same_as<Method, gart::primitive_method>;
}

inline std::vector<std::string> methods_for(tracer_kind kind, int degree) {
  std::vector<std::string> names;
  gradient_methods::for_each([&]<class Method>(Method) {
    if (compiled_for<Method>(kind, degree)) names.emplace_back(Method::name);
  });
  return names;
}

template <class E>
traced<E> render_scene(E& exec, gart::gaussian_model const& model, gart::camera const& view,
                       gart::render_options const& options, int active_degree, tracer_kind kind);

template <class E>
gart::gaussian_model scene_gradients(E& exec, gart::gaussian_model const& model, gart::camera const& view,
                                     gart::render_options const& options, int active_degree, tracer_kind kind,
                                     std::string const& method, std::vector<float> const& color_gradient,
                                     attributed_error* error = nullptr);

// The hits of each pixel, in order.
template <class E>
std::vector<std::vector<gart::hit>> hit_lists(E& exec, gart::gaussian_model const& model, gart::camera const& view,
                                              gart::render_options const& options, tracer_kind kind);

}  // namespace gart_test
