#pragma once
/// \file
/// The plan of a step on one rank: one unit, a whole view, of Gaussians that are all here. It has the members of
/// rank_units (rank_units.hpp), so that a trainer has one step for both.

#include <gart/comm/self_comm.hpp>
#include <gart/optim/trained_gaussians.hpp>
#include <gart/shard/work_units.hpp>
#include <gart/train/densify/densifier.hpp>
#include <gart/train/step_image.hpp>

namespace gart { inline namespace GART_ISA {

/// As rank_units.
template <execution E>
class whole_view {
 public:
  ///@{
  /// As rank_units.
  int views() const { return 1; }
  all_rows<E>& rows() { return whole_scene<E>(); }
  void begin_step() {}
  void fetch(gaussians_view<float const> const& scene, std::vector<camera> const&, std::vector<std::size_t> const&,
             render_options const&) {
    scene_ = scene;
  }
  work_unit unit() const { return {0, 0, 1, {}}; }
  gaussians_view<float const> scene() const { return scene_; }
  void finish_fetch() {}
  void share(void*, camera const&, std::size_t) {}
  bool divides_loss(bool) { return false; }
  void differentiate_loss(step_image<E>&, truth_view const&, camera const&, float, bool) {}
  void finish_loss(step_image<E>&, span<float>) {}
  template <class Pass>
  void require(Pass const&) const {}
  template <class Frame, class Pass>
  void sum(Frame& frame, Pass& pass, step_image<E> const& image, gaussians<E>& gradients) {
    differentiate(frame, pass, image.gradients(), gradients, image.error);
    moments_ = pass.moments();
  }
  template <class Frame, class Pass>
  void give_back(Frame&, Pass const&, float) {}
  void give_nothing_back() {}
  template <class Own>
  void take(E& exec, trained_gaussians<E>& g, std::vector<camera> const&, int, int, render_options const&,
            densifier<E>& densify, bool, Own const& own) {
    if (densify.by_error() && g.size()) add_errors(exec, moments_, densify.error_sums(g.size()));
    own(0, g.gradients);
  }
  void move(E& exec, adam_pass<E> const& adam, gaussians<E>&) { adam.all(exec); }
  void sum_arrived(gaussians<E>&) {}
  void end_step(bool) {}
  void collect(std::vector<float>&, std::size_t, int) {}
  u64 sum(u64 mine) { return mine; }
  ///@}

 private:
  gaussians_view<float const> scene_;
  span<float const> moments_;
};

}}  // namespace gart::GART_ISA
