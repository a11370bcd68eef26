// The way back of a channel over a table made by hand, against differences in double: what lies beyond the last hit
// counts, and of Gaussians there are more hits than a piece of them has.
#include <gart/channels/differentiate.hpp>

#include <support/policies.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace {

using gart::index_t;
using gart::u32;

// A number of each Gaussian, and one that only the background has.
struct toy_channel : gart::channel_base {
  float const* values;    // [Gaussians]
  float const* beyonds;   // [rays]
  float const* gradient;  // dL/d sum, [rays]
  GART_HD int parameters() const { return 1; }
  GART_HD void add(gart::listed_hit const& h, int, int, float (&sums)[1]) const { sums[0] += h.weight * values[h.id]; }
  GART_HD float worth(gart::listed_hit const& h) const { return values[h.id] * gradient[h.ray]; }
  GART_HD float beyond(u32 ray) const { return beyonds[ray] * gradient[ray]; }
  GART_HD void pull(gart::listed_hit const& h, int, int, float (&sums)[1]) const {
    sums[0] += h.weight * gradient[h.ray];
  }
};

// Of one ray, by the opacities of its hits.
double sum_of(std::vector<double> const& alpha, std::vector<double> const& values, double beyond) {
  double sum = 0, left = 1;
  for (std::size_t k = 0; k < alpha.size(); ++k) sum += left * alpha[k] * values[k], left *= 1 - alpha[k];
  return sum + left * beyond;
}

}  // namespace

TEST_CASE_TEMPLATE("the way back over hits, with what lies beyond them", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<float> part(0.02f, 0.95f), number(-2, 2);
  std::size_t const rays = 400, gaussians = 5;
  auto const numbers = [&](std::size_t n) {
    std::vector<float> all(n);
    for (float& x : all) x = number(engine);
    return all;
  };
  auto const values = numbers(gaussians), beyonds = numbers(rays), gradient = numbers(rays);

  std::vector<gart::u64> offsets{0};
  std::vector<u32> ids, of_ray;
  std::vector<float> alpha, weight;
  std::vector<double> by_alpha, by_value(gaussians);
  for (std::size_t r = 0; r < rays; ++r) {
    std::vector<u32> order(gaussians);
    std::iota(order.begin(), order.end(), 0u);
    std::shuffle(order.begin(), order.end(), engine);
    order.resize(r % (gaussians + 1));  // some rays have no hit
    std::vector<double> a, v;
    double left = 1;
    for (u32 const id : order) {
      ids.push_back(id), of_ray.push_back(static_cast<u32>(r)), alpha.push_back(part(engine));
      a.push_back(double{alpha.back()}), v.push_back(double{values[id]});
      weight.push_back(static_cast<float>(left * a.back()));
      by_value[id] += left * a.back() * double{gradient[r]};
      left *= 1 - a.back();
    }
    for (std::size_t k = 0; k < a.size(); ++k) {
      double const step = 1e-5;
      std::vector<double> more = a, less = a;
      more[k] += step, less[k] -= step;
      by_alpha.push_back(double{gradient[r]} *
                         (sum_of(more, v, double{beyonds[r]}) - sum_of(less, v, double{beyonds[r]})) / (2 * step));
    }
    offsets.push_back(ids.size());
  }

  E exec;
  gart::hit_table<E> table(exec);
  table.offsets.assign(offsets), table.ids.assign(ids), table.rays.assign(of_ray);
  table.t.assign(std::vector<float>(ids.size(), 1.0f)), table.alpha.assign(alpha), table.weight.assign(weight);
  table.lines.resize(rays);
  gart::buffer<float, E> const v(exec, values), b(exec, beyonds), g(exec, gradient);
  gart::buffer<float, E> pulled(exec, gaussians);
  toy_channel channel{};
  channel.values = v.data(), channel.beyonds = b.data(), channel.gradient = g.data();
  gart::channel_gradient<E> back(exec);
  back.begin(table);
  back.add(channel);
  std::vector<float> got(ids.size());
  exec.copy_out(got.data(), back.by_alpha(), got.size() * sizeof(float));
  for (std::size_t k = 0; k < got.size(); ++k) {
    CAPTURE(k);
    CHECK(std::fabs(double{got[k]} - by_alpha[k]) < 2e-5);
  }
  back.pull(table, channel, static_cast<index_t>(gaussians), pulled.data());
  for (std::size_t i = 0; i < gaussians; ++i) {
    CAPTURE(i);
    CHECK(std::fabs(double{pulled.to_host()[i]} - by_value[i]) < 2e-5);
  }
}
