#include "depth_search.hpp"

#include <gart/optim/random.hpp>
#include <gart/runtime/matched_points.hpp>

#include <algorithm>
#include <cmath>

#if defined(_OPENMP)
#include <omp.h>
#endif

namespace gart {

namespace {

using namespace matching;

bool is_first_thread() {
#if defined(_OPENMP)
  return omp_get_thread_num() == 0;
#else
  return true;
#endif
}

// f(i) for each photograph, on all cores.
template <class F>
void for_each_of(std::size_t count, F const& f) {
#if defined(_OPENMP)
#pragma omp parallel for schedule(dynamic)
#endif
  for (std::size_t i = 0; i < count; ++i) f(i);
}

void add_point(point_cloud& to, photograph const& of, image8 const& image, int x, int y, float inverse_depth) {
  float const u = static_cast<float>(x) + 0.5f, v = static_cast<float>(y) + 0.5f;
  vec3d const position = of.position + vec3d(of.rotation * (of.slopes(u, v) / inverse_depth));
  point2 const taken = of.taken_at(u, v);
  int const column = std::clamp(static_cast<int>(taken.x), 0, image.width - 1);
  int const row = std::clamp(static_cast<int>(taken.y), 0, image.height - 1);
  for (int c = 0; c < 3; ++c) {
    to.position.push_back(static_cast<float>(position[c]));
    to.color.push_back(image.at(column, row, image.channels >= 3 ? c : 0));
  }
}

}  // namespace

point_cloud match_photographs(dataset const& data, index_t pixels, u64 seed, matching_progress const& progress) {
  std::size_t const views = data.train.size();
  std::vector<photograph> all(views);
  for_each_of(views, [&](std::size_t i) { all[i] = photograph(data.train[i]); });
  std::vector<depth_search> searches;
  for (std::size_t i = 0; i < views; ++i) searches.emplace_back(all, static_cast<u32>(i), data.extent);
  std::vector<point_cloud> found(views);
  std::size_t done = 0;
  for_each_of(views, [&](std::size_t i) {
    photograph const& p = all[i];
    std::size_t const own = pixels * (i + 1) / views - pixels * i / views;
    random_source const source{seed, static_cast<u32>(i), random_use::user};
    for (std::size_t k = 0; k < own && !p.empty(); ++k) {
      auto const w = source.words(k);
      int const x = static_cast<int>(uniform(w.v[0]) * static_cast<float>(p.width));
      int const y = static_cast<int>(uniform(w.v[1]) * static_cast<float>(p.height));
      if (!p.has(x, y, patch_radius)) continue;
      if (auto const inverse_depth = searches[i].find(x, y))
        add_point(found[i], p, data.train[i].image, x, y, *inverse_depth);
    }
    std::size_t finished = 0;
#if defined(_OPENMP)
#pragma omp atomic capture
#endif
    finished = ++done;
    if (progress && is_first_thread()) progress(static_cast<double>(finished) / static_cast<double>(views));
  });
  point_cloud out;
  for (point_cloud const& of : found) {
    out.position.insert(out.position.end(), of.position.begin(), of.position.end());
    out.color.insert(out.color.end(), of.color.begin(), of.color.end());
  }
  return out;
}

}  // namespace gart
