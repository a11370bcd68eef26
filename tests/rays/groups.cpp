// Rays that eight lanes take each: the same bits as by any other walk, with few hits or with more than there is room
// for, and of rays that end.
#include <rays/view_rays.hpp>

#include <algorithm>

using namespace gart_test;

namespace {

using response = gart::generalized_gaussian<>;

// Rays by groups, on any policy.
template <class E>
gart::traced_rays by_groups(E& exec, gart::gaussians<E> const& scene, gart::ray_tracer<E> const& tracer,
                            gart::ray_batch const& rays, gart::render_options const& options) {
  gart::gaussians_view<float const> const view = scene.view();
  gart::buffer<gart::ray_gaussian, E> records(exec, view.count);
  gart::parallel_for(
      exec, "records", view.count,
      gart::render_kernels::prepare_gaussians<response>{view, rays.frame, options.alpha_min, records.view()});
  target_memory<E> out(exec, rays.count());
  gart::batch_composite<> const program{{},      gart::batch_rays(rays), {view.sh, view.sh_degree, view.sh_degree},
                                        options, out.targets(),          {}};
  gart::trace_kernels::trace_groups<response>(exec, "groups", tracer.index().seen_from(rays.frame),
                                              gart::traced_scene{records.data(), view.count, options.near},
                                              rays.count(), nullptr, nullptr, program);
  return out.to_host();
}

// What rays kept of their hits by place, in the order of the rays. Each hit is there once.
template <class T, class E>
std::vector<T> in_order(gart::hit_runs<E> const& runs, gart::buffer<T, E> const& by_place) {
  auto const rays = runs.rays.to_host(), firsts = runs.firsts.to_host(), counts = runs.counts.to_host();
  auto const places = by_place.to_host();
  std::vector<std::size_t> offsets(1);
  for (gart::u32 const count : counts) offsets.push_back(offsets.back() + count);
  std::vector<T> out(offsets.back());
  std::vector<int> there(out.size());
  for (std::size_t place = 0; place < runs.used.front(); ++place) {
    std::size_t const ray = rays.at(place / gart::hit_run), k = firsts[place / gart::hit_run] + place % gart::hit_run;
    if (k >= counts.at(ray)) continue;
    ++there[offsets[ray] + k], out[offsets[ray] + k] = places[place];
  }
  CHECK(std::count(there.begin(), there.end(), 1) == static_cast<std::ptrdiff_t>(there.size()));
  return out;
}

// What a batch keeps for its gradient, and what it finds for a list, by one of the walks.
struct kept_by_walk {
  std::vector<gart::u32> ids, found_ids;
  std::vector<float> depths, weights, found_t;
};
// Traces programs by one of the walks.
template <class E>
struct walker {
  E& exec;
  gart::ray_tracer<E> const& tracer;
  gart::ray_batch rays;
  gart::traced_scene traced;
  gart::buffer<gart::ray_gaussian, E> records;

  walker(E& on, gart::gaussians<E> const& scene, gart::ray_tracer<E> const& by, gart::ray_batch const& batch,
         gart::render_options const& options)
      : exec(on), tracer(by), rays(batch), records(on, scene.size()) {
    traced = {records.data(), static_cast<gart::index_t>(scene.size()), options.near};
    gart::parallel_for(
        exec, "records", traced.count,
        gart::render_kernels::prepare_gaussians<response>{scene.view(), rays.frame, options.alpha_min, records.view()});
  }
  void walk(bool groups, auto const& program) const {
    gart::world_view const index = tracer.index().seen_from(rays.frame);
    gart::index_t const n = rays.count();
    if (groups)
      gart::trace_kernels::trace_groups<response>(exec, "walk", index, traced, n, nullptr, nullptr, program);
    else
      gart::trace_kernels::trace_alone<response>(exec, "walk", index, traced, n, nullptr, nullptr, program);
  }
};

template <class E>
kept_by_walk kept_by(bool groups, E& exec, gart::gaussians<E> const& scene, gart::ray_tracer<E> const& tracer,
                     gart::ray_batch const& rays, gart::render_options const& options) {
  gart::gaussians_view<float const> const view = scene.view();
  walker<E> const by(exec, scene, tracer, rays, options);
  gart::index_t const n = rays.count();
  constexpr std::size_t room = 1u << 19;
  gart::hit_runs<E> runs(exec);
  gart::buffer<gart::u32, E> ids(exec, room);
  gart::buffer<gart::kept_hit, E> hits(exec, room);
  gart::keep_hits<E> const keep{runs.begin(n, room), ids.data(), hits.data()};
  by.walk(groups, gart::batch_composite<gart::keep_hits<E>>{
                      {}, gart::batch_rays(rays), {view.sh, view.sh_degree, view.sh_degree}, options, {}, keep});
  kept_by_walk out{in_order(runs, ids), {}, {}, {}, {}};
  for (gart::kept_hit const& hit : in_order(runs, hits))
    out.depths.push_back(hit.depth), out.weights.push_back(hit.entry.w);

  using find = gart::batch_find<E>;
  gart::buffer<typename find::taken_hit, E> found(exec, room);
  gart::run_writer<E> const writer = runs.begin(n, room);
  gart::hit_writer counting{options.transmittance_min, options.max_hits};
  counting.counts = writer.counts;
  by.walk(groups, find{{}, {{}, gart::batch_rays(rays), counting}, writer, found.data()});
  for (auto const& hit : in_order(runs, found)) out.found_ids.push_back(hit.id), out.found_t.push_back(hit.t);
  return out;
}

}  // namespace

TEST_CASE_TEMPLATE("eight lanes a ray see the same as one", E, GART_TEST_POLICIES) {
  E exec;
  gart::render_options options;
  // Of 20000 all but transparent Gaussians a ray hits hundreds: more than wait at a time.
  for (bool const many : {false, true}) {
    CAPTURE(many);
    auto model = cloud(5, 2, many ? 20000 : 2000);
    if (many)
      for (float& x : model.opacity) x = -4.5f;
    gart::gaussians<E> const scene(exec, model);
    gart::ray_tracer<E> tracer(exec);
    tracer.set_scene(scene.view(), 2);
    random_rays const rays(7, many ? 203 : 999, 2.0f);
    std::vector<float> ends;
    for (std::size_t i = 0; i < rays.directions.size() / 3; ++i) ends.push_back(0.5f + static_cast<float>(i % 9));
    for (bool const ended : {false, true}) {
      CAPTURE(ended);
      batch_memory<E> const batch(exec, {0.2, 0.1, -0.3}, rays.origins, rays.directions,
                                  ended ? ends : std::vector<float>{});
      auto const wanted = trace_all(exec, tracer, batch.rays(), options);
      CHECK(same(by_groups(exec, scene, tracer, batch.rays(), options), wanted));
      CHECK(*std::max_element(wanted.hits.begin(), wanted.hits.end()) > (many ? 200 : 24));
      kept_by_walk const kept = kept_by(true, exec, scene, tracer, batch.rays(), options);
      kept_by_walk const alone = kept_by(false, exec, scene, tracer, batch.rays(), options);
      CHECK(kept.ids == alone.ids);
      CHECK(kept.depths == alone.depths);
      CHECK(kept.weights == alone.weights);
      CHECK(kept.found_ids == kept.ids);
      CHECK(alone.found_ids == kept.ids);
      CHECK(kept.found_t == alone.found_t);
      CHECK(kept.ids.size() > 2000);
    }
  }
}

TEST_CASE_TEMPLATE("eight lanes a ray meet boxes that all overlap", E, GART_TEST_POLICIES) {
  E exec;
  auto model = cloud(3, 0, 6000);
  for (float& x : model.log_scale) x += 3;
  for (float& x : model.opacity) x = -5;
  gart::gaussians<E> const scene(exec, model);
  gart::ray_tracer<E> tracer(exec);
  tracer.set_scene(scene.view(), 0);
  random_rays const rays(9, 41, 0.2f);
  batch_memory<E> const batch(exec, {}, rays.origins, rays.directions);
  auto const wanted = trace_all(exec, tracer, batch.rays(), {});
  CHECK(same(by_groups(exec, scene, tracer, batch.rays(), {}), wanted));
  CHECK(*std::max_element(wanted.hits.begin(), wanted.hits.end()) > 500);
}

TEST_CASE_TEMPLATE("lists are the same where one walk makes them, and where there is too little room for that", E,
                   GART_TEST_POLICIES) {
  E exec;
  gart::gaussians<E> const scene(exec, cloud(5, 2, 2000));
  random_rays const rays(11, 999, 2.0f);
  batch_memory<E> const batch(exec, {}, rays.origins, rays.directions);
  gart::render_options two_hits;
  two_hits.max_hits = 2;
  auto const list = [&](gart::ray_tracer<E>& tracer, gart::render_options const& options) {
    return tracer.list(batch.rays(), options).to_host();
  };
  auto const equal = [](gart::hit_lists const& a, gart::hit_lists const& b) {
    return a.offsets == b.offsets && a.ids == b.ids && a.t == b.t && a.alpha == b.alpha && a.weight == b.weight;
  };
  gart::ray_tracer<E> tracer(exec), fresh(exec);
  tracer.set_scene(scene.view(), 2), fresh.set_scene(scene.view(), 2);
  gart::hit_lists const in_two_walks = list(tracer, {});
  CHECK(in_two_walks.ids.size() > 10 * 999);
  CHECK(equal(list(tracer, {}), in_two_walks));  // there is room now
  gart::hit_lists const few = list(tracer, two_hits);
  CHECK(equal(few, list(fresh, two_hits)));
  CHECK(equal(list(tracer, {}), in_two_walks));  // too little
  CHECK(equal(list(tracer, {}), in_two_walks));

  // With what is differentiated.
  walker<E> const by(exec, scene, tracer, batch.rays(), {});
  gart::batch_lists<E> lists(exec);
  gart::hit_table<E> tables[2] = {gart::hit_table<E>(exec), gart::hit_table<E>(exec)};
  for (gart::hit_table<E>& table : tables)
    lists(exec, table, batch.rays(), {}, true, [&](char const*, auto const& program) { by.walk(true, program); });
  CHECK(equal(tables[1].to_host(), in_two_walks));
  CHECK(tables[0].rays.to_host() == tables[1].rays.to_host());
  auto const lines = tables[0].lines.to_host(), again = tables[1].lines.to_host();
  CHECK(lines.size() == 999);
  for (std::size_t i = 0; i < lines.size(); i += 99) {
    CHECK(lines[i].origin == again[i].origin);
    CHECK(lines[i].direction == again[i].direction);
  }
}
