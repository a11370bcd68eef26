#pragma once
/// \file
/// The training loss of an image x against the truth y, and its gradient in x:
///   L = (1 - w) mean|x - y| + w (1 - mean SSIM(x, y)),
/// means over all pixels and the three channels. The image is not clamped to [0, 1]. But a photograph shows no more
/// than white: where its channel is white and the image's is brighter, x counts as y, without gradient.
///
/// SSIM is written in d = x - y. Near the optimum x and y agree, and their difference must not cancel:
///   SSIM = (1 - m_d^2 / B1) (1 - s_dd / B2),  B1 = m_x^2 + m_y^2 + C1,  B2 = s_xx + s_yy + C2
/// with m the window's means and s its variances, which is the usual formula, as 2ab = a^2 + b^2 - (a - b)^2. Four
/// convolutions are then enough (y, d, x^2 + y^2, d^2). They are taken of x - 1/2 and y - 1/2, so that the variances of
/// bright flat areas survive float. Where x = y in the whole window the gradient is exactly zero. With S = l c the two
/// factors,
///   dS/dm_x = 2 l (m_d - (1 - c)(m_x - 1/2)) / B2 - 2 c (m_d - (1 - l) m_x) / B1,
///   dS/de = l (1 - c) / B2,  dS/df = -l / B2  for e, f the windowed means of x^2 + y^2 and d^2,
/// and the gradient at a pixel is the windowed sum of dS/dm_x + 2 (x - 1/2) dS/de + 2 d dS/df.
///
/// Three launches: differences; SSIM with its three partials; their convolution. Memory: 60 bytes a pixel. The gradient
/// of a strip of the image (differentiate) takes these of the strip and of two windows' reach around.

#include <gart/algorithm/reduce.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/loss/loss_tiles.hpp>
#include <gart/math/glm.hpp>

namespace gart { inline namespace GART_ISA {

/// The truth in the policy's memory, 8 bits a channel, row-major.
struct truth_view {
  u8 const* pixels = nullptr;  ///< [H][W][channels]
  int channels = 3;            ///< 3, or 4 with straight alpha: rgb * a + background * (1 - a)
  /// [H][W], or null: the gradient's weight, in parts of 255. Where it is 0 the image counts as equal to the truth,
  /// without loss or gradient. Means still divide by all pixels.
  u8 const* mask = nullptr;
  vec3 background{0.0f};  ///< where alpha is not 1, [0, 1]

  /// Whether the pixel is not excluded by the mask.
  GART_HD bool counts(index_t pixel) const { return !mask || mask[pixel] != 0; }
  /// Of a pixel, over the background, in [0, 1].
  GART_HD vec3 color(index_t pixel) const {
    u8 const* const t = pixels + std::size_t{pixel} * channels;
    float const alpha = channels == 4 ? static_cast<float>(t[3]) * (1.0f / 255.0f) : 1.0f;
    vec3 out;
    for (int c = 0; c < 3; ++c)
      out[c] = fma(static_cast<float>(t[c]) * (1.0f / 255.0f), alpha, background[c] * (1.0f - alpha));
    return out;
  }
};

namespace detail {

// x - y of a channel. An overexposed sky is white however bright it was. JPEG leaves it a few levels below 255.
// -0, which no x - y is, tells the gradient of such a pixel from that of x = y.
GART_HD GART_INLINE float difference_of(float x, float y) {
  constexpr float white = 249.5f / 255.0f;
  return x > 1 && y > white ? -0.0f : x - y;
}
GART_HD GART_INLINE bool is_beyond_white(float difference) {
  return difference == 0 && copysignf(1.0f, difference) < 0;
}

struct difference_kernel {
  float const* image;
  truth_view truth;
  loss_image size;
  index_t first;         // pixel
  float* centred_truth;  // y - 1/2
  float* difference;     // x - y

  GART_KERNEL void operator()(index_t k) const {
    index_t const pixel = first + k;
    bool const counts = truth.counts(pixel);
    vec3 const y = truth.color(pixel);
    for (int c = 0; c < 3; ++c) {
      std::size_t const at = c * size.pixels() + pixel;
      centred_truth[at] = y[c] - 0.5f;
      difference[at] = counts ? difference_of(image[std::size_t{pixel} * 3 + c], y[c]) : 0.0f;
    }
  }
};

template <execution E>
struct ssim_kernel {
  using tiles = loss_tiles<E>;
  struct scratch {
    float halo[4][tiles::halo_size];  // y - 1/2, d, (x - 1/2)^2 + (y - 1/2)^2, d^2
    float rows[4][tiles::rows_size];
    float loss[tiles::height * tiles::width], square[tiles::height * tiles::width];
    float column_loss[tiles::width], column_square[tiles::width];
  };
  tiles grid;
  index_t first;  // tile
  float const* centred_truth;
  float const* difference;
  float* partials;   // [3 partials][3][H][W]
  float* tile_loss;  // [tiles], divided by the count of values
  float* tile_square;
  float weight;

  GART_KERNEL void operator()(auto const& team) const {
    scratch& s = team.scratch();
    index_t const tile = first + team.tile();
    auto const at = grid(tile);
    std::size_t const pixels = grid.image.pixels(), plane = at.channel * pixels;
    int const image_width = grid.image.width;

    grid.each_halo_cell(team, at, [&](std::ptrdiff_t cell, std::ptrdiff_t i, bool inside) {
      float const truth = inside ? centred_truth[i] : -0.5f, d = inside ? difference[i] : 0.0f;
      float const value = truth + d;
      s.halo[0][cell] = truth, s.halo[1][cell] = d;
      s.halo[2][cell] = fma(value, value, truth * truth), s.halo[3][cell] = d * d;
    });
    team.barrier();
    tiles::template convolve_rows<4>(team, &s.halo[0][0], &s.rows[0][0]);
    team.barrier();

    team.for_each(tiles::items, [&](index_t item) {
      auto const [column, row] = tiles::item_at(item);
      float sums[4][tiles::block];
      tiles::template convolve_columns<4>(&s.rows[0][0], {column, row}, sums);
      float out[3][tiles::block];
      float const* const differences =
          &s.halo[1][(row + ssim_window::radius) * tiles::halo_pitch + column + ssim_window::radius];
      int const cell = row * tiles::width + column;
      for (int v = 0; v < tiles::block; ++v) {
        float const difference_mean = sums[1][v], centred = sums[0][v] + difference_mean;
        float const mean = centred + 0.5f, truth_mean = sums[0][v] + 0.5f;
        float const spread = sums[2][v] - centred * centred - sums[0][v] * sums[0][v];
        float const spread_d = sums[3][v] - difference_mean * difference_mean;
        float const inverse_b1 = 1.0f / (mean * mean + truth_mean * truth_mean + c1);
        float const inverse_b2 = 1.0f / ((spread > 0 ? spread : 0.0f) + c2);
        float const missing_l = difference_mean * difference_mean * inverse_b1;
        float const missing_c = (spread_d > 0 ? spread_d : 0.0f) * inverse_b2;
        float const l = 1.0f - missing_l, c = 1.0f - missing_c;
        out[0][v] = 2.0f * (l * (difference_mean - missing_c * centred) * inverse_b2 -
                            c * (difference_mean - missing_l * mean) * inverse_b1);
        out[1][v] = l * missing_c * inverse_b2;
        out[2][v] = -l * inverse_b2;
        float const error = missing_l + missing_c - missing_l * missing_c;  // 1 - SSIM
        float const d = differences[v * tiles::next(tiles::halo_pitch)];
        s.loss[cell + v * tiles::next(tiles::width)] = weight * error + (1.0f - weight) * fabsf(d);
        s.square[cell + v * tiles::next(tiles::width)] = d * d;
      }
      int const x = at.x + column, y = at.y + row, inside = grid.inside(x, y);
      float* const to = partials + plane + static_cast<std::size_t>(y) * image_width + x;
      int const next = tiles::next(image_width);
      for (int p = 0; p < 3; ++p) tiles::each_inside(inside, [&](int v) { to[p * 3 * pixels + v * next] = out[p][v]; });
      for (int v = inside; v < tiles::block; ++v)
        s.loss[cell + v * tiles::next(tiles::width)] = s.square[cell + v * tiles::next(tiles::width)] = 0;
    });
    team.barrier();

    team.for_each(tiles::width, [&](index_t column) {
      float loss = 0, square = 0;
      for (int row = 0; row < tiles::height; ++row)
        loss += s.loss[row * tiles::width + column], square += s.square[row * tiles::width + column];
      s.column_loss[column] = loss, s.column_square[column] = square;
    });
    team.barrier();
    team.for_each(1, [&](index_t) {
      float loss = 0, square = 0;
      for (int column = 0; column < tiles::width; ++column)
        loss += s.column_loss[column], square += s.column_square[column];
      float const share = 1.0f / (3.0f * static_cast<float>(pixels));
      tile_loss[tile] = loss * share, tile_square[tile] = square * share;
    });
  }

  static constexpr float c1 = static_cast<float>(ssim_window::c1), c2 = static_cast<float>(ssim_window::c2);
};

template <execution E>
struct loss_gradient_kernel {
  using tiles = loss_tiles<E>;
  struct scratch {
    float halo[3][tiles::halo_size];
    float rows[3][tiles::rows_size];
  };
  tiles grid;
  index_t first;  // tile
  float const* centred_truth;
  float const* difference;
  float const* partials;
  u8 const* mask;
  float* gradient;
  float weight;

  GART_KERNEL void operator()(auto const& team) const {
    scratch& s = team.scratch();
    auto const at = grid(first + team.tile());
    std::size_t const pixels = grid.image.pixels(), plane = at.channel * pixels;
    int const image_width = grid.image.width;

    // All three planes at once: as many reads wait for memory together.
    float const* const from[3] = {partials, partials + 3 * pixels, partials + 6 * pixels};
    float* const to[3] = {s.halo[0], s.halo[1], s.halo[2]};
    grid.each_halo_cell(team, at, [=](std::ptrdiff_t cell, std::ptrdiff_t i, bool inside) {
      for (int p = 0; p < 3; ++p) to[p][cell] = inside ? from[p][i] : 0.0f;
    });
    team.barrier();
    tiles::template convolve_rows<3>(team, &s.halo[0][0], &s.rows[0][0]);
    team.barrier();

    float const share = 1.0f / (3.0f * static_cast<float>(pixels));
    team.for_each(tiles::items, [&](index_t item) {
      auto const [column, row] = tiles::item_at(item);
      int const x = at.x + column, y = at.y + row, inside = grid.inside(x, y);
      if (inside == 0) return;
      float sums[3][tiles::block];
      tiles::template convolve_columns<3>(&s.rows[0][0], {column, row}, sums);
      std::size_t const pixel = static_cast<std::size_t>(y) * image_width + x;
      int const next = tiles::next(image_width);
      float const* const d_row = difference + plane + pixel;
      float const* const truth_row = centred_truth + plane + pixel;
      float out[tiles::block];
      tiles::each_inside(inside, [&](int v) {
        float const d = d_row[v * next], value = truth_row[v * next] + d;
        float const sign = d > 0 ? 1.0f : d < 0 ? -1.0f : d;  // a NaN stays one
        float const structure = sums[0][v] + 2.0f * (value * sums[1][v] + d * sums[2][v]);
        out[v] = is_beyond_white(d) ? 0.0f : ((1.0f - weight) * sign - weight * structure) * share;
      });
      // No division: its slow path would cost every training registers. 255 is 1 to the bit.
      tiles::each_inside(inside, [&](int v) {
        float const kept = mask ? static_cast<float>(mask[pixel + v * next]) * (1.0f / 255.0f) : 1.0f;
        gradient[(pixel + v * next) * 3 + at.channel] = kept > 0 ? kept * out[v] : 0.0f;
      });
    });
  }
};

}  // namespace detail

/// The loss, with the buffers that it needs.
template <execution E>
class image_loss {
 public:
  /// No buffer is allocated yet.
  explicit image_loss(E& exec) : exec_(&exec), planes_(exec), partials_(exec), sums_(exec) {}

  /// `image` and `gradient` are [H][W][3]; `loss` is two floats of the policy's memory: L, and the mean squared error.
  void evaluate(span<float const> image, truth_view truth, int width, int height, float ssim_weight,
                span<float> gradient, span<float> loss) {
    differentiate(image, truth, width, height, ssim_weight, gradient);
    total(loss);
  }

  /// The gradient in some rows of the image, with the bits of the whole image's. Also the loss's sums there, in rows of
  /// tiles.
  void differentiate(span<float const> image, truth_view truth, int width, int height, float ssim_weight,
                     span<float> gradient, image_rows rows = {}) {
    E& exec = *exec_;
    tiles const grid{{width, height}};
    std::size_t const values = 3 * grid.image.pixels();
    planes_.resize(2 * values), partials_.resize(3 * values), sums_.resize(std::size_t{2} * grid.count());
    float* const truth_plane = planes_.data();
    float* const difference = planes_.data() + values;
    image_rows const inner = tiles::rows_of(rows, height), outer = tiles::around(inner, height),
                     read = reads(rows, height);
    auto const launched = [&](image_rows const& some) {
      return tile_range{grid.row_tiles() * static_cast<index_t>(some.count()), grid.team_size};
    };
    auto const first = [&](image_rows const& some) { return grid.row_tiles() * static_cast<index_t>(some.first); };

    parallel_for(exec, "loss_difference", static_cast<index_t>(width) * static_cast<index_t>(read.count()),
                 detail::difference_kernel{image.data(), truth, grid.image, static_cast<index_t>(width) * read.first,
                                           truth_plane, difference});
    parallel_for(exec, "loss_ssim", launched(outer),
                 detail::ssim_kernel<E>{grid, first(outer), truth_plane, difference, partials_.data(), sums_.data(),
                                        sums_.data() + grid.count(), ssim_weight});
    parallel_for(exec, "loss_gradient", launched(inner),
                 detail::loss_gradient_kernel<E>{grid, first(inner), truth_plane, difference, partials_.data(),
                                                 truth.mask, gradient.data(), ssim_weight});
  }
  /// The rows of an image that differentiate() reads for some.
  static image_rows reads(image_rows rows, int height) {
    return tiles::reached(tiles::around(tiles::rows_of(rows, height), height), height);
  }
  /// The sums of the last differentiate(), [rows of tiles][tiles of a row], of L and of the squared error.
  span<float> sums(int which) { return sums_.view().subspan(which * sums_.size() / 2, sums_.size() / 2); }
  /// The rows of tiles that begin in some rows of an image. A rank that has these rows sums those tiles.
  static image_rows sums_of(image_rows rows, int height) {
    return {(rows.first + tiles::height - 1) / tiles::height,
            (std::min(rows.end, height) + tiles::height - 1) / tiles::height};
  }
  /// The loss, of all rows' sums.
  void total(span<float> loss) {
    for (int which = 0; which < 2; ++which)
      reduce(*exec_, span<float const>(sums(which)), loss.subspan(static_cast<std::size_t>(which), 1));
  }

 private:
  using tiles = detail::loss_tiles<E>;

  E* exec_;
  buffer<float, E> planes_, partials_, sums_;
};

}}  // namespace gart::GART_ISA
