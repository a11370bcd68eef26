#pragma once
/// \file
/// How the loss divides an image among teams (loss/image_loss.hpp): tiles of one channel with a halo of SSIM's window.
/// Sums over the window run along rows, then down columns. Columns and rows are pixels, planes [3][H][W].

#include <gart/exec/concepts.hpp>
#include <gart/loss/ssim_window.hpp>
#include <gart/math/arith.hpp>
#include <gart/scene/image_rows.hpp>

#include <algorithm>

namespace gart { inline namespace GART_ISA { namespace detail {

// Planes are [3][H][W]: one a channel.
struct loss_image {
  int width = 0, height = 0;
  GART_HD std::size_t pixels() const { return static_cast<std::size_t>(width) * height; }
};

// Tiles of one channel, with a halo of the window's radius. A lane of a host takes 16 adjacent pixels, which its
// compiler puts in vector registers. Its tiles are large: long runs of memory, little halo. A lane of a device takes
// four: adjacent along rows, below each other down columns. So neighbouring windows share reads of shared memory. It
// loads one at a time, as memory is read.
template <execution E>
struct loss_tiles {
  static constexpr int block = E::device ? 4 : 16, load_block = E::device ? 1 : 16;
  static constexpr index_t team_size = 128;
  static constexpr int width = E::device ? 32 : 96, height = E::device ? 16 : 32;
  static constexpr int halo_width = width + 2 * ssim_window::radius, halo_height = height + 2 * ssim_window::radius;
  static constexpr int load_width = (halo_width + load_block - 1) / load_block * load_block;
  // A device's warp takes four rows at a time. Pitches of one more than a multiple of four share no bank.
  static constexpr int halo_pitch = E::device ? load_width / 4 * 4 + 5 : load_width, rows_pitch = width + E::device;
  static constexpr int halo_size = halo_pitch * halo_height, rows_size = rows_pitch * halo_height;
  static_assert(halo_pitch >= load_width);

  loss_image image;
  GART_HD int across() const { return (image.width + width - 1) / width; }
  GART_HD int down() const { return (image.height + height - 1) / height; }
  GART_HD index_t row_tiles() const { return static_cast<index_t>(3) * across(); }  // of all three channels
  GART_HD index_t count() const { return row_tiles() * down(); }

  // Row after row of tiles, so that those of a strip of the image are neighbours.
  struct place {
    int channel, x, y;
  };
  GART_HD place operator()(index_t tile) const {
    index_t const in_row = tile % row_tiles();
    return {static_cast<int>(in_row / across()), static_cast<int>(in_row % across()) * width,
            static_cast<int>(tile / row_tiles()) * height};
  }

  // The rows of tiles that hold rows of an image; then those that their windows reach. Last, the rows of the image that
  // windows of rows of tiles reach.
  static image_rows rows_of(image_rows rows, int image_height) {
    int const end = std::min(rows.end, image_height);
    return rows.first < end ? image_rows{rows.first / height, (end + height - 1) / height} : image_rows{0, 0};
  }
  static image_rows around(image_rows tiles, int image_height) {
    return rows_of(reached(tiles, image_height), image_height);
  }
  static image_rows reached(image_rows tiles, int image_height) {
    if (tiles.empty()) return tiles;
    return {std::max(tiles.first * height - ssim_window::radius, 0),
            std::min(tiles.end * height + ssim_window::radius, image_height)};
  }

  // Calls f(cell, i, inside) for every cell of the haloed tile. Inside, i is its pixel's place in [3][H][W].
  template <class Team, class F>
  GART_HD void each_halo_cell(Team const& team, place const& at, F const& f) const {
    constexpr int blocks = load_width / load_block;
    team.for_each(blocks * halo_height, [&](index_t item) {
      int const row = item / blocks, first = item % blocks * load_block, y = at.y + row - ssim_window::radius;
      int const x = at.x + first - ssim_window::radius;
      bool const row_inside = y >= 0 && y < image.height;
      // In pointer-sized integers, which is what lets a compiler see that neighbours are contiguous.
      std::ptrdiff_t const begin = x < 0 ? -x : 0, end = row_inside ? image.width - x : 0;
      std::ptrdiff_t const start = at.channel * image.pixels() + static_cast<std::ptrdiff_t>(y) * image.width + x;
      std::ptrdiff_t const cell = row * halo_pitch + first;
      // Most blocks lie inside, and without a question for each cell they are moved as vectors.
      if (load_block > 1 && begin == 0 && end >= load_block)
        for (std::ptrdiff_t v = 0; v < load_block; ++v) f(cell + v, start + v, true);
      else
        for (std::ptrdiff_t v = 0; v < load_block; ++v) f(cell + v, start + v, v >= begin && v < end);
    });
  }

  // The window's sum of 11 values `step` apart, the middle one at p[5 * step].
  static GART_HD GART_INLINE float windowed(float const* p, int step) {
    constexpr float w[6] = {weight<0>, weight<1>, weight<2>, weight<3>, weight<4>, weight<5>};
    float sum = w[5] * p[5 * step];
    sum = fma(w[4], p[4 * step] + p[6 * step], sum);
    sum = fma(w[3], p[3 * step] + p[7 * step], sum);
    sum = fma(w[2], p[2 * step] + p[8 * step], sum);
    sum = fma(w[1], p[step] + p[9 * step], sum);
    return fma(w[0], p[0] + p[10 * step], sum);
  }
  template <int Tap>
  static constexpr float weight = static_cast<float>(ssim_window::weight(Tap));

  // Windows `step` apart from value to value, of `block` neighbours that lie `next` apart.
  template <int Planes>
  static GART_HD GART_INLINE void convolve(float const* in, int plane, int step, int next,
                                           float (&sums)[Planes][block]) {
    GART_UNROLL
    for (int p = 0; p < Planes; ++p) {
      GART_UNROLL
      for (int v = 0; v < block; ++v) sums[p][v] = windowed(in + p * plane + v * next, step);
    }
  }

  // Along rows: from haloed planes to planes of rows_pitch by halo_height.
  template <int Planes, class Team>
  static GART_HD void convolve_rows(Team const& team, float const* halo, float* rows) {
    team.for_each(width * halo_height / block, [&](index_t item) {
      int const row = item * block / width, x = item * block % width;
      float sums[Planes][block];
      convolve<Planes>(halo + row * halo_pitch + x, halo_size, 1, 1, sums);
      for (int p = 0; p < Planes; ++p)
        for (int v = 0; v < block; ++v) rows[p * rows_size + row * rows_pitch + x + v] = sums[p][v];
    });
  }

  // The values that a lane takes down columns: value v lies at (column, row) + v (dx, dy).
  static constexpr int dx = !E::device, dy = E::device, items = width * height / block;
  struct item_place {
    int column, row;
  };
  static GART_HD item_place item_at(index_t item) {
    if constexpr (E::device) return {static_cast<int>(item % width), static_cast<int>(item / width) * block};
    return {static_cast<int>(item * block % width), static_cast<int>(item * block / width)};
  }
  // From a value to the next where rows are so far apart.
  static GART_HD constexpr int next(int pitch) { return dx + dy * pitch; }
  template <int Planes>
  static GART_HD GART_INLINE void convolve_columns(float const* rows, item_place const& at,
                                                   float (&sums)[Planes][block]) {
    convolve<Planes>(rows + at.row * rows_pitch + at.column, rows_size, rows_pitch, next(rows_pitch), sums);
  }
  // How many of an item's values lie in the image.
  GART_HD int inside(int x, int y) const {
    if (x >= image.width || y >= image.height) return 0;
    int const left = E::device ? image.height - y : image.width - x;
    return left < block ? left : block;
  }
  // Calls f for each of these. Mostly these are all of them, and then no lane asks; the numbers are always known to the
  // compiler.
  template <class F>
  static GART_HD GART_INLINE void each_inside(int inside, F const& f) {
    if (inside == block) {
      GART_UNROLL
      for (int v = 0; v < block; ++v) f(v);
    } else {
      GART_UNROLL
      for (int v = 0; v < block; ++v)
        if (v < inside) f(v);
    }
  }
};

}}}  // namespace gart::GART_ISA::detail
