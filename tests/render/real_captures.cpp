// All tracers give the same hit lists on real captures: the starting models of a COLMAP capture and of one with a
// distorted lens, seen by their own cameras.
#include <support/policies.hpp>
#include <support/trace_scene.hpp>

#include <gart/io/dataset.hpp>
#include <gart/train/initial.hpp>

#include <cstring>
#include <filesystem>

using namespace gart_test;

namespace {

std::filesystem::path data_folder() {
  if (char const* folder = std::getenv("GART_DATA")) return folder;
  return std::filesystem::path(GART_SOURCE_DIR) / ".." / "shared" / "data";
}

std::size_t compare(std::vector<std::vector<gart::hit>> const& a, std::vector<std::vector<gart::hit>> const& b) {
  REQUIRE(a.size() == b.size());
  std::size_t hits = 0, different = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    hits += a[i].size();
    different += a[i].size() != b[i].size() ||
                 (!a[i].empty() && std::memcmp(a[i].data(), b[i].data(), a[i].size() * sizeof(gart::hit)) != 0);
  }
  CHECK(different == 0);
  return hits;
}

}  // namespace

TEST_CASE("all tracers give the same hit lists on real captures, bit for bit") {
  for (char const* name : {"tandt_train", "fox"}) {
    CAPTURE(name);
    auto const folder = data_folder() / name;
    if (!std::filesystem::exists(folder)) {
      MESSAGE("skipped: " << folder.string() << " is not there");
      continue;
    }
    gart::dataset_options reading;
    reading.load_images = false;
    gart::dataset const data = gart::load_dataset(folder, reading);
    gart::train_options options;
    options.sh_degree = 0;
    gart::gaussian_model const model = gart::initial_model(data, options);
    gart::camera const& full = data.train[data.train.size() / 2].view;
    gart::camera const view = gart::resized(full, full.width / 8, full.height / 8);
    gart::openmp_exec exec;
    gart::render_options const render;
    auto const lists = hit_lists(exec, model, view, render, tracer_kind::bvh);
    std::size_t const hits = compare(lists, hit_lists(exec, model, view, render, tracer_kind::tiles));
    CHECK(hits > lists.size());
#if defined(GART_WITH_EMBREE)
    compare(lists, hit_lists(exec, model, view, render, tracer_kind::embree));
#endif
    gart::serial_exec serial;
    compare(lists, hit_lists(serial, model, view, render, tracer_kind::bvh));
  }
}
