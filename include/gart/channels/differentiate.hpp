#pragma once
/// \file
/// The backward pass of channels over the hits of a table. From dL/d the rays' sums it computes dL/d the channels'
/// parameters. It also computes dL/d the Gaussians and the rays.
///
///   channel_gradient<E> back(exec);
///   back.begin(table);
///   back.add(features), back.add(depth);                    // what the weights of hits are worth, in all
///   back.add_moments(table, gaussians, moments);            // dL/d geometry, for backward/finish.hpp
///   back.pull(table, features, count, by_features);         // dL/d the parameters of a channel, overwritten
///
/// Here v is the worth of a hit, and B what lies behind it. Then
///   dL/dalpha = T v - B / (1 - alpha),   B = sum over hits behind of w v + T_end beyond.
/// A walk of each ray from its end finds B, so that no long sum is taken from another. Without add() and add_moments()
/// a channel is detached from the geometry: pull() needs the weights alone.
///
/// Memory: 4 bytes a hit and a ray, 4 more a hit with depth, and the order by Gaussian. Each piece of a Gaussian's hits
/// takes a row of 32 numbers (128 on hosts). Cost: the sort; a read of a channel's numbers for each hit in add() and
/// pull().

#include <gart/channels/gaussian_order.hpp>
#include <gart/channels/sum.hpp>
#include <gart/math/hit_gradient.hpp>

namespace gart { inline namespace GART_ISA {

namespace channel_kernels {

template <channel C>
struct weigh_hits {
  hit_table_view hits;
  C from;
  float *worths, *alongs;  // alongs: null where nothing moves with the distance
  GART_KERNEL void operator()(index_t k) const {
    listed_hit const h = hits.at(k);
    worths[k] += from.worth(h);
    if (alongs) alongs[k] += from.along(h);
  }
};

template <channel C>
struct weigh_rays {
  C from;
  float* beyonds;
  GART_KERNEL void operator()(index_t ray) const { beyonds[ray] += from.beyond(ray); }
};

// From worths to dL/dalpha, in place.
struct walk_back {
  hit_table_view hits;
  float const* beyonds;
  float* worths;
  GART_KERNEL void operator()(index_t ray) const {
    u64 const begin = hits.offsets[ray];
    u64 k = hits.offsets[ray + 1];
    if (k == begin) return;
    // T before a hit is its weight over its alpha.
    float const last = hits.alpha[k - 1];
    float behind = beyonds[ray] * (hits.weight[k - 1] / last * (1.0f - last));
    while (k-- > begin) {
      float const alpha = hits.alpha[k], weight = hits.weight[k], worth = worths[k];
      worths[k] = weight / alpha * worth - behind * estimated_reciprocal(1.0f - alpha);
      behind += weight * worth;
    }
  }
};

template <class Response>
struct moment_pieces {
  hit_table_view hits;
  gaussian_order_view order;
  ray_gaussian const* records;
  float const *by_alpha, *alongs;
  float* rows;  // [pieces][moment_stride]
  GART_KERNEL void operator()(index_t piece) const {
    u32 const first = order.firsts[piece], end = order.end_of(piece);
    ray_gaussian const gaussian = records[order.ids[first]];
    float sum[moment_stride] = {};
    for (u32 k = first; k < end; ++k) {
      ask_ahead(
          order, k, [&](u32 place) { ask_for(&hits.rays[place]), ask_for(&by_alpha[place]); },
          [&](u32 place) { ask_for(&hits.lines[hits.rays[place]]); });
      u32 const place = order.places[k];
      ray_peak const r = evaluate(gaussian, hits.lines[hits.rays[place]]);
      moments_of<float> const m =
          hit_moments_with_depth<Response>(gaussian, r, by_alpha[place], alongs ? alongs[place] : 0.0f, true);
      GART_UNROLL
      for (int i = 0; i < error_place; ++i) sum[i] += m.v[i];
    }
    for (int i = 0; i < moment_stride; ++i) rows[std::size_t{moment_stride} * piece + static_cast<index_t>(i)] = sum[i];
  }
};

template <channel C>
struct pull_pieces {
  hit_table_view hits;
  gaussian_order_view order;
  C from;
  int first, last, lanes;  // numbers of this launch; lanes a piece
  float* rows;             // [pieces][last - first]
  GART_KERNEL void operator()(index_t i) const {
    index_t const piece = i / static_cast<index_t>(lanes);
    int const begin = first + C::chunk * static_cast<int>(i % static_cast<index_t>(lanes));
    int const n = last - begin < C::chunk ? last - begin : C::chunk;
    float sums[C::chunk] = {};
    u32 const end = order.end_of(piece);
    for (u32 k = order.firsts[piece]; k < end; ++k) {
      ask_ahead(
          order, k, [&](u32 place) { ask_for(&hits.rays[place]), ask_for(&hits.weight[place]); },
          [&](u32 place) { from.ask(hits.rays[place], begin, n); });
      from.pull(hits.at(order.places[k]), begin, n, sums);
    }
    float* const to = rows + static_cast<std::size_t>(piece) * static_cast<std::size_t>(last - first) + (begin - first);
    for_each_number<C::chunk>(n, [&](int k) { to[k] = sums[k]; });
  }
};

// Numbers [first, last) of rows of `width` from those of their pieces, in order: added where Add, else overwritten.
template <int Chunk, bool Add>
struct add_up_pieces {
  gaussian_order_view order;
  float const* rows;
  int first, last, lanes, width;
  float* out;
  GART_KERNEL void operator()(index_t i) const {
    index_t const gaussian = i / static_cast<index_t>(lanes);
    int const begin = first + Chunk * static_cast<int>(i % static_cast<index_t>(lanes));
    int const n = last - begin < Chunk ? last - begin : Chunk;
    std::size_t const row = static_cast<std::size_t>(last - first);
    float sums[Chunk] = {};
    for (u64 piece = order.offsets[gaussian]; piece < order.offsets[gaussian + 1]; ++piece)
      for_each_number<Chunk>(
          n, [&](int k) { sums[k] += rows[piece * row + static_cast<std::size_t>(begin - first + k)]; });
    float* const to = out + static_cast<std::size_t>(gaussian) * static_cast<std::size_t>(width) + begin;
    for_each_number<Chunk>(n, [&](int k) { to[k] = Add ? to[k] + sums[k] : sums[k]; });
  }
};

}  // namespace channel_kernels

/// The memory of the pass, kept from one table to the next.
template <execution E, class Response = generalized_gaussian<>>
class channel_gradient {
 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit channel_gradient(E& exec) : exec_(&exec), worths_(exec), alongs_(exec), beyonds_(exec), rows_(exec) {}

  /// No channel yet; the table is one that is differentiated.
  void begin(hit_table<E> const& table) {
    hits_ = table.view(), moves_ = walked_ = false;
    worths_.resize(hits_.count), beyonds_.resize(hits_.ray_count);
    worths_.zero(), beyonds_.zero();
  }
  /// A channel of which weights and distances have gradients.
  template <channel C>
  void add(C const& from) {
    if (C::moves && !moves_) alongs_.resize(hits_.count), alongs_.zero(), moves_ = true;
    parallel_for(*exec_, "channels/worths", hits_.count,
                 channel_kernels::weigh_hits<C>{hits_, from, worths_.data(), C::moves ? alongs_.data() : nullptr});
    parallel_for(*exec_, "channels/worths", hits_.ray_count, channel_kernels::weigh_rays<C>{from, beyonds_.data()});
  }
  /// dL/dalpha of each hit, by all that was added.
  float const* by_alpha() {
    if (!walked_)
      parallel_for(*exec_, "channels/walk", hits_.ray_count,
                   channel_kernels::walk_back{hits_, beyonds_.data(), worths_.data()});
    walked_ = true;
    return worths_.data();
  }
  /// w dL/dt of each; null where it is zero.
  float const* alongs() const { return moves_ ? alongs_.data() : nullptr; }

  /// Adds to moments, [N][moment_stride]. `gaussians`: [N], in the frame of the rays.
  void add_moments(hit_table<E>& table, span<ray_gaussian const> gaussians, span<float> moments) {
    if (hits_.count == 0) return;
    index_t const n = static_cast<index_t>(gaussians.size());
    gaussian_order_view const order = table.by_gaussian(*exec_, n);
    rows_.resize(std::size_t{moment_stride} * order.pieces);
    parallel_for(
        *exec_, "channels/moments", order.pieces,
        channel_kernels::moment_pieces<Response>{hits_, order, gaussians.data(), by_alpha(), alongs(), rows_.data()});
    constexpr int lanes = moment_stride / 4;
    parallel_for(*exec_, "channels/moments", n * index_t{lanes},
                 channel_kernels::add_up_pieces<4, true>{order, rows_.data(), 0, moment_stride, lanes, moment_stride,
                                                         moments.data()});
  }

  /// dL/d the parameters of a channel, [N][parameters], overwritten.
  template <channel C>
  void pull(hit_table<E>& table, C const& from, index_t gaussians, float* out) {
    int const width = from.parameters();
    hits_ = table.view();
    if (hits_.count == 0) return exec_->zero(out, sizeof(float) * gaussians * static_cast<std::size_t>(width));
    gaussian_order_view const order = table.by_gaussian(*exec_, gaussians);
    index_t const most = order.pieces > gaussians ? order.pieces : gaussians;
    channel_kernels::for_each_launch<C::chunk>(most, width, [&](int first, int last, int lanes) {
      rows_.resize(std::size_t{order.pieces} * static_cast<std::size_t>(last - first));
      parallel_for(*exec_, "channels/pull", order.pieces * static_cast<index_t>(lanes),
                   channel_kernels::pull_pieces<C>{hits_, order, from, first, last, lanes, rows_.data()});
      parallel_for(
          *exec_, "channels/pull", gaussians * static_cast<index_t>(lanes),
          channel_kernels::add_up_pieces<C::chunk, false>{order, rows_.data(), first, last, lanes, width, out});
    });
  }

 private:
  E* exec_;
  hit_table_view hits_;
  bool moves_ = false, walked_ = false;
  buffer<float, E> worths_, alongs_, beyonds_, rows_;
};

}}  // namespace gart::GART_ISA
