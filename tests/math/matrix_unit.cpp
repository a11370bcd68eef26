// Products by matrix units against sums in double. They are a device's.
#include <support/policies.hpp>

#if defined(GART_TEST_CUDA)

#include <gart/exec/buffer.hpp>
#include <gart/math/matrix_unit.hpp>

#include <cmath>

namespace {

constexpr int rows = 16, depth = 8, columns = 8;

// d += a b, all row by row.
struct product {
  static constexpr int block_size = 32, min_blocks = 1;
  struct scratch {};
  float const *a, *b;
  float* d;

  template <class Team>
  __device__ void operator()(Team const&) const {
    int const row = threadIdx.x / 4, column = threadIdx.x % 4;
    gart::matrix_part<4> x;
    for (int i = 0; i < 4; ++i) x.set(i, a[(row + i % 2 * 8) * depth + column + i / 2 * 4]);
    gart::matrix_part<2> y;
    for (int i = 0; i < 2; ++i) y.set(i, b[(column + 4 * i) * columns + row]);
    auto const place = [&](int i) { return (row + i / 2 * 8) * columns + 2 * column + i % 2; };
    float sums[4];
    for (int i = 0; i < 4; ++i) sums[i] = d[place(i)];
    gart::multiply_add(sums, x, y);
    for (int i = 0; i < 4; ++i) d[place(i)] = sums[i];
  }
};

}  // namespace

TEST_CASE_TEMPLATE("products by matrix units are as good as those of floats", E, GART_TEST_POLICIES) {
  E exec;
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::normal_distribution<float> normal;
  double worst = 0;
  for (int run = 0; run < 200; ++run) {
    float const scale = std::exp2(static_cast<float>(run % 60 - 30));  // weights of hits span as many orders
    std::vector<float> a(rows * depth), b(depth * columns), d(rows * columns);
    for (float& x : a) x = normal(random);
    for (float& x : b) x = scale * std::exp(4 * normal(random));
    for (float& x : d) x = scale * normal(random);
    gart::buffer<float, E> const on_a(exec, a), on_b(exec, b);
    gart::buffer<float, E> on_d(exec, d);
    gart::parallel_for(exec, "product", gart::tile_range{1, 32}, product{on_a.data(), on_b.data(), on_d.data()});
    std::vector<float> const got = on_d.to_host();
    for (int i = 0; i < rows; ++i)
      for (int j = 0; j < columns; ++j) {
        double sum = d[i * columns + j], sizes = std::fabs(sum);
        for (int k = 0; k < depth; ++k) {
          double const one = double(a[i * depth + k]) * b[k * columns + j];
          sum += one, sizes += std::fabs(one);
        }
        worst = std::max(worst, std::fabs(got[i * columns + j] - sum) / sizes);
      }
  }
  CHECK(worst <= 0x1p-19);
}

#endif
