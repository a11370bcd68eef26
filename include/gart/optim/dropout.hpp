#pragma once
/// \file
/// Dropout of Gaussians (Srivastava et al. 2014; of Gaussians: Park, Ryu and Kim, DropGaussian, CVPR 2025). A step
/// leaves out a random share r of the Gaussians. The others become more opaque, so that the mean opacity stays:
///   o' = o / (1 - r).
/// A Gaussian that explains one photograph alone is then of little use, so this reduces overfitting. From a share
/// `until` of the run on, steps show the whole scene, which is what will be rendered.
///
/// An o' over 0.995 is that, or o where that is more. The gradient by the logit of o' serves as that by the logit of o.
/// Gaussians left out have none. Draws depend on the Gaussians' numbers in the scene, so several ranks draw as one
/// does. Cost: 4 bytes a Gaussian, and a pass that reads and writes as much; nothing without a share.

#include <gart/comm/row_owners.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/math/logit.hpp>
#include <gart/optim/random.hpp>
#include <gart/scene/gaussians.hpp>

#include <utility>

namespace gart { inline namespace GART_ISA {

namespace detail {

struct dropout_kernel {
  static constexpr float none = -40.0f;  // a logit below any alpha_min
  static constexpr float most = 0.995f;  // no Gaussian is made more opaque than this
  float const* opacity;
  float* shown;
  row_owners owners;
  random_source random;
  float share;
  GART_KERNEL void operator()(index_t i) const {
    float const o = opacity[i], raised = sigmoid(o) / (1.0f - share);
    float const stays = logit(raised < most ? raised : most);
    bool const out = uniform(random.words(owners.global(i)).v[0]) < share;
    shown[i] = out ? none : o > stays ? o : stays;
  }
};

}  // namespace detail

/// The dropout of a run.
template <execution E>
class dropout {
 public:
  /// Leaves out a share of the Gaussians, less than 1, until a share of the run.
  dropout(E& exec, float share, float until, u64 seed)
      : exec_(&exec), share_(share), until_(until), seed_(seed), shown_(exec) {}
  /// Makes room for so many Gaussians.
  void reserve(u64 count) {
    if (share_ > 0) shown_.reserve(count);
  }

  /// While it lives, the scene has the step's opacities.
  class scope {
   public:
    scope(scope const&) = delete;
    scope& operator=(scope const&) = delete;
    ~scope() { end(); }
    /// Restores the scene's opacities; kernels and frames that have read the others are unaffected.
    void end() {
      if (auto* const scene = std::exchange(scene_, nullptr)) std::swap(scene->opacity, *shown_);
    }

   private:
    friend class dropout;
    scope(gaussians<E>* scene, buffer<float, E>* shown) : scene_(scene), shown_(shown) {}
    gaussians<E>* scene_;
    buffer<float, E>* shown_;
  };

  /// Applies the dropout of step `step` of so many to `scene`, the rows of these owners, until the scope ends. The
  /// scene must keep its count until then.
  [[nodiscard]] scope leave_out(gaussians<E>& scene, int step, int iterations, row_owners const& owners) {
    bool const drops = share_ > 0 && static_cast<float>(step) < until_ * static_cast<float>(iterations);
    if (!drops || scene.size() == 0) return scope(nullptr, nullptr);
    shown_.resize(scene.size());
    parallel_for(
        *exec_, "dropout", scene.size(),
        detail::dropout_kernel{
            scene.opacity.data(), shown_.data(), owners, {seed_, static_cast<u32>(step), random_use::dropout}, share_});
    std::swap(scene.opacity, shown_);
    return scope(&scene, &shown_);
  }

 private:
  E* exec_;
  float share_, until_;
  u64 seed_;
  buffer<float, E> shown_;  // outside of a scope; in one, the scene's own
};

}}  // namespace gart::GART_ISA
