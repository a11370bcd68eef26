#pragma once
/// \file
/// A scene's parameters, structure of arrays, N Gaussians of SH degree D with K = (D + 1)^2 coefficients a channel:
///   mean        [N][3]     world units
///   log_scale   [N][3]     natural logarithm of the standard deviations
///   quaternion  [N][4]     w, x, y, z; any norm, normalised where it is used
///   opacity     [N]        logit
///   sh          [N][K][3]  coefficient-major, colours interleaved (splat files are channel-major; io converts)
/// gaussian_model holds them on the host, gaussians<E> in a policy's memory. Gradients and Adam's moments have the same
/// shape. Code that handles all five arrays walks scene/parameter_table.hpp. Errors: invalid_argument for more
/// Gaussians than 32-bit indices can serve; out_of_memory.

#include <gart/core/error.hpp>
#include <gart/core/span.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/scene/parameter_table.hpp>

#include <algorithm>
#include <string>
#include <vector>

namespace gart {

/// Of one rank: indices have 32 bits, and a launch may take up to 15 of them a Gaussian.
inline constexpr std::size_t most_gaussians = std::size_t{1} << 28;

/// Throws invalid_argument for more Gaussians than that.
inline void require_count(std::size_t n) {
  if (n > most_gaussians)
    throw invalid_argument(std::to_string(n) + " Gaussians are more than the " + std::to_string(most_gaussians) +
                           " that a scene can hold: lower train_options.max_gaussians");
}

/// Gaussians on the host.
struct gaussian_model {
  int sh_degree = 0;                                            ///< D
  std::vector<float> mean, log_scale, quaternion, opacity, sh;  ///< as above
  int feature_count = 0;                                        ///< features of each (scene/features.hpp); 0: none
  std::vector<float> features = {};                             ///< [N][feature_count]: shown and kept, not trained

  /// N.
  std::size_t size() const { return opacity.size(); }
  /// To n Gaussians of a degree; new numbers are zero.
  void resize(std::size_t n, int degree) {
    sh_degree = degree;
    for_each_array([&](parameter_array const& a, auto& values) { values.resize(n * a.width(degree)); }, *this);
    features.resize(n * static_cast<std::size_t>(feature_count));
  }
  /// Whether all arrays are of size() Gaussians.
  bool arrays_agree() const {
    bool agree = feature_count >= 0 && features.size() == size() * static_cast<std::size_t>(feature_count);
    for_each_array([&](parameter_array const& a,
                       auto const& values) { agree = agree && values.size() == size() * a.width(sh_degree); },
                   *this);
    return agree;
  }
};

/// f(floats a Gaussian, member of every model...) for each array of models of the same degree and features. Code that
/// moves whole Gaussians walks these.
inline void for_each_row_array(auto&& f, gaussian_model const& of, auto&&... models) {
  for_each_array([&](parameter_array const& a, auto&&... values) { f(std::size_t{a.width(of.sh_degree)}, values...); },
                 models...);
  f(static_cast<std::size_t>(of.feature_count), models.features...);
}

/// The same Gaussians with other storage: coefficients past `degree` are dropped, missing ones are zero.
inline gaussian_model with_sh_degree(gaussian_model model, int degree) {
  if (degree == model.sh_degree) return model;
  std::size_t const from = std::size_t{3} * sh_coefficients(model.sh_degree),
                    to = std::size_t{3} * sh_coefficients(degree);
  std::vector<float> const old = std::move(model.sh);
  model.sh.assign(model.size() * to, 0.0f), model.sh_degree = degree;
  for (std::size_t i = 0; i < model.size(); ++i)
    std::copy_n(old.data() + i * from, std::min(from, to), model.sh.data() + i * to);
  return model;
}

/// T is float or float const.
template <class T>
struct gaussians_view {
  T* mean = nullptr;        ///< [N][3]
  T* log_scale = nullptr;   ///< [N][3]
  T* quaternion = nullptr;  ///< [N][4]
  T* opacity = nullptr;     ///< [N]
  T* sh = nullptr;          ///< [N][K][3]
  index_t count = 0;        ///< N
  int sh_degree = 0;        ///< D

  /// Coefficients of a Gaussian, 3 K.
  GART_HD int sh_stride() const { return 3 * sh_coefficients(sh_degree); }
  /// The same, which can be read alone.
  GART_HD operator gaussians_view<T const>() const requires(!std::is_const_v<T>) {
    return {mean, log_scale, quaternion, opacity, sh, count, sh_degree};
  }
};

/// Gaussians in a policy's memory.
template <execution E>
class gaussians {
 public:
  gaussians() = default;
  /// Of n Gaussians, undefined.
  gaussians(E& exec, std::size_t n, int sh_degree)
      : mean(exec), log_scale(exec), quaternion(exec), opacity(exec), sh(exec), degree_(sh_degree) {
    resize_keep(n);
  }
  /// A copy of the host's.
  gaussians(E& exec, gaussian_model const& m) : gaussians(exec, 0, m.sh_degree) { assign(m); }

  buffer<float, E> mean, log_scale, quaternion, opacity, sh;  ///< as above

  /// N.
  index_t size() const { return static_cast<index_t>(opacity.size()); }
  /// D.
  int sh_degree() const { return degree_; }
  ///@{
  /// All arrays, for kernels.
  gaussians_view<float> view() {
    return {mean.data(), log_scale.data(), quaternion.data(), opacity.data(), sh.data(), size(), degree_};
  }
  gaussians_view<float const> view() const {
    return {mean.data(), log_scale.data(), quaternion.data(), opacity.data(), sh.data(), size(), degree_};
  }
  ///@}
  /// Existing Gaussians stay; new ones are undefined.
  void resize_keep(std::size_t n) {
    require_count(n);
    for_each_array([&](parameter_array const& a, auto& values) { values.resize_keep(n * a.width(degree_)); }, *this);
  }
  /// Memory for n Gaussians in all, where there is less; size() stays.
  void reserve(std::size_t n) {
    require_count(n);
    for_each_array([&](parameter_array const& a, auto& values) { values.reserve(n * a.width(degree_)); }, *this);
  }
  /// Sets all numbers to 0.
  void zero() {
    for_each_array([](parameter_array const&, auto& values) { values.zero(); }, *this);
  }
  /// A copy of the host's takes the place of all.
  void assign(gaussian_model const& m) {
    require_count(m.size());
    degree_ = m.sh_degree;
    for_each_array([](parameter_array const&, auto& to, auto const& from) { to.assign(from); }, *this, m);
  }
  /// A copy for the host; waits for it.
  gaussian_model to_host() const {
    gaussian_model m;
    m.sh_degree = degree_;
    for_each_array([](parameter_array const&, auto& to, auto const& from) { to = from.to_host(); }, m, *this);
    return m;
  }

 private:
  int degree_ = 0;
};

}  // namespace gart
