#pragma once
/// \file
/// The rows of a scene shared by ranks (comm/row_owners.hpp), through densification's interface (all_rows in
/// optim/rows.hpp). It also spreads whole models over ranks and gathers them.
///
/// Random draws must not depend on the number of ranks. So all ranks get one word of each Gaussian, and all draw as a
/// single rank would. Only the copied rows travel. Memory meanwhile: 4 bytes for each Gaussian of the scene and each
/// word. All ranks call the same members together.

#include <gart/comm/communicator.hpp>
#include <gart/optim/rows.hpp>

#include <algorithm>
#include <numeric>
#include <vector>

namespace gart { inline namespace GART_ISA {

namespace detail {

// Words in the order of ranks to the order of Gaussians.
struct interleave_kernel {
  u32 const* by_rank;
  u64 const* begin;  // of each rank's words
  row_owners owners;
  u32* out;
  GART_KERNEL void operator()(index_t g) const { out[g] = by_rank[begin[owners.owner(g)] + owners.local(g)]; }
};

// Rows of a model to a buffer, or from it.
struct pack_rows_body {
  gaussians_view<float const> model;
  u32 const* rows;
  float* out;
  index_t width;
  GART_KERNEL void operator()(index_t k, index_t column) const {
    out[std::size_t{k} * width + column] = row_element(model, rows[k], column);
  }
};
struct unpack_rows_body {
  gaussians_view<float> model;
  u32 const* rows;
  float const* in;
  index_t width;
  GART_KERNEL void operator()(index_t k, index_t column) const {
    row_element(model, rows[k], column) = in[std::size_t{k} * width + column];
  }
};

}  // namespace detail

/// Messages to or from each rank, from consecutive parts of a buffer: counts[r] elements of `bytes` for rank r.
inline std::vector<message> messages_of(std::vector<u64> const& counts, void* data, std::size_t bytes) {
  std::vector<message> out;
  char* at = static_cast<char*>(data);
  for (std::size_t r = 0; r < counts.size(); ++r) {
    if (counts[r]) out.push_back({static_cast<int>(r), at, counts[r] * bytes});
    at += counts[r] * bytes;
  }
  return out;
}

/// Comm: a communicator for E.
template <execution E, class Comm>
requires communicator<Comm, E>
class sharded_rows final : public all_rows<E> {
 public:
  /// `block`: Gaussians in one block (comm/row_owners.hpp).
  sharded_rows(E& exec, Comm comm, index_t block)
      : comm_(std::move(comm)),
        owners_{comm_.size(), comm_.rank(), block},
        gathered_(exec),
        packed_(exec),
        arrived_(exec) {}

  /// The owners of all rows.
  row_owners owners() const override { return owners_; }
  /// Several ranks share the rows.
  bool spread() const override { return true; }
  /// Gaussians on all ranks.
  index_t total(index_t here) override {
    u64 sum = here;
    comm_.all_reduce(span<u64>(&sum, 1));
    require_count(sum);
    return static_cast<index_t>(sum);
  }
  /// Gaussians of this rank among so many.
  index_t here(index_t total) const override { return owners_.owned(total); }

  /// Gathers one element of each Gaussian, by number, from those of the rows here.
  void gather(E& exec, buffer<u32, E>& words) override {
    index_t const total = this->total(static_cast<index_t>(words.size()));
    std::vector<u64> const counts = counts_of(total);
    std::vector<u64> begin(counts.size());
    std::exclusive_scan(counts.begin(), counts.end(), begin.begin(), u64{0});
    gathered_.resize(total);
    std::vector<message> to;
    for (int r = 0; r < owners_.ranks; ++r)
      if (words.size()) to.push_back({r, words.data(), words.size() * sizeof(u32)});
    comm_.exchange(exec, as_span(to), as_span(messages_of(counts, gathered_.data(), sizeof(u32))));
    buffer<u64, E> const begins(exec, begin);
    words.resize(total);
    parallel_for(exec, "shard/interleave", total,
                 detail::interleave_kernel{gathered_.data(), begins.data(), owners_, words.data()});
    exec.synchronize();  // `begins` ends here
  }

  /// Copies Gaussian from[k] over to[k], by numbers, on any ranks; from[] and to[] have none in common.
  void copy(E& exec, gaussians<E>& model, span<u32 const> from, span<u32 const> to) override {
    std::vector<u32> sources(from.size()), targets(to.size());
    exec.copy_out(sources.data(), from.data(), from.size() * sizeof(u32));
    exec.copy_out(targets.data(), to.data(), to.size() * sizeof(u32));
    send_rows(exec, model, sources, model, targets);
  }
  /// Copies Gaussian origin[g] of `from` to g of `to`, by numbers; `to` has its rows of origin.size() Gaussians.
  void take(E& exec, gaussians<E> const& from, gaussians<E>& to, span<u32 const> origin) override {
    std::vector<u32> sources(origin.size()), targets(origin.size());
    exec.copy_out(sources.data(), origin.data(), origin.size() * sizeof(u32));
    std::iota(targets.begin(), targets.end(), u32{0});
    send_rows(exec, from, sources, to, targets);
  }

  /// Runs must be whole blocks.
  std::vector<double> sums_of_runs(std::vector<double> const& mine, index_t run, std::size_t width) override {
    return sharded_rows(gathered_.exec(), comm_, std::max<index_t>(owners_.block / run, 1)).gather_all(mine, width);
  }

  /// Sends rows leave[r] of `from` to rank r. Rows of rank s arrive at arrive[s] of `to`, in the same order.
  void move_rows(E& exec, gaussians<E> const& from, std::vector<std::vector<u32>> const& leave, gaussians<E>& to,
                 std::vector<std::vector<u32>> const& arrive) {
    index_t const width = row_width(from.sh_degree());
    std::vector<u64> sent, received;
    buffer<u32, E> const out(exec, joined(leave, sent)), in(exec, joined(arrive, received));
    packed_.resize(out.size() * width), arrived_.resize(in.size() * width);
    for_each_element(exec, "shard/pack", static_cast<index_t>(out.size()), from.sh_degree(),
                     detail::pack_rows_body{from.view(), out.data(), packed_.data(), width});
    comm_.exchange(exec, as_span(messages_of(sent, packed_.data(), width * sizeof(float))),
                   as_span(messages_of(received, arrived_.data(), width * sizeof(float))));
    for_each_element(exec, "shard/unpack", static_cast<index_t>(in.size()), from.sh_degree(),
                     detail::unpack_rows_body{to.view(), in.data(), arrived_.data(), width});
    exec.synchronize();  // the lists end here
  }

  /// This rank's part of values of all Gaussians, `width` a row.
  template <class T>
  std::vector<T> local_part(std::vector<T> const& all, std::size_t width) const {
    std::vector<T> mine;
    owners_.for_each_run(all.size() / width, [&](u64 first, u64 count, u64) {
      mine.insert(mine.end(), all.begin() + offset(first * width), all.begin() + offset((first + count) * width));
    });
    return mine;
  }
  /// This rank's rows of a whole model.
  gaussian_model local_part(gaussian_model const& all) const {
    gaussian_model mine;
    mine.sh_degree = all.sh_degree;
    for_each_array(
        [&](parameter_array const& a, auto& to, auto const& from) { to = local_part(from, a.width(all.sh_degree)); },
        mine, all);
    return mine;
  }

  /// Gathers the rows of all ranks, on all ranks or on `root` alone.
  template <class T>
  std::vector<T> gather_all(std::vector<T> const& mine, std::size_t width, int root = -1) {
    u64 total = mine.size() / width;
    comm_.all_reduce(span<u64>(&total, 1));
    std::vector<u64> counts = counts_of(total);
    bool const takes = root < 0 || root == owners_.rank;
    std::vector<T> by_rank(takes ? total * width : 0), all(by_rank.size());
    std::vector<message> to, from;
    std::size_t at = 0;
    for (int r = 0; r < owners_.ranks; ++r) {
      std::size_t const n = counts[static_cast<std::size_t>(r)] * width;
      if (!mine.empty() && (root < 0 || r == root))
        to.push_back({r, const_cast<T*>(mine.data()), mine.size() * sizeof(T)});
      if (takes && n) from.push_back({r, by_rank.data() + at, n * sizeof(T)});
      at += n;
    }
    comm_.exchange(as_span(to), as_span(from));
    at = 0;
    for (int r = 0; takes && r < owners_.ranks; at += counts[static_cast<std::size_t>(r++)])
      row_owners{owners_.ranks, r, owners_.block}.for_each_run(total, [&](u64 first, u64 count, u64 row) {
        std::copy_n(by_rank.begin() + offset((at + row) * width), count * width, all.begin() + offset(first * width));
      });
    return all;
  }
  /// The same for a model.
  gaussian_model gather_all(gaussian_model const& mine, int root = -1) {
    gaussian_model all;
    all.sh_degree = mine.sh_degree;
    for_each_array([&](parameter_array const& a, auto& to,
                       auto const& from) { to = gather_all(from, a.width(mine.sh_degree), root); },
                   all, mine);
    return all;
  }

 private:
  // Copies Gaussian sources[k] of `from` to targets[k] of `to`, in the order of the lists.
  void send_rows(E& exec, gaussians<E> const& from, std::vector<u32> const& sources, gaussians<E>& to,
                 std::vector<u32> const& targets) {
    auto const ranks = static_cast<std::size_t>(owners_.ranks);
    std::vector<std::vector<u32>> leave(ranks), arrive(ranks);
    for (std::size_t k = 0; k < sources.size(); ++k) {
      if (owners_.owns(sources[k]))
        leave[static_cast<std::size_t>(owners_.owner(targets[k]))].push_back(owners_.local(sources[k]));
      if (owners_.owns(targets[k]))
        arrive[static_cast<std::size_t>(owners_.owner(sources[k]))].push_back(owners_.local(targets[k]));
    }
    move_rows(exec, from, leave, to, arrive);
  }
  static std::ptrdiff_t offset(std::size_t at) { return static_cast<std::ptrdiff_t>(at); }
  std::vector<u64> counts_of(u64 total) const {
    std::vector<u64> out;
    for (int r = 0; r < owners_.ranks; ++r) out.push_back(owners_.owned(total, r));
    return out;
  }
  static std::vector<u32> joined(std::vector<std::vector<u32>> const& lists, std::vector<u64>& counts) {
    std::vector<u32> all;
    for (auto const& one : lists) all.insert(all.end(), one.begin(), one.end()), counts.push_back(one.size());
    return all;
  }

  Comm comm_;
  row_owners owners_;
  buffer<u32, E> gathered_;
  buffer<float, E> packed_, arrived_;
};

}}  // namespace gart::GART_ISA
