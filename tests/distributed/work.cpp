// Who has which Gaussian, and who traces which part of an image, against counting one by one.
#include <doctest/doctest.h>

#include <gart/comm/row_owners.hpp>
#include <gart/shard/work_units.hpp>

#include <random>
#include <vector>

using namespace gart;

TEST_CASE("every Gaussian has one owner and one row there, in the order of numbers") {
  for (int ranks = 1; ranks <= 7; ++ranks)
    for (index_t const block : {1u, 3u, 16u})
      for (u64 total = 0; total < 200; total += 7) {
        std::vector<index_t> rows(static_cast<std::size_t>(ranks));  // dealt out so far
        for (u64 g = 0; g < total; ++g) {
          row_owners const any{ranks, 0, block};
          int const owner = any.owner(g);
          REQUIRE(owner == static_cast<int>(g / block) % ranks);
          row_owners const there{ranks, owner, block};
          REQUIRE(there.owns(g));
          REQUIRE(there.local(g) == rows[static_cast<std::size_t>(owner)]++);
          REQUIRE(there.global(there.local(g)) == g);
        }
        for (int r = 0; r < ranks; ++r)
          REQUIRE(row_owners{ranks, r, block}.owned(total) == rows[static_cast<std::size_t>(r)]);
      }
  // Past 32 bits.
  row_owners const last{5, 3, 4096};
  u64 const g = (u64{4096} * 5) * 1000000 + 3 * 4096 + 17;
  CHECK(g > (u64{1} << 34));
  CHECK(last.owns(g));
  CHECK(last.local(g) == 4096u * 1000000u + 17);
  CHECK(last.global(last.local(g)) == g);
}

TEST_CASE("ranks share the views of a round, and strips their costs") {
  std::mt19937_64 engine(5);
  for (int trial = 0; trial < 300; ++trial) {
    int const ranks = 1 + static_cast<int>(engine() % 9),
              views = 1 + static_cast<int>(engine() % static_cast<u64>(ranks));
    std::vector<std::vector<u64>> costs(static_cast<std::size_t>(views));
    for (auto& cost : costs) {
      cost.resize(engine() % 30);
      for (auto& c : cost) c = trial % 5 == 0 ? 0 : engine() % 1000;
    }
    auto const units = divide_work(costs, ranks, 8);
    REQUIRE(units.size() == static_cast<std::size_t>(ranks));
    std::size_t rank = 0;
    for (int v = 0; v < views; ++v) {
      auto const& cost = costs[static_cast<std::size_t>(v)];
      u64 total = 0, largest = 0;
      for (u64 const c : cost) total += c, largest = std::max(largest, c);
      std::size_t const first = rank;
      int row = 0;
      for (; rank < units.size() && units[rank].view == v; ++rank) {
        auto const& u = units[rank];
        REQUIRE(u.first == row);
        REQUIRE(u.end >= u.first);
        REQUIRE(u.rows.first == 8 * u.first);
        REQUIRE(u.rows.end == 8 * u.end);
        row = u.end;
      }
      REQUIRE(row == static_cast<int>(cost.size()));
      u64 const parts = rank - first;
      REQUIRE(parts >= 1);
      for (std::size_t r = first; r < rank; ++r) {  // no strip is further from its share than a row's cost
        u64 sum = 0;
        for (int y = units[r].first; y < units[r].end; ++y) sum += cost[static_cast<std::size_t>(y)];
        REQUIRE(sum <= total / parts + largest + parts);
      }
    }
    REQUIRE(rank == units.size());
  }
  CHECK_THROWS_AS(divide_work({}, 2, 8), invalid_argument);
  CHECK_THROWS_AS(divide_work({{1}, {1}, {1}}, 2, 8), invalid_argument);
}
