#pragma once
// Random models for the optimizer's tests.

#include <gart/optim/trained_gaussians.hpp>
#include <gart/scene/gaussians.hpp>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace gart_test {

inline void fill(std::vector<float>& values, std::mt19937_64& random, float low, float high) {
  std::uniform_real_distribution<float> u(low, high);
  for (float& v : values) v = u(random);
}

inline gart::gaussian_model random_model(gart::index_t n, int degree, std::mt19937_64& random) {
  gart::gaussian_model m;
  m.resize(n, degree);
  fill(m.mean, random, -1, 1), fill(m.log_scale, random, -4, -2), fill(m.quaternion, random, -1, 1);
  fill(m.opacity, random, -3, 3), fill(m.sh, random, -1, 1);
  return m;
}

// A model in a policy's memory, with moments of one.
template <class E>
struct own_policy {
  E exec;
};
template <class E>
struct with_moments : own_policy<E>, gart::trained_gaussians<E> {
  explicit with_moments(gart::gaussian_model const& m)
      : gart::trained_gaussians<E>(own_policy<E>::exec, m, m.sh_degree) {
    gart::gaussian_model const ones = ones_like(m);
    this->moments.first.assign(ones), this->moments.second.assign(ones);
  }
  static gart::gaussian_model ones_like(gart::gaussian_model m) {
    for (auto* v : {&m.mean, &m.log_scale, &m.quaternion, &m.opacity, &m.sh}) std::fill(v->begin(), v->end(), 1.0f);
    return m;
  }
};

inline double sigmoid(double x) { return 1 / (1 + std::exp(-x)); }
inline double logit(double p) { return std::log(p / (1 - p)); }

// Row i as floats in the order of rows.hpp.
inline std::vector<float> row(gart::gaussian_model& m, gart::index_t i) {
  gart::gaussians_view<float> const v{m.mean.data(),    m.log_scale.data(), m.quaternion.data(),
                                      m.opacity.data(), m.sh.data(),        static_cast<gart::index_t>(m.size()),
                                      m.sh_degree};
  std::vector<float> out;
  for (gart::index_t c = 0; c < gart::row_width(m.sh_degree); ++c) out.push_back(gart::row_element(v, i, c));
  return out;
}

inline bool all_zero(std::vector<float> const& values) {
  for (float const v : values)
    if (v != 0) return false;
  return true;
}

}  // namespace gart_test
