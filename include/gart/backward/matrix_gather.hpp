#pragma once
/// \file
/// The gather on a device: eight primitives a warp, four lanes a primitive. The lanes take the tile's pixels eight at a
/// time, two a lane. What primitives sum up for colour is a product for each channel c,
///   sum[band][primitive] = Y[band][pixel] (w g_c)[pixel][primitive],
///   w = 0 where the channel is clamped or no hit is,
/// so the matrix units compute it (math/matrix_unit.hpp). A lane holds the weights where the units want them, and no SH
/// sum of its own. Moments are summed in registers and added up over the four lanes. Neighbouring lanes read
/// neighbouring slots and add to neighbouring floats. Slots are copied to shared memory two rows ahead, which hides the
/// latency of memory and takes no registers.
///
/// A warp takes the rows of the tile that any of its primitives has. So a tile's list is sorted by rows first, 256
/// entries at a time. A pair's sums are of the terms of gather_kernel (backward/gather.hpp) in another order, the same
/// in every run. Device only.

#include <gart/backward/gather.hpp>
#include <gart/math/matrix_unit.hpp>

#if defined(__CUDACC__)
#include <cuda_pipeline.h>
#endif

namespace gart { inline namespace GART_ISA {

namespace detail {

template <gather_configuration C>
struct without_color : C {
  using geometry_terms = std::conditional_t<C::terms::depth, gart::terms<gart::term::geometry, gart::term::depth>,
                                            gart::terms<gart::term::geometry>>;
  using terms = std::conditional_t<C::terms::geometry, geometry_terms, gart::terms<>>;
};

}  // namespace detail

#if !defined(__CUDACC__)

template <gather_configuration C>
struct matrix_gather;  // a device's compiler has it

#else

/// The tile kernel on matrix units. All but the colour's sums is of a gather without colour.
template <gather_configuration C>
struct matrix_gather : gather_kernel<detail::without_color<C>> {
  using base = gather_kernel<detail::without_color<C>>;  ///< with everything but colour
  using slot_type = typename base::slot_type;            ///< a slot as it is read
  static constexpr int lanes = 32,                       ///< of a warp
      warps = 4,                                         ///< of a team
      block_size = warps * lanes,                        ///< lanes of a team
      min_blocks = C::terms::depth ? 4 : 5;              ///< teams a multiprocessor holds: with depth five would spill
  static constexpr int bands = base::bands,              ///< SH functions
      sh_stride = base::sh_stride;                       ///< floats of a Gaussian's coefficients
  static constexpr int Size = C::tile_size;              ///< side of a tile, in pixels
  static constexpr u32 share = 2 * block_size;           ///< primitives that are put in order together
  static constexpr u32 stages = 3;                       ///< rows of slots in shared memory: one is read, two come
  static_assert(C::terms::color && Size == 8 && bands <= 16);

  /// What a team shares.
  struct scratch {
    typename base::pixel_data pixels[Size * Size];  ///< of the tile
    matrix_part<4>::words high[Size][lanes],        ///< Y of a row of pixels, as the lanes want it
        low[Size][lanes];                           ///< and what the first part leaves
    slot_type slots[warps][stages][2][lanes];       ///< two a lane and row
    float sums[warps][8][52];  ///< of colour, a row a primitive; 52: what a warp writes at once lies in 32 banks
    tile_slots cells[share];   ///< of the primitives put in order
    u32 ids[share];            ///< their Gaussians
    u32 count[Size * Size];    ///< of the counting sort
  };

  /// Gathers the tile of a team.
  __device__ void operator()(auto const& team) const {
    u32 const tile = team.tile();
    u32 const first = this->map.offsets[tile], count = this->map.offsets[tile + 1] - first;
    if (count == 0) return;
    pixel_box const area = this->grid.tile(tile);
    scratch& s = team.scratch();
    team.for_each(Size * Size, [&](index_t p) { load(s, area, p); });
    for (u32 from = 0; from < count; from += share) {
      u32 const listed = count - from < share ? count - from : share;
      put_in_order(team, s, area, this->map.primitives.data() + first + from, listed);
      for (u32 k = threadIdx.x / lanes * 8; k < listed; k += warps * 8) gather(s, area, k, listed);
    }
  }

 private:
  static constexpr u32 everyone = 0xffffffffu;
  static constexpr bool ordered = C::sums == gather_sums::ordered;

  __device__ void load(scratch& s, pixel_box const& area, u32 p) const {
    pixel const at{static_cast<int>(area.x0 + p % Size), static_cast<int>(area.y0 + p / Size)};
    s.pixels[p] = {};
    if (at.x < area.x1 && at.y < area.y1) this->load_pixel(s.pixels[p], at);
    quad const d = s.pixels[p].direction_total;
    sh_basis<C::sh_degree> const basis(vec3(d.v[0], d.v[1], d.v[2]));
    GART_UNROLL
    for (u32 b = 0; b < 16; ++b) {
      matrix_part<4>::number const y(b < bands ? basis.y[b < bands ? b : 0] : 0.0f);
      u32 const lane = b % 8 * 4 + p % 4, place = p % 8 / 4 * 2 + b / 8;
      s.high[p / 8][lane].v[place] = y.high, s.low[p / 8][lane].v[place] = y.low;
    }
  }

  // Sorts ids and cells of the listed primitives by the first and the last of their rows in the tile. It is a counting
  // sort.
  __device__ GART_INLINE void put_in_order(auto const& team, scratch& s, pixel_box const& area, u32 const* list,
                                           u32 listed) const {
    team.barrier();
    team.for_each(Size * Size, [&](index_t c) { s.count[c] = 0; });
    team.barrier();
    u32 id[2], at[2], place[2];
    tile_slots cell[2];
    GART_UNROLL
    for (int i = 0; i < 2; ++i) {
      u32 const k = threadIdx.x + i * block_size;
      if (k >= listed) continue;
      id[i] = list[k], cell[i] = tile_slots(this->ranges[id[i]], area);
      at[i] = (cell[i].y - area.y0) * Size + cell[i].y1 - 1 - area.y0;
      place[i] = atomicAdd(&s.count[at[i]], 1u);
    }
    team.barrier();
    if (threadIdx.x < lanes) {  // counts become places
      u32 const c = 2 * threadIdx.x, one = s.count[c], both = one + s.count[c + 1];
      u32 sum = both;
      GART_UNROLL
      for (int d = 1; d < lanes; d *= 2) {
        u32 const before = __shfl_up_sync(everyone, sum, d);
        if (threadIdx.x >= d) sum += before;
      }
      s.count[c] = sum - both, s.count[c + 1] = sum - both + one;
    }
    team.barrier();
    GART_UNROLL
    for (int i = 0; i < 2; ++i) {
      if (threadIdx.x + i * block_size >= listed) continue;
      u32 const to = s.count[at[i]] + place[i];
      s.cells[to] = cell[i], s.ids[to] = id[i];
    }
    team.barrier();
  }

  // Eight of the primitives put in order, from number k on.
  __device__ GART_INLINE void gather(scratch& s, pixel_box const& area, u32 k, u32 listed) const {
    u32 const lane = threadIdx.x % lanes, column = lane % 4, number = k + lane / 4;
    bool const exists = number < listed;
    tile_slots const cell = tile_slots::read(s.cells[exists ? number : k]);
    u32 const id = s.ids[exists ? number : k];
    typename base::lane_data const data(*this, id);
    float moment_sum[moment_stride] = {};
    float color_sum[3][4] = {};
    bool met = false;

    // In a row of the tile the lane has the pixels `column` and column + 4, if the cell has them.
    u32 const x = area.x0 + column, from = cell.y - area.y0, rows = cell.y1 - cell.y;
    bool const has[2] = {exists && x >= cell.x && x < cell.x1, exists && x + 4 >= cell.x && x + 4 < cell.x1};
    auto const slot_of = [&](u32 row, int i) { return cell.first + (row - from) * cell.width + x + 4 * i - cell.x; };
    auto const in_row = [&](u32 row, int i) { return has[i] & (row - from < rows); };
    auto& staged = s.slots[threadIdx.x / lanes];
    auto const fetch = [&](u32 row, u32 stage) {
      GART_UNROLL
      for (int i = 0; i < 2; ++i)
        if (in_row(row, i)) copy_slot(staged[stage][i][lane], slot_of(row, i));
      __pipeline_commit();
    };
    u32 const first = __reduce_min_sync(everyone, from), last = __reduce_max_sync(everyone, from + rows - 1);
    GART_UNROLL
    for (u32 ahead = 0; ahead + 1 < stages; ++ahead) fetch(first + ahead, ahead);
    u32 stage = 0;
    GART_NO_UNROLL
    for (u32 row = first; row <= last; ++row) {
      fetch(row + stages - 1, stage == 0 ? stages - 1 : stage - 1);
      __pipeline_wait_prior(stages - 1);
      matrix_part<2> weights[3];
      ray_peak r[2];
      auto const pixel_of = [&](int i) -> auto const& { return s.pixels[8 * row + column + 4 * i]; };
      this->peaks_at(r, data, pixel_of);
      GART_UNROLL
      for (int i = 0; i < 2; ++i) {
        typename base::pixel_data const& at = pixel_of(i);
        slot_type const entry = staged[stage][i][lane];
        quad const g = at.gradient;
        bool const hit = in_row(row, i) & this->holds(at, entry, slot_of(row, i), r[i], data);
        met |= hit;
        GART_UNROLL
        for (int c = 0; c < 3; ++c) weights[c].set(i, hit & !entry.clamped(c) ? entry.weight() * g.v[c] : 0.0f);
        if constexpr (C::terms::geometry) this->add_moments(at, entry, r[i], data, hit, moment_sum);
      }
      matrix_part<4> const y{s.high[row][lane], s.low[row][lane]};
      GART_UNROLL
      for (int c = 0; c < 3; ++c) multiply_add(color_sum[c], y, weights[c]);
      stage = stage + 1 == stages ? 0 : stage + 1;
    }

    bool const wanted = exists && (met || ordered);
    u32 const all_wanted = __ballot_sync(everyone, wanted);
    if constexpr (C::terms::geometry) {
      GART_UNROLL
      for (int j = 0; j < moment_count; ++j)
        for (int other = 1; other < 4; other *= 2) moment_sum[j] += __shfl_xor_sync(everyone, moment_sum[j], other);
      if (column == 0 && wants(all_wanted, lane / 4)) this->add_moment_sums(range_of(id), area, id, moment_sum);
    }
    add_colors(s, area, k, color_sum, all_wanted);
  }

  // Asks for the slot of that number.
  __device__ GART_INLINE void copy_slot(slot_type& to, u32 number) const {
    using entry_type = typename base::entry_type;
    __pipeline_memcpy_async(static_cast<entry_type*>(&to), this->slots + number, sizeof(entry_type));
    if constexpr (C::terms::depth) __pipeline_memcpy_async(&to.depth, this->depth.slots + number, sizeof(float));
  }

  // Bands lie over the lanes and primitives in them; so that lanes add to neighbouring floats they change places.
  __device__ GART_INLINE void add_colors(scratch& s, pixel_box const& area, u32 k, float const (&color_sum)[3][4],
                                         u32 all_wanted) const {
    u32 const lane = threadIdx.x % lanes;
    auto& sums = s.sums[threadIdx.x / lanes];
    GART_UNROLL
    for (u32 j = 0; j < 4; ++j) {
      u32 const band = lane / 4 + j / 2 * 8;
      GART_UNROLL
      for (u32 c = 0; c < 3; ++c)
        if (band < bands) sums[lane % 4 * 2 + j % 2][3 * band + c] = color_sum[c][j];
    }
    __syncwarp();
    constexpr u32 piece = sh_stride % 4 == 0 ? 4 : 1, pieces = sh_stride / piece;
    GART_UNROLL
    for (u32 i = lane; i < 8 * pieces; i += lanes) {
      u32 const n = i / pieces, from = i % pieces * piece;
      if (!wants(all_wanted, n)) continue;
      u32 const id = s.ids[k + n];
      float values[piece];
      GART_UNROLL
      for (u32 j = 0; j < piece; ++j) values[j] = sums[n][from + j];
      this->add_color_sums(range_of(id), area, id, from, values);
    }
    __syncwarp();
  }

  // Whether any of the four lanes of primitive n voted for it.
  __device__ GART_INLINE static bool wants(u32 votes, u32 n) { return (votes >> 4 * n & 15u) != 0; }
  // Rows of sums alone are found by it.
  __device__ GART_INLINE footprint_slots range_of(u32 id) const {
    return ordered ? this->ranges[id] : footprint_slots{};
  }
};

#endif

}}  // namespace gart::GART_ISA
