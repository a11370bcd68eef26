#pragma once
/// \file
/// The form of the gather that a configuration asks for. gather_of<C> is a tile kernel that begins with the members of
/// gather_kernel<C> (backward/gather.hpp); it is launched with block_size lanes.

#include <gart/backward/matrix_gather.hpp>
#include <gart/backward/packet_gather.hpp>

#include <type_traits>

namespace gart { inline namespace GART_ISA {

namespace detail {

template <gather_configuration C>
constexpr auto gather_form() {
  // The matrix units' form is for sums of colour over tiles of 8 x 8.
  if constexpr (C::form == kernel_form::warp && C::terms::color && C::tile_size == 8)
    return std::type_identity<matrix_gather<C>>{};
  else if constexpr (C::form == kernel_form::packet)
    return std::type_identity<packet_gather<C>>{};
  else
    return std::type_identity<gather_kernel<C>>{};
}

}  // namespace detail

/// The tile kernel of a configuration.
template <gather_configuration C>
using gather_of = typename decltype(detail::gather_form<C>())::type;

}}  // namespace gart::GART_ISA
