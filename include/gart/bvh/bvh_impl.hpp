#pragma once
/// \file
/// Template bodies of bvh.hpp.

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/algorithm/sort_pairs.hpp>
#include <gart/bvh/bvh.hpp>
#include <gart/bvh/collapse.hpp>

namespace gart { inline namespace GART_ISA {

template <execution E>
void bvh<E>::build(E& exec, span<box const> boxes) {
  count_ = static_cast<index_t>(boxes.size());
  if (count_ == 0) return;
  stage_scope stage(exec, "bvh build");
  constexpr index_t wide = 16384, narrow = 128;
  bounds_.resize(wide + narrow + 2);
  codes_.resize(count_), order_.resize(count_), leaf_up_.resize(count_);
  binary_.resize(count_ > 1 ? count_ - 1 : 1);
  span<box> const all = bounds_.view();
  span<box> const stage1 = all.subspan(0, wide), stage2 = all.subspan(wide, narrow),
                  root = all.subspan(wide + narrow, 1), bulk = all.subspan(wide + narrow + 1, 1);
  parallel_for(exec, "bvh/bounds", wide, bvh_kernels::bound_centers{boxes, stage1, true});
  parallel_for(exec, "bvh/bounds", narrow, bvh_kernels::bound_centers{stage1, stage2, false});
  parallel_for(exec, "bvh/bounds", 6 * narrow, bvh_kernels::find_bulk{stage2, bulk});
  parallel_for(exec, "bvh/bounds", 1, bvh_kernels::bound_codes{stage2, bulk, root});
  parallel_for(exec, "bvh/codes", count_, bvh_kernels::encode{boxes, root, codes_, order_});
  sort_pairs(exec, codes_.view(), order_.view(), morton_bits);
  if (count_ > 1)
    parallel_for(exec, "bvh/link", count_ - 1, bvh_kernels::link{codes_, order_, binary_, leaf_up_});
  else
    parallel_for(exec, "bvh/link", 1, bvh_kernels::link_single{binary_, leaf_up_});
  refit(exec, boxes);
}

template <execution E>
void bvh<E>::refit(E& exec, span<box const> boxes) {
  if (boxes.size() != count_) throw invalid_argument("bvh::refit: as many boxes as the tree was built over are needed");
  if (count_ == 0) return;
  index_t const inner = static_cast<index_t>(binary_.size());
  arrivals_.resize(inner), costs_.resize(inner), is_wide_.resize(inner), place_.resize(inner);
  nodes_.resize(inner);
  arrivals_.zero();
  parallel_for(exec, "bvh/fit", count_, bvh_kernels::fit<E>{boxes, order_, leaf_up_, binary_, costs_, arrivals_});
  parallel_for(exec, "bvh/choose", inner, bvh_kernels::choose_wide{binary_, is_wide_});
  exclusive_scan(exec, span<u32 const>(is_wide_), place_.view());
  parallel_for(exec, "bvh/collapse", inner, bvh_kernels::collapse{binary_, is_wide_, place_, nodes_});
}

}}  // namespace gart::GART_ISA
