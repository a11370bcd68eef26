// The order of a batch's rays is a Hilbert curve: through the cells of a flat octahedron it goes from each to one
// beside it, from the first to the last.
#include <rays/view_rays.hpp>

#include <algorithm>
#include <cmath>

using namespace gart_test;
using gart::u32;

TEST_CASE_TEMPLATE("rays are ordered along a curve from cell to cell", E, GART_TEST_POLICIES) {
  E exec;
  for (int const side : {2, 16, 64}) {
    CAPTURE(side);
    std::vector<int> cells(static_cast<std::size_t>(side * side));
    for (std::size_t i = 0; i < cells.size(); ++i) cells[i] = static_cast<int>(i);
    std::shuffle(cells.begin(), cells.end(), std::mt19937(5));
    std::vector<float> directions;
    for (int const cell : cells) {
      double const u = 2 * (cell % side + 0.5) / side - 1, v = 2 * (cell / side + 0.5) / side - 1;
      double x = u, y = v;
      double const z = 1 - std::fabs(u) - std::fabs(v);
      if (z < 0) x = std::copysign(1 - std::fabs(v), u), y = std::copysign(1 - std::fabs(u), v);
      double const length = std::sqrt(x * x + y * y + z * z);
      for (double const part : {x, y, z}) directions.push_back(static_cast<float>(part / length));
    }
    batch_memory<E> const batch(exec, {}, {}, directions);
    gart::ray_order<E> order(exec);
    order.make(exec, batch.rays(), {}, {});
    std::vector<u32> places(cells.size());
    exec.copy_out(places.data(), order.of(static_cast<gart::index_t>(cells.size())), sizeof(u32) * places.size());
    long far = 0;
    for (std::size_t i = 1; i < places.size(); ++i) {
      int const a = cells[places[i - 1]], b = cells[places[i]];
      far += std::abs(a % side - b % side) + std::abs(a / side - b / side) != 1;
    }
    CHECK(far == 0);
  }
}
