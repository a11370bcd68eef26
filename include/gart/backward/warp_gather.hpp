#pragma once
// The gather with a warp a primitive in place of a lane: the lanes share the pixels of box and tile, and their sums are
// added up by exchange before one of them adds the total to the Gaussian. For comparison: a box shares few pixels with
// a tile, so lanes stay idle, and 58 sums are exchanged five times for each pair (docs/backward.md). Sums are of the
// same terms in another order. Device only, atomic sums.

#include <gart/backward/gather.hpp>

namespace gart {

#if defined(__CUDACC__)

template <class Gather>
struct warp_gather : Gather {
  using scratch = typename Gather::scratch;
  static constexpr u32 lanes = 32;

  template <class Team>
  __device__ void operator()(Team const& team) const {
    u32 const tile = team.tile();
    u32 const first = this->map.offsets[tile], count = this->map.offsets[tile + 1] - first;
    if (count == 0) return;
    pixel_box const area = this->grid.tile(tile);
    scratch& s = team.scratch();
    team.for_each(area.area(), [&](index_t p) { this->load_pixel(s.pixels[p], area, p); });
    team.barrier();
    for (u32 k = threadIdx.x / lanes; k < count; k += blockDim.x / lanes)
      gather(s, area, this->map.primitives[first + k], threadIdx.x % lanes);
    team.barrier();
  }

 private:
  __device__ void gather(scratch const& s, pixel_box const& area, u32 id, u32 lane) const {
    lt_range const range = this->ranges[id];
    pixel_box const cell = intersect(range.box, area);
    u32 const first = static_cast<u32>(range.offset) + tile_offset(range.box, cell);
    u32 const corner = (cell.y0 - area.y0) * area.width() + (cell.x0 - area.x0);
    float sh_sum[Gather::sh_stride] = {};
    float moment_sum[moment_stride] = {};
    typename Gather::lane_data const data(*this, id);
    for (u32 k = lane; k < cell.area(); k += lanes)
      this->visit(s.pixels[corner + k / cell.width() * area.width() + k % cell.width()], this->slots[first + k],
                  first + k, data, sh_sum, moment_sum);
    add_up(sh_sum);
    add_up(moment_sum);
    if (lane == 0) this->finish(range.box, area, id, sh_sum, moment_sum);
  }

  template <int N>
  __device__ GART_INLINE static void add_up(float (&values)[N]) {
    GART_UNROLL
    for (int i = 0; i < N; ++i) {
      GART_UNROLL
      for (int other = lanes / 2; other > 0; other /= 2) values[i] += __shfl_xor_sync(0xffffffffu, values[i], other);
    }
  }
};

#endif

}  // namespace gart
