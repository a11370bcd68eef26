#pragma once
/// \file
/// One tree over Gaussians that stay as they are, for any number of tracers:
///
///   shared_index<E> const tree(exec, scene.view(), options.alpha_min, frame);
///   one.share(&tree), other.share(&tree);                    // ray_tracers, each with a policy and a thread
///
/// The rule of threads: one thread at a time uses a policy. The same holds for a tracer, a context or a renderer.
/// Arrays of Gaussians and a shared tree are only read, by as many as like. A tracer whose Gaussians or alpha_min are
/// others than the tree's takes a tree of its own. So a stale tree changes no hit. What shares it waits for its policy
/// before the tree goes.
///
/// Cost: as rays/world_index.hpp; the constructor waits for its policy.

#include <gart/rays/fingerprint.hpp>
#include <gart/rays/world_index.hpp>

namespace gart { inline namespace GART_ISA {

/// The tree, and what it is of.
template <execution E, class Response = generalized_gaussian<>>
class shared_index {
 public:
  /// Built by `exec`, which must outlive it, in a frame near which most rays begin.
  shared_index(E& exec, gaussians_view<float const> scene, float alpha_min, vec3d const& frame) : index_(exec) {
    print_ = fingerprint<E>(exec).of(exec, scene);
    index_.build(exec, scene, alpha_min, frame);
    exec.synchronize();
  }
  /// Whether it is the tree of Gaussians of that fingerprint and number, hit from alpha_min.
  bool fits(u64 print, index_t count, float alpha_min) const {
    return print == print_ && count == index_.count() && alpha_min == index_.alpha_min();
  }
  /// The tree.
  world_index<E, Response> const& index() const { return index_; }

 private:
  world_index<E, Response> index_;
  u64 print_ = 0;
};

}}  // namespace gart::GART_ISA
