// Who has which Gaussian, and who traces which part of an image, against counting one by one.
#include <doctest/doctest.h>

#include <gart/comm/row_owners.hpp>
#include <gart/shard/image_strips.hpp>
#include <gart/shard/view_costs.hpp>
#include <gart/shard/work_units.hpp>

#include <algorithm>
#include <cstring>
#include <random>
#include <vector>

using namespace gart;

TEST_CASE("every Gaussian has one owner and one row, in order") {
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

TEST_CASE("view costs are steps between rows, remembered by name") {
  std::mt19937_64 engine(6);
  std::vector<camera> views(3);
  for (camera& view : views) view.width = 8, view.height = 1 + static_cast<int>(engine() % 40);
  std::vector<std::vector<u64>> expected;
  std::vector<u64> steps;
  for (camera const& view : views) {
    auto& cost = expected.emplace_back(static_cast<std::size_t>((view.height + 7) / 8));
    u64 above = 0;
    for (u64& c : cost) c = engine() % 100, steps.push_back(c - above), above = c;
    steps.push_back(u64{0} - above);
  }
  CHECK(view_costs<8>::count(views) == steps.size());
  CHECK(view_costs<8>::by_view(views, steps) == expected);

  view_costs<8> known;
  CHECK(!known.knows({}));
  CHECK(!known.knows({4, 9, 2}));
  known.remember({4, 9, 2}, expected);
  CHECK(known.knows({2, 4}));
  CHECK(!known.knows({2, 5}));
  CHECK(known.of({2, 4}) == std::vector{expected[2], expected[0]});
  CHECK(!known.knows({}));
}

TEST_CASE("each rank gets the rows that it reads from their owner") {
  std::mt19937_64 engine(7);
  for (int trial = 0; trial < 200; ++trial) {
    int const ranks = 1 + static_cast<int>(engine() % 6),
              views = 1 + static_cast<int>(engine() % static_cast<u64>(ranks)),
              height = 1 + static_cast<int>(engine() % 60), halo = static_cast<int>(engine() % 30);
    std::vector<std::vector<u64>> costs(static_cast<std::size_t>(views));
    for (auto& cost : costs) {
      cost.resize(static_cast<std::size_t>((height + 7) / 8));
      for (u64& c : cost) c = engine() % 5;
    }
    auto const units = divide_work(costs, ranks, 8);
    auto const has = [&](work_unit const& u) { return rows_in(u, height); };
    auto const reads = [&](work_unit const& u) {
      image_rows const mine = has(u);
      return mine.empty() ? mine : image_rows{std::max(mine.first - halo, 0), std::min(mine.end + halo, height)};
    };
    // What each has: of its own rows the view's numbers, else none.
    std::vector<std::vector<int>> arrays(units.size());
    std::vector<strip_messages> messages;
    for (std::size_t r = 0; r < units.size(); ++r) {
      for (int y = 0; y < height; ++y) arrays[r].push_back(has(units[r]).contains(y) ? 100 * units[r].view + y : -1);
      messages.push_back({units, static_cast<int>(r)}), messages[r].add(arrays[r].data(), sizeof(int), has, reads);
    }
    for (std::size_t r = 0; r < units.size(); ++r) {
      u64 bytes = 0;
      for (message const& sent : messages[r].sends) {
        auto& there = messages[static_cast<std::size_t>(sent.rank)].receives;
        auto const taken = std::find_if(there.begin(), there.end(),
                                        [&](message const& m) { return m.rank == static_cast<int>(r) && m.bytes; });
        REQUIRE(taken != there.end());
        REQUIRE(taken->bytes == sent.bytes);
        std::memcpy(taken->data, sent.data, sent.bytes), bytes += sent.bytes, taken->bytes = 0;
      }
      CHECK(messages[r].bytes == bytes);
    }
    for (std::size_t r = 0; r < units.size(); ++r) {
      for (message const& m : messages[r].receives) REQUIRE(m.bytes == 0);  // nobody waits for what nobody sends
      for (int y = 0; y < height; ++y)
        if (reads(units[r]).contains(y)) REQUIRE(arrays[r][static_cast<std::size_t>(y)] == 100 * units[r].view + y);
    }
  }
}
