#pragma once
/// \file
/// Adam (Kingma and Ba, 2015) over every parameter of every Gaussian in one launch, with a rate per group. The colour's
/// constant term has its own rate. With g the gradient and t the step, counted from 1,
///   m = b1 m + (1 - b1) g,  v = b2 v + (1 - b2) g^2,  p -= rate * m / (1 - b1^t) / (sqrt(v / (1 - b2^t)) + epsilon).
/// An element whose gradient (or update) is not finite keeps its value and moments, and is counted. Bound by memory:
/// 28 bytes moved an element.
///
/// With options.sparse a Gaussian that no ray of the step met (its mean has no gradient) keeps parameters and moments.
/// Of each of its five groups 12 bytes are read, and none written. Its moments wait until it is seen again instead of
/// fading, and so do penalties on it.
///
/// options.sh_pull is the derivative of a penalty on the square of the bands of colour above the first. Fast rates make
/// them follow the noise of single views, which the pull removes (L2 regularization). It joins the gradient here, where
/// the coefficient is read anyway. A coefficient without a gradient is not pulled: a view does not fade what it does
/// not show.

#include <gart/exec/concepts.hpp>
#include <gart/math/arith.hpp>
#include <gart/math/lanes.hpp>
#include <gart/optim/options.hpp>
#include <gart/scene/gaussians.hpp>

#include <cmath>
#include <cstring>
#include <iterator>
#include <type_traits>

namespace gart { inline namespace GART_ISA {

/// Adam's moments, of the parameters' shape.
template <execution E>
struct optimizer_state {
  gaussians<E> first, second;  ///< m and v

  ///@{
  /// Zeros.
  optimizer_state() = default;
  optimizer_state(E& exec, index_t n, int sh_degree) : first(exec, n, sh_degree), second(exec, n, sh_degree) {
    first.zero(), second.zero();
  }
  ///@}
};

/// A number and its moments.
template <class Number>
struct adam_element {
  Number parameter, first, second;  ///< with m and v
};

/// Adam's step of an element. `rate` carries first_correction.
struct adam_rule {
  float beta1 = 0, beta2 = 0, epsilon = 0, second_correction = 1;  ///< 1 / sqrt(1 - b2^t)

  /// @{ Of a step, counted from 1; of steps of a batch of images `step` counts images. A batch equals as many steps of
  /// one image, where these are small: betas^batch, epsilon / sqrt(batch), and rates times sqrt(batch), which the
  /// caller applies. Source: Malladi et al., On the SDEs and Scaling Rules for Adaptive Gradient Algorithms, 2022.
  adam_rule() = default;
  adam_rule(adam_options const& o, int step, int batch = 1)
      : beta1(batch == 1 ? o.beta1 : std::pow(o.beta1, static_cast<float>(batch))),
        beta2(batch == 1 ? o.beta2 : std::pow(o.beta2, static_cast<float>(batch))),
        epsilon(batch == 1 ? o.epsilon : o.epsilon / std::sqrt(static_cast<float>(batch))),
        second_correction(static_cast<float>(1.0 / std::sqrt(1.0 - std::pow(static_cast<double>(o.beta2), step)))) {}
  ///@}
  /// 1 / (1 - b1^t), which the rates carry.
  static double first_correction(adam_options const& o, int step) {
    return 1.0 / (1.0 - std::pow(static_cast<double>(o.beta1), step));
  }

  /// The element after a step by the gradient g.
  template <class Number>
  GART_HD GART_INLINE adam_element<Number> moved(adam_element<Number> const& e, Number g, Number rate) const {
    Number const m = fma(Number(beta1), e.first, mul(Number(1.0f - beta1), g));
    Number const v = fma(Number(beta2), e.second, mul(mul(Number(1.0f - beta2), g), g));
    return {e.parameter - rate * m / (square_root(v) * Number(second_correction) + Number(epsilon)), m, v};
  }
};

namespace detail {

// The rates of the arrays (scene/parameter_table.hpp): of a Gaussian's first three floats, and of the rest.
inline constexpr index_t head_columns = 3;
inline constexpr struct {
  float learning_rates::*head, learning_rates::*rest;
} parameter_rates[] = {{&learning_rates::mean, &learning_rates::mean},
                       {&learning_rates::log_scale, &learning_rates::log_scale},
                       {&learning_rates::quaternion, &learning_rates::quaternion},
                       {&learning_rates::opacity, &learning_rates::opacity},
                       {&learning_rates::sh_dc, &learning_rates::sh_rest}};
static_assert(std::size(parameter_rates) == parameter_arrays, "a rate for each array");

struct adam_group {
  float* parameter;
  float const* gradient;
  float* first;
  float* second;
  index_t stride;  // floats a Gaussian
  index_t active;  // of these, the first so many are trained
  index_t head;    // of these, the first so many have rate_head
  float rate_head, rate_rest;
  float pull_rest;  // of the rest, times the parameter
};

struct adam_arguments {
  static constexpr index_t rows_per_tile = 128;
  adam_group groups[parameter_arrays];  // the table's, from the last: the widest begins first
  index_t first_group = 0;              // of those that move
  index_t group_tiles, rows;
  adam_rule rule;  // the rates carry 1 / (1 - b1^t)
  u64* skipped;

  GART_HD static constexpr int group_of(int array) { return parameter_arrays - 1 - array; }
};

// Each group from first_group on has group_tiles tiles, each of `rows_per_tile` Gaussians.
template <execution E, bool Sparse>
struct adam_kernel : adam_arguments {
  static constexpr bool sparse = Sparse;
  struct scratch {};

  GART_KERNEL void operator()(auto const& team) const {
    index_t const group_index = team.tile() / group_tiles;
    index_t const row = (team.tile() - group_index * group_tiles) * rows_per_tile;
    index_t const count = rows - row < rows_per_tile ? rows - row : rows_per_tile;
    adam_group const& group = groups[first_group + group_index];
#if !defined(__CUDACC__)
    if constexpr (!E::device) return update_rows(group, row, count);
#endif
    // Four elements a lane. By single ones the loads in flight would bound a step, not the memory's bandwidth.
    std::size_t const base = std::size_t{row} * group.stride;
    index_t const elements = count * group.stride, quads = elements / 4;
    team.for_each(quads, [&](index_t q) {
      update_quad(group, base, row, 4 * q,
                  [&] { return *reinterpret_cast<quad const*>(group.gradient + base + 4 * q); });
    });
    team.for_each(elements - 4 * quads, [&](index_t k) {
      index_t const e = 4 * quads + k;
      if (!Sparse || seen(row + e / group.stride)) update(group, base + e, e % group.stride);
    });
  }

  GART_HD bool seen(index_t row) const {
    float const* const mean = groups[group_of(mean_array)].gradient + std::size_t{3} * row;
    return (mean[0] != 0) | (mean[1] != 0) | (mean[2] != 0);
  }

  GART_HD static float pulled(float g, float parameter, float pull) { return g != 0.0f ? fma(pull, parameter, g) : g; }

  // One element; whether it was finite.
  GART_KERNEL bool move(adam_group const& group, index_t column, float g, adam_element<float>& e) const {
    bool const head = column < group.head;
    float const slope = pulled(g, e.parameter, head ? 0.0f : group.pull_rest);
    auto const to = rule.moved<float>(e, slope, head ? group.rate_head : group.rate_rest);
    if (!is_finite(g) || !is_finite(to.second) || !is_finite(to.parameter)) {
      if (skipped) E::atomic_add(skipped, u64{1});
      return false;
    }
    e = to;
    return true;
  }

  GART_KERNEL void update(adam_group const& group, std::size_t i, index_t column) const {
    if (column < group.active) update(group, i, column, group.gradient[i]);
  }
  GART_KERNEL void update(adam_group const& group, std::size_t i, index_t column, float g) const {
    if (column >= group.active) return;
    adam_element<float> e{group.parameter[i], group.first[i], group.second[i]};
    if (move(group, column, g, e))
      group.parameter[i] = e.parameter, group.first[i] = e.first, group.second[i] = e.second;
  }

  // Elements e to e + 3 of a tile, which begins at `base` with a row. gradient() is called where any of them moves.
  // Elements that must not move keep their values.
  GART_KERNEL void update_quad(adam_group const& group, std::size_t base, index_t row, index_t e,
                               auto const& gradient) const {
    index_t columns[4];
    bool wanted[4];
    index_t next = e % group.stride;
    for (index_t k = 0; k < 4; ++k) {
      columns[k] = next, next = next + 1 < group.stride ? next + 1 : 0;
      wanted[k] = columns[k] < group.active && (!Sparse || seen(row + (e + k) / group.stride));
    }
    if (!(wanted[0] | wanted[1] | wanted[2] | wanted[3])) return;
    std::size_t const i = base + e;
    quad const g = gradient();
    quad p = *reinterpret_cast<quad const*>(group.parameter + i);
    quad m = *reinterpret_cast<quad const*>(group.first + i);
    quad v = *reinterpret_cast<quad const*>(group.second + i);
    for (int k = 0; k < 4; ++k) {
      adam_element<float> to{p.v[k], m.v[k], v.v[k]};
      if (wanted[k] && move(group, columns[k], g.v[k], to))
        p.v[k] = to.parameter, m.v[k] = to.first, v.v[k] = to.second;
    }
    *reinterpret_cast<quad*>(group.parameter + i) = p;
    *reinterpret_cast<quad*>(group.first + i) = m;
    *reinterpret_cast<quad*>(group.second + i) = v;
  }

#if !defined(__CUDACC__)
  // Rows that were seen and follow each other together.
  void update_rows(adam_group const& group, index_t row, index_t rows_here) const {
    if constexpr (!Sparse) return update_elements(group, row, rows_here);
    for (index_t from = 0, to; from < rows_here; from = to + 1) {
      for (to = from; to < rows_here && seen(row + to);) ++to;
      if (to > from) update_elements(group, row + from, to - from);
    }
  }

  // Elements a lane each, whatever their columns; where one is not finite, one by one.
  void update_elements(adam_group const& group, index_t row, index_t rows_here) const {
    constexpr index_t max_width = 48;  // of an array
    float rates[max_width + lane_count], trained[max_width + lane_count], pulls[max_width + lane_count];
    for (index_t k = 0; k < group.stride + lane_count; ++k) {
      index_t const column = k % group.stride;
      rates[k] = column < group.head ? group.rate_head : group.rate_rest;
      pulls[k] = column < group.head ? 0.0f : group.pull_rest;
      trained[k] = column < group.active ? 1.0f : 0.0f;
    }
    auto const read = [](float const* p) {
      lanes out;
      std::memcpy(&out, p, sizeof out);
      return out;
    };
    auto const write = [](float* p, lanes x) { std::memcpy(p, &x, sizeof x); };
    std::size_t const base = std::size_t{row} * group.stride;
    index_t const count = rows_here * group.stride;
    index_t e = 0, column = 0;
    for (; e + lane_count <= count; e += lane_count) {
      std::size_t const i = base + e;
      lane_mask const wanted = read(trained + column) > lanes(0.0f);
      lanes const g = read(group.gradient + i);
      adam_element<lanes> const from{read(group.parameter + i), read(group.first + i), read(group.second + i)};
      lanes const slope = select(magnitude(g) > lanes(0.0f), fma(read(pulls + column), from.parameter, g), g);
      auto const to = rule.moved(from, slope, read(rates + column));
      lanes const infinity(__builtin_huge_valf());
      lane_mask const finite =
          (magnitude(g) < infinity) & (magnitude(to.second) < infinity) & (magnitude(to.parameter) < infinity);
      if (any(wanted & ~finite)) {
        for (index_t k = 0; k < lane_count; ++k) update(group, i + k, (column + k) % group.stride);
      } else {
        write(group.parameter + i, select(wanted, to.parameter, from.parameter));
        write(group.first + i, select(wanted, to.first, from.first));
        write(group.second + i, select(wanted, to.second, from.second));
      }
      column = (column + lane_count) % group.stride;
    }
    for (; e < count; ++e) update(group, base + e, e % group.stride);
  }
#endif
};

// The colours' step by gradients that are given: of a Gaussian's floats those from `first` on, one or four.
template <class Kernel>
struct adam_colors {
  Kernel kernel;
  GART_KERNEL void operator()(index_t row, index_t first, auto const& gradient) const {
    adam_group const& group = kernel.groups[kernel.group_of(sh_array)];
    std::size_t const base = std::size_t{row} * group.stride;
    if constexpr (std::is_same_v<decltype(gradient), quad const&>)
      kernel.update_quad(group, base, row, first, [&] { return gradient; });
    else if (!Kernel::sparse || kernel.seen(row))
      kernel.update(group, base + first, first, gradient.v[0]);
  }
};

}  // namespace detail

/// A step of Adam, in one launch or in two. Its arguments must outlive it.
template <execution E>
class adam_pass {
 public:
  /// As adam_step.
  adam_pass(gaussians<E>& model, gaussians<E> const& gradient, optimizer_state<E>& state, learning_rates const& rates,
            int step, int active_sh_degree, span<u64> skipped = {}, adam_options const& options = {}, int batch = 1)
      : sparse_(options.sparse) {
    double const correction = adam_rule::first_correction(options, step);
    auto const rate = [&](float r) { return static_cast<float>(r * correction); };
    auto const p = model.view();
    int const degree = active_sh_degree < p.sh_degree ? active_sh_degree : p.sh_degree;
    for_each_array(
        [&](parameter_array const& a, float* parameter, float const* slope, float* first, float* second) {
          auto const [head, rest] = detail::parameter_rates[a.number];
          with_.groups[with_.group_of(a.number)] = {parameter,
                                                    slope,
                                                    first,
                                                    second,
                                                    a.width(p.sh_degree),
                                                    a.width(degree),
                                                    detail::head_columns,
                                                    rate(rates.*head),
                                                    rate(rates.*rest),
                                                    a.number == sh_array ? options.sh_pull : 0.0f};
        },
        p, gradient.view(), state.first.view(), state.second.view());
    with_.rows = p.count;
    with_.group_tiles = p.count / with_.rows_per_tile + (p.count % with_.rows_per_tile != 0);
    with_.rule = adam_rule(options, step, batch);
    with_.skipped = skipped.data();
  }

  /// All arrays.
  void all(E& exec) const { launch(exec, 0); }
  /// All but the colours, whose gradient need not be there yet.
  void geometry(E& exec) const { launch(exec, with_.group_of(sh_array) + 1); }
  /// The colours, by gradients that lie in no memory. Calls launch(take), whose kernel calls take(row, first, piece)
  /// for all floats of each Gaussian's colours. A piece has a quad of them, or one in piece.v, from number `first` on.
  template <class Launch>
  void colors(Launch&& launch) const {
    with_kernel([&]<class Kernel>(Kernel const& k) { launch(detail::adam_colors<Kernel>{k}); });
  }

 private:
  template <class F>
  void with_kernel(F&& f) const {
    if (sparse_)
      f(detail::adam_kernel<E, true>{with_});
    else
      f(detail::adam_kernel<E, false>{with_});
  }
  void launch(E& exec, index_t first_group) const {
    if (with_.rows == 0) return;
    with_kernel([&](auto k) {
      k.first_group = first_group;
      parallel_for(exec, "adam", tile_range{(parameter_arrays - first_group) * k.group_tiles, 256}, k);
    });
  }

  detail::adam_arguments with_;
  bool sparse_;
};

/// Step `step` (from 1), or with a batch the step after which there have been `step` images. Coefficients above
/// `active_sh_degree` are left alone. `skipped`, one element or empty, counts up by the elements that were not finite.
template <execution E>
void adam_step(E& exec, gaussians<E>& model, gaussians<E> const& gradient, optimizer_state<E>& state,
               learning_rates const& rates, int step, int active_sh_degree, span<u64> skipped = {},
               adam_options const& options = {}, int batch = 1) {
  adam_pass<E>(model, gradient, state, rates, step, active_sh_degree, skipped, options, batch).all(exec);
}

}}  // namespace gart::GART_ISA
