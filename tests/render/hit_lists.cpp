// Which Gaussians each ray meets, where, and in which order: against the oracle, and one tracer against another.
#include <render/expected.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

using namespace gart_test;

namespace {

// Every hit that rounding cannot undo is there, nothing that rounding cannot make, t and alpha within rounding, and in
// an order that rounding can give. Returns what is wrong, or nothing; `differs` says that the list is not the oracle's.
std::string complaint(std::vector<gart::hit> const& got, oracle::pixel const& p, bool& differs) {
  std::map<gart::u32, oracle::hit const*> listed;
  std::size_t sure = 0;
  std::vector<gart::u32> ids;
  for (auto const& h : p.list) {
    listed[h.id] = &h, sure += h.counted && !h.marginal;
    if (h.counted) ids.push_back(h.id);
  }
  differs = !std::equal(got.begin(), got.end(), ids.begin(), ids.end(),
                        [](auto const& h, gart::u32 id) { return h.id == id; });

  oracle::hit const* farthest = nullptr;  // by t - t_slack
  for (std::size_t i = 0; i < got.size(); ++i) {
    auto const& h = got[i];
    auto const found = listed.find(h.id);
    std::string const who = "hit " + std::to_string(i) + ", Gaussian " + std::to_string(h.id) + ": ";
    if (found == listed.end()) return who + "is no hit, or was reported twice";
    oracle::hit const& o = *found->second;
    listed.erase(found);
    sure -= o.counted && !o.marginal;
    if (!(std::abs(h.t - o.t) <= o.t_slack + 1e-6 * std::abs(o.t)))
      return who + "t is " + std::to_string(h.t) + ", not " + std::to_string(o.t);
    if (!(std::abs(h.alpha - o.alpha) <= (1e-5 + 2 * o.alpha_slack) * o.alpha))
      return who + "alpha is " + std::to_string(h.alpha) + ", not " + std::to_string(o.alpha);
    if (i && !gart::before(got[i - 1].t, got[i - 1].id, h.t, h.id)) return who + "out of order by its own (t, id)";
    if (farthest && farthest->t - farthest->t_slack > o.t + o.t_slack + 1e-6 * std::abs(o.t)) return who + "too late";
    if (farthest && farthest->t == o.t && farthest->id > o.id) return who + "a tie not ordered by id";
    if (!farthest || o.t - o.t_slack >= farthest->t - farthest->t_slack) farthest = &o;
  }
  return sure ? std::to_string(sure) + " hits are missing" : "";
}

}  // namespace

TEST_CASE_TEMPLATE("hit lists agree with the oracle", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  std::size_t rays = 0, different = 0;
  for (auto const& e : expectations()) {
    auto const& s = e.scene;
    CAPTURE(s.name);
    auto options = s.options;
    options.transmittance_min = 0;
    bool const same = s.options.transmittance_min == 0;
    auto const expected = same ? oracle::picture{} : oracle::render(e.parameters, s.view, options, s.active_degree);
    auto const& picture = same ? e.picture : expected;
    auto const got = hit_lists(exec, s.model, s.view, options, tracer_kind::bvh);
    REQUIRE(got.size() == picture.pixels.size());
    for (std::size_t i = 0; i < got.size(); ++i) {
      CAPTURE(i);
      bool differs = false;
      REQUIRE(complaint(got[i], picture.pixels[i], differs) == "");
      if (picture.pixels[i].list.size() < 500) ++rays, different += differs;
    }
  }
  // Ties within rounding are rare but on rays with thousands of hits.
  CAPTURE(different);
  CHECK(different <= 2 + rays / 100);
}

TEST_CASE_TEMPLATE("a ray ends after the hit that brings its transmittance below the threshold", E,
                   GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  for (auto const& e : expectations()) {
    auto const& s = e.scene;
    CAPTURE(s.name);
    auto const got = hit_lists(exec, s.model, s.view, s.options, tracer_kind::bvh);
    for (std::size_t i = 0; i < got.size(); ++i) {
      CAPTURE(i);
      auto const& p = e.picture.pixels[i];
      if (!p.edge) REQUIRE(got[i].size() == p.hits);
    }
  }
}

TEST_CASE_TEMPLATE("all tracers give the same hit lists, bit for bit", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  for (auto const& e : expectations()) {
    auto const& s = e.scene;
    CAPTURE(s.name);
    auto const first = hit_lists(exec, s.model, s.view, s.options, tracer_kind::bvh);
    for (auto kind : tracers<E>()) {
      auto const other = hit_lists(exec, s.model, s.view, s.options, kind);
      REQUIRE(first.size() == other.size());
      for (std::size_t i = 0; i < first.size(); ++i) {
        CAPTURE(i);
        REQUIRE(first[i].size() == other[i].size());
        REQUIRE(
            std::equal(first[i].begin(), first[i].end(), other[i].begin(), [](gart::hit const& a, gart::hit const& b) {
              return a.id == b.id && std::memcmp(&a.t, &b.t, sizeof a.t) == 0 &&
                     std::memcmp(&a.alpha, &b.alpha, sizeof a.alpha) == 0;
            }));
      }
    }
  }
}
