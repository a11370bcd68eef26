// Hit lists on real captures, one tracer and one policy against another: the starting models of a COLMAP capture and of
// one with a distorted lens, seen by their own cameras.
#include <gart/exec/parallel.hpp>  // the serial policy beside the one under test

#include <render/expected.hpp>

#include <gart/io/dataset.hpp>
#include <gart/runtime/initial.hpp>

#include <filesystem>
#include <set>
#include <tuple>

using namespace gart_test;

namespace {

std::filesystem::path data_folder() {
  if (char const* folder = std::getenv("GART_DATA")) return folder;
  return std::filesystem::path(GART_SOURCE_DIR) / ".." / "shared" / "data";
}

struct capture {
  std::string name;
  gart::gaussian_model model;
  gart::camera view;
};

// The starting model and a camera of each capture that is there.
std::vector<capture> captures() {
  std::vector<capture> found;
  for (char const* name : {"tandt_train", "fox"}) {
    auto const folder = data_folder() / name;
    if (!std::filesystem::exists(folder)) {
      MESSAGE("skipped: " << folder.string() << " is not there");
      continue;
    }
    gart::dataset_options reading;
    reading.load_images = false;
    gart::dataset const data = gart::load_dataset(folder, reading);
    gart::train_options options;
    gart::camera const& full = data.train[data.train.size() / 2].view;
    found.push_back(
        {name, gart::initial_model(data, options, 0), gart::resized(full, full.width / 8, full.height / 8)});
  }
  return found;
}

struct comparison {
  std::size_t hits = 0;       // of both, each counted once where they agree
  std::size_t different = 0;  // in one and not, with the same bits, in the other
};

using lists = std::vector<std::vector<gart::hit>>;

comparison compare(lists const& a, lists const& b) {
  REQUIRE(a.size() == b.size());
  auto const less = [](gart::hit const& x, gart::hit const& y) {
    return std::tuple(x.id, gart::float_to_bits(x.t), gart::float_to_bits(x.alpha)) <
           std::tuple(y.id, gart::float_to_bits(y.t), gart::float_to_bits(y.alpha));
  };
  comparison result;
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::set<gart::hit, decltype(less)> only_b(b[i].begin(), b[i].end(), less);
    std::size_t only_a = 0;
    for (gart::hit const& h : a[i]) only_a += only_b.erase(h) == 0;
    result.hits += a[i].size() + only_b.size();
    result.different += only_a + only_b.size();
  }
  return result;
}

}  // namespace

TEST_CASE_TEMPLATE("all tracers give the same hit lists on real captures", E, GART_TEST_POLICIES) {
  for (capture const& c : captures()) {
    CAPTURE(c.name);
    E exec;
    gart::render_options const render;
    lists const first = hit_lists(exec, c.model, c.view, render, tracer_kind::bvh);
    for (auto const kind : tracers<E>()) {
      comparison const found = compare(first, hit_lists(exec, c.model, c.view, render, kind));
      CHECK(found.hits > first.size());
      CHECK(found.different == 0);
    }
  }
}

// Between policies a hit may differ where rounding decides: fewer than one in a million.
TEST_CASE_TEMPLATE("every policy has the serial one's hits on real captures", E, GART_TEST_POLICIES) {
  for (capture const& c : captures()) {
    CAPTURE(c.name);
    E exec;
    gart::serial_exec serial;
    gart::render_options const render;
    comparison const found = compare(hit_lists(serial, c.model, c.view, render, tracer_kind::tiles),
                                     hit_lists(exec, c.model, c.view, render, tracer_kind::tiles));
    MESSAGE(c.name << ", " << std::string(E::name) << " against serial: " << found.different << " of " << found.hits
                   << " hits differ");
    CHECK(found.different * 1'000'000 <= found.hits);
  }
}
