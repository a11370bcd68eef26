#pragma once
/// \file
/// Checks that all parameters and Adam's moments are finite. One launch over each counts the others; one read brings
/// the counts to the host.
///
/// Adam skips updates that are not finite, so gradients cannot cause such a parameter. One found here came from the
/// start, a checkpoint or a densification, or is a bug. Adam's skipped updates are counted too (adam_step's `skipped`),
/// and are no error.
///
/// Cost: reads 12 bytes of each parameter (708 a Gaussian at SH degree 3, where Adam moves 1,652) and waits for the
/// queue. Errors: not_finite, naming the group, the count, the first Gaussian and what to check.

#include <gart/comm/row_owners.hpp>
#include <gart/core/error.hpp>
#include <gart/exec/concepts.hpp>
#include <gart/math/arith.hpp>
#include <gart/optim/adam.hpp>
#include <gart/scene/gaussians.hpp>

#include <array>
#include <initializer_list>
#include <string>
#include <vector>

namespace gart { inline namespace GART_ISA {

namespace detail {

// Group g has tiles [g * group_tiles, (g + 1) * group_tiles), each of `rows_per_tile` Gaussians.
template <execution E>
struct count_not_finite_kernel {
  static constexpr index_t rows_per_tile = 128;
  struct scratch {};
  float const* values[2 * parameter_arrays];
  index_t stride[2 * parameter_arrays];  // floats a Gaussian
  index_t group_tiles, rows;
  u64* counts;

  GART_KERNEL void operator()(auto const& team) const {
    index_t const group = team.tile() / group_tiles;
    index_t const row = (team.tile() - group * group_tiles) * rows_per_tile;
    index_t const count = rows - row < rows_per_tile ? rows - row : rows_per_tile;
    float const* const first = values[group] + std::size_t{row} * stride[group];
    u32 found = 0;  // by this lane
    team.for_each(count * stride[group], [&](index_t e) { found += !is_finite(first[e]); });
    if (found) E::atomic_add(counts + group, u64{found});
  }
};

}  // namespace detail

/// Checks a whole model and its moments.
template <execution E>
class finite_check {
 public:
  /// Nothing is counted yet. `owners`: needed where the rows are not all of the scene.
  explicit finite_check(E& exec, row_owners const& owners = {})
      : exec_(exec), owners_(owners), counts_(exec, kinds + 1) {
    counts_.zero();
  }

  /// The counter for adam_step.
  span<u64> skipped() const { return {counts_.data() + kinds, 1}; }

  /// The updates that Adam skipped since the last call. `where` begins the error's message: "step 7, view a".
  u64 operator()(gaussians<E> const& model, optimizer_state<E> const& state, std::string const& where) {
    count("finite/parameters", {&model}, 0);
    count("finite/moments", {&state.first, &state.second}, parameter_arrays);
    std::vector<u64> const counts = counts_.to_host();
    for (u64 const c : counts) {
      if (c == 0) continue;
      counts_.zero();
      break;
    }
    std::array<gaussians<E> const*, 3> const all{&model, &state.first, &state.second};
    for (int kind = 0; kind < kinds; ++kind)
      if (counts[kind]) fail(*all[kind / parameter_arrays], kind, counts[kind], where);
    return counts[kinds];
  }

 private:
  static constexpr int kinds = 3 * parameter_arrays;  // of the parameters, the first and the second moments

  void count(char const* label, std::initializer_list<gaussians<E> const*> sets, int first_kind) {
    index_t const rows = (*sets.begin())->size();
    if (rows == 0) return;
    using kernel = detail::count_not_finite_kernel<E>;
    kernel k{};
    index_t groups = 0;
    for (gaussians<E> const* set : sets)
      for_each_array(
          [&](parameter_array const& a, float const* values) {
            k.values[groups] = values;
            k.stride[groups++] = a.width(set->sh_degree());
          },
          set->view());
    k.rows = rows;
    k.group_tiles = rows / kernel::rows_per_tile + (rows % kernel::rows_per_tile != 0);
    k.counts = counts_.data() + first_kind;
    parallel_for(exec_, label, tile_range{groups * k.group_tiles, 256}, k);
  }

  [[noreturn]] void fail(gaussians<E> const& set, int kind, u64 count, std::string const& where) const {
    int const group = kind % parameter_arrays, moment = kind / parameter_arrays;
    std::vector<float> values;
    char const* title = "";
    for_each_array(
        [&](parameter_array const& a, buffer<float, E> const& array) {
          if (a.number == group) values = array.to_host(), title = a.title;
        },
        set);
    std::size_t const stride = values.size() / set.size();
    std::size_t at = 0;
    while (at + 1 < values.size() && is_finite(values[at])) ++at;
    std::size_t const gaussian = owners_.global(static_cast<index_t>(at / stride));
    static constexpr char const* sets[] = {"", "Adam's first moment of ", "Adam's second moment of "};
    std::string const name = std::string(sets[moment]) + title;
    std::string const numbers =
        count == 1 ? "1 number of " + name + " is not finite, that of Gaussian "
                   : std::to_string(count) + " numbers of " + name + " are not finite, the first that of Gaussian ";
    std::string const place = ", element " + std::to_string(at % stride) + " of " + std::to_string(stride) + ": " +
                              std::to_string(values[at]);
    std::string const remedy =
        moment == 0
            ? "Adam leaves updates out that are not finite: look at this Gaussian in what the run started or was "
              "resumed from, and train with train_options.densify = none, which tells whether densification made it"
            : "moments begin with zero and Adam writes finite ones alone: look at the checkpoint that the run was "
              "resumed from, and train with train_options.densify = none, which tells whether densification made it";
    throw not_finite(where + ": " + numbers + std::to_string(gaussian) + place + " (" + remedy + ")", name, gaussian);
  }

  E& exec_;
  row_owners owners_;
  buffer<u64, E> counts_;
};

}}  // namespace gart::GART_ISA
