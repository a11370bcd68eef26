// The hits that wait for a packet's rays, against a sorted list for each ray: ties, gaps, and the ends of the room.
#include <gart/trace/packet_rows.hpp>
#include <support/policies.hpp>

#include <algorithm>
#include <array>
#include <random>
#include <vector>

namespace {

using gart::lane_count;
using gart::lanes;
using gart::u32;
using rows = gart::packet_rows<std::array<lanes, 3>>;

constexpr u32 every = (1u << lane_count) - 1;

// What is kept of a hit, to be found again.
float kept(u32 id, int lane, int which) { return static_cast<float>(id * 100 + static_cast<u32>(4 * lane + which)); }

bool insert(rows& waiting, lanes t, u32 rays, u32 id) {
  return waiting.insert(t, gart::lanes_of(rays), id, [&](auto& hits) {
    for (int l = 0; l < lane_count; ++l) {
      hits.alpha.v[l] = kept(id, l, 0);
      for (int k = 0; k < 3; ++k) hits.shown[static_cast<std::size_t>(k)].v[l] = kept(id, l, 1 + k);
      hits.places[l] = id;
    }
  });
}

struct hit {
  float t;
  u32 id;
  bool operator<(hit const& b) const { return t < b.t || (t == b.t && id < b.id); }
};

}  // namespace

TEST_CASE("packet rows: the nearest hits of each ray, in order") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  auto const below = [&](u32 n) { return static_cast<u32>(random() % n); };
  std::vector<rows> memory(1);
  rows& waiting = memory[0];
  for (int trial = 0; trial < 40; ++trial) {
    waiting.clear();
    std::vector<hit> expected[lane_count];
    std::vector<u32> ids(900);
    for (u32 i = 0; i < ids.size(); ++i) ids[i] = i;
    std::shuffle(ids.begin(), ids.end(), random);
    u32 const distances = trial % 2 ? 5 : 100'000;  // few: many ties
    long wrong = 0;
    for (std::size_t next = 0; next < ids.size() || waiting.size() > 0;) {
      u32 const rays = static_cast<u32>(random()) & every;
      if (next < ids.size() && rays && waiting.size() < 200 && below(3)) {
        lanes t;
        for (int l = 0; l < lane_count; ++l) {
          t.v[l] = static_cast<float>(1 + below(distances));
          if (rays >> l & 1) expected[l].push_back({t.v[l], ids[next]});
          std::sort(expected[l].begin(), expected[l].end());
        }
        REQUIRE(insert(waiting, t, rays, ids[next++]));
        continue;
      }
      if (waiting.size() == 0) continue;
      u32 const filled = gart::bits_of(waiting.filled()),
                now = filled & (below(4) ? static_cast<u32>(random()) : every);
      REQUIRE(filled != 0);
      if (!now) continue;
      auto const nearest = waiting.nearest();
      auto const rest = waiting.nearest_hits(gart::lanes_of(now));
      for (int l = 0; l < lane_count; ++l) {
        wrong += expected[l].empty() == (filled >> l & 1);
        if (!(now >> l & 1)) continue;
        hit const h = expected[l].front();
        wrong += nearest.v[l] != h.t || rest.alpha.v[l] != kept(h.id, l, 0) || rest.places[l] != h.id;
        for (int k = 0; k < 3; ++k) wrong += rest.shown[static_cast<std::size_t>(k)].v[l] != kept(h.id, l, 1 + k);
        expected[l].erase(expected[l].begin());
      }
      waiting.pop(gart::lanes_of(now));
      if (u32 const ended = below(4) ? 0 : 1u << below(lane_count)) {
        waiting.empty(gart::lanes_of(ended));
        for (int l = 0; l < lane_count; ++l)
          if (ended >> l & 1) expected[l].clear();
      }
      std::size_t most = 0;
      for (auto const& e : expected) most = std::max(most, e.size());
      wrong += static_cast<std::size_t>(waiting.size()) != most;
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("packet rows: no room is told, and nothing is lost before") {
  std::vector<rows> memory(1);
  rows& waiting = memory[0];
  auto const taken = [&](auto rays_of) {
    waiting.clear();
    u32 n = 0;
    while (n < 5000 && insert(waiting, lanes(static_cast<float>(1 + n)), rays_of(n), n)) ++n;
    return n;
  };
  CHECK(taken([](u32) { return 1u; }) == 256);
  CHECK(taken([](u32) { return every; }) == 256);
  CHECK(taken([](u32 n) { return 1u << n % lane_count; }) == 1024);
  for (u32 n = 0; n < 1024 / lane_count; ++n) {
    auto const rest = waiting.nearest_hits(waiting.filled());
    for (int l = 0; l < lane_count; ++l) CHECK(rest.places[l] == n * lane_count + static_cast<u32>(l));
    waiting.pop(waiting.filled());
  }
  CHECK(waiting.size() == 0);
}
