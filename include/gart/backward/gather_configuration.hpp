#pragma once
/// \file
/// The choices that a gather (backward/gather.hpp) is compiled for, one struct of these members:
///   policy     the execution policy on which it runs
///   response   how the Gaussians fall from their centres (math/response.hpp)
///   terms      the terms that it sums (backward/terms.hpp)
///   entry      what a slot of the hit buffer holds of a hit (backward/hit_slot.hpp)
///   sh_degree  that the coefficients are stored with
///   tile_size  side of a tile, in pixels
///   sums       where a pair's sums go
///   validity   how a slot that is a hit is told from one that is none (backward/gradient_methods.hpp)
///   form       which form of the kernel runs (exec/concepts.hpp): the policy's, unless a method asks for the
///              plain one
///   rays       of the view's pixels: pixel_rays; the plain form takes origin_rays too (camera/pixel_rays.hpp)
/// method_gather makes one of a method; a struct of a program's own does as well (bench/registers.cu).

#include <gart/backward/gradient_methods.hpp>
#include <gart/camera/pixel_rays.hpp>
#include <gart/exec/concepts.hpp>
#include <gart/math/response.hpp>

#include <concepts>

namespace gart { inline namespace GART_ISA {

/// Where a lane's sums go. They are added to the Gaussian atomically, or kept as one row a (primitive, tile) pair, in
/// primitive-major order. sum_pairs adds rows in that order: the same bits in every run.
enum class gather_sums { atomic, ordered };

/// A struct with these members.
template <class C>
concept gather_configuration = requires {
  typename C::policy;
  typename C::response;
  { C::terms::color } -> std::convertible_to<bool>;
  { C::terms::geometry } -> std::convertible_to<bool>;
  { C::terms::depth } -> std::convertible_to<bool>;
  typename C::entry;
  { C::sh_degree } -> std::convertible_to<int>;
  { C::tile_size } -> std::convertible_to<int>;
  { C::sums } -> std::convertible_to<gather_sums>;
  { C::validity } -> std::convertible_to<slot_validity>;
  { C::form } -> std::convertible_to<kernel_form>;
}
&&execution<typename C::policy>&& response_function<typename C::response>&& rays_of_pixels<typename C::rays>;

/// The gather of a method on a policy.
template <execution E, int ShDegree, response_function Response, gradient_method Method, int TileSize,
          rays_of_pixels Rays = pixel_rays>
struct method_gather {
  using policy = E;                                                 ///< on which it runs
  using response = Response;                                        ///< of the Gaussians
  using terms = typename Method::gather;                            ///< what is gathered
  using entry = typename Method::template record<TileSize>::entry;  ///< a slot of the hit buffer
  static constexpr int sh_degree = ShDegree,                        ///< of the coefficients
      tile_size = TileSize;                                         ///< side of a tile, in pixels
  /// In an order or atomically.
  static constexpr gather_sums sums = Method::ordered ? gather_sums::ordered : gather_sums::atomic;
  static constexpr slot_validity validity = Method::validity;  ///< how slots of hits are recognised
  /// Of the kernel.
  static constexpr kernel_form form = Method::lane_by_lane || !Rays::central ? kernel_form::plain : E::form;
  using rays = Rays;  ///< of the view's pixels
};

}}  // namespace gart::GART_ISA
