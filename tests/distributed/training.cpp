// Training on the ranks that there are, held against the trainer of one: bit by bit where sums have a fixed order.
#include <train/capture.hpp>

#include "policy.hpp"

#include <gart/io/file.hpp>
#include <gart/trace/bvh_tracer.hpp>
#include <gart/trace/tile_tracer.hpp>
#include <gart/train/trainer.hpp>

#include <doctest/doctest.h>

#include <unistd.h>

#include <string>
#include <utility>

using namespace gart;

namespace {

using gart_test::every_rank, gart_test::exec_type, gart_test::rank_comm;
using tiles = tile_tracer<exec_type>;
template <class Method, class Comm = self_comm, class Tracer = tiles>
using trainer_of = trainer<exec_type, scene_traits<1>, Tracer, Method, Comm>;
using plain = trainer_of<deterministic_method>;
using shared = trainer_of<deterministic_method, rank_comm>;

// One rank that does all that several do.
struct lone_comm : self_comm {
  static constexpr bool alone = false;
  std::unique_ptr<shared_file> open_file(std::filesystem::path const& path, bool create) {
    return mpi_comm().open_file(path, create);
  }
};

train_options short_run(densify_kind densify) {
  train_options o;
  o.iterations = 300, o.max_gaussians = 230, o.densify = densify, o.background = background_kind::random;
  o.error.from = 40, o.error.every = 20, o.mcmc.from = 40, o.mcmc.every = 20;
  o.error.dead_opacity = o.mcmc.dead_opacity = 0.1f;  // so that some die
  o.adc.from = 40, o.adc.every = 20, o.adc.opacity_reset_every = 90, o.adc.until = 0.9f;
  o.adc.gradient = 2e-6f, o.adc.dense = 0.05f, o.adc.prune_opacity = 0.1f;  // so that some split, some go
  o.shard_block = 8;
  return o;
}

bool same(std::vector<float> const& a, std::vector<float> const& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0);
}
bool same(gaussian_model const& a, gaussian_model const& b) {
  bool equal = a.size() == b.size();
  for_each_array([&](parameter_array const&, auto const& x, auto const& y) { equal = equal && same(x, y); }, a, b);
  return equal;
}

double largest_difference(std::vector<float> const& a, std::vector<float> const& b) {
  double most = 0, size = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    most = std::max(most, std::fabs(double{a[i]} - double{b[i]}));
    size = std::max(size, std::fabs(double{b[i]}));
  }
  return size > 0 ? most / size : most;
}

// The gradients of all ranks' rows, in the order of numbers.
template <class Trainer>
gaussian_model all_gradients(Trainer& run, exec_type& exec, index_t block) {
  return sharded_rows<exec_type, rank_comm>(exec, every_rank(), block).gather_all(run.gradients().to_host());
}

}  // namespace

TEST_CASE("strips give the bits of one rank") {
  exec_type exec = gart_test::make_exec();
  dataset const data = gart_test::capture(exec, 3);
  for (densify_kind const densify : {densify_kind::error, densify_kind::mcmc, densify_kind::adc}) {
    CAPTURE(to_string(densify));
    train_options options = short_run(densify);
    options.dropout = densify == densify_kind::mcmc ? 0 : 0.2f, options.dropout_until = 0.8f;
    options.render.antialias = densify == densify_kind::mcmc ? 0 : 0.3f;
    options.resolution = {0.2f, 0.5f, 1};
    gaussian_model const start = gart_test::cloud(11, 0.5f);
    plain one(exec, options, data, start);
    shared all(exec, options, data, start, every_rank());
    bool rose = false, fell = false;
    index_t count = start.size();
    while (one.steps_done() < options.iterations) {
      step_report const a = one.step(), b = all.step();
      REQUIRE(a.gaussians == b.gaussians);
      rose = rose || a.gaussians > count, fell = fell || a.gaussians < count, count = a.gaussians;
      REQUIRE(a.step == b.step);
      REQUIRE(a.loss == b.loss);
      REQUIRE(a.psnr == b.psnr);
      if (a.step % 50 != 1) continue;
      rendered const x = one.render(data.train[1].view, vec3(0.5f)), y = all.render(data.train[1].view, vec3(0.5f));
      REQUIRE(same(x.color.data, y.color.data));
      REQUIRE(same(x.depth.data, y.depth.data));
      REQUIRE(x.hits.data == y.hits.data);
    }
    if (densify == densify_kind::adc)
      CHECK((rose && fell));
    else
      CHECK(one.model().size() == 230);  // it has grown
    CHECK(same(one.model(), all.model()));
    CHECK(same(one.state().second, all.state().second));
    CHECK(one.state().parts.bytes == all.state().parts.bytes);  // of the densifier
    if (mpi_comm().size() > 1) CHECK(all.sent_bytes() > 0);
  }
}

TEST_CASE("with sums in any order, gradients are as near as rounding") {
  exec_type exec = gart_test::make_exec();
  dataset const data = gart_test::capture(exec, 4);
  train_options const options = short_run(densify_kind::none);
  gaussian_model const start = gart_test::cloud(12, 0.5f);
  auto const check = [&]<class Method, class Tracer>(Method, std::type_identity<Tracer>) {
    trainer_of<Method, self_comm, Tracer> one(exec, options, data, start);
    trainer_of<Method, rank_comm, Tracer> all(exec, options, data, start, every_rank());
    one.step(), all.step();
    gaussian_model const a = all_gradients(all, exec, options.shard_block), b = one.gradients().to_host();
    REQUIRE(a.size() == b.size());
    for_each_array(
        [&](parameter_array const& array, auto const& x, auto const& y) {
          INFO(array.title);
          CHECK(largest_difference(x, y) < 1e-6);
        },
        a, b);
  };
  check(primitive_method(), std::type_identity<tiles>());
  if constexpr (!exec_type::device)  // the same rows by their tracer's rays
    check(pixel_method(), std::type_identity<bvh_tracer<exec_type>>());
}

TEST_CASE("a batch is the mean of its views on any number of ranks") {
  exec_type exec = gart_test::make_exec();
  dataset const data = gart_test::capture(exec, 5);
  train_options options = short_run(densify_kind::none);
  gaussian_model const start = gart_test::cloud(13, 0.5f);
  options.batch = 3;
  shared all(exec, options, data, start, every_rank());
  float const loss = all.step().loss;
  CHECK(all.steps_done() == 3);
  gaussian_model const mean = all_gradients(all, exec, options.shard_block);
  std::vector<gaussian_model> by_view;
  double losses = 0;
  train_options single = options;
  single.batch = 1;
  for (int image = 0; image < 3; ++image) {
    plain one(exec, single, data, start);
    training_state state = one.state();
    state.step = image;
    one.set_state(state);
    losses += double{one.step().loss} / 3;
    by_view.push_back(one.gradients().to_host());
  }
  CHECK(double{loss} == doctest::Approx(losses).epsilon(1e-6));
  for_each_array(
      [&](parameter_array const& array, auto const& got, auto const& a, auto const& b, auto const& c) {
        CAPTURE(array.name);
        std::vector<float> expected(a.size());
        for (std::size_t i = 0; i < a.size(); ++i)
          expected[i] = static_cast<float>((double{a[i]} + double{b[i]} + double{c[i]}) / 3);
        CHECK(largest_difference(got, expected) < 1e-6);
      },
      mean, by_view[0], by_view[1], by_view[2]);

  // With a batch of two, four ranks trace two views of a round in two strips each.
  for (auto const& [densify, batch] : {std::pair{densify_kind::error, 3}, std::pair{densify_kind::mcmc, 3},
                                       std::pair{densify_kind::adc, 3}, std::pair{densify_kind::error, 2}}) {
    CAPTURE(to_string(densify));
    CAPTURE(batch);
    train_options grown = short_run(densify);
    grown.batch = batch, grown.iterations = 150, grown.exposure = true;
    trainer_of<deterministic_method, lone_comm> one(exec, grown, data, start);
    shared many(exec, grown, data, start, every_rank());
    while (many.steps_done() < grown.iterations) REQUIRE(one.step().loss == many.step().loss);
    if (densify != densify_kind::adc) CHECK(many.model().size() == 230);
    CHECK(same(one.model(), many.model()));
    CHECK(one.state().parts.bytes == many.state().parts.bytes);  // exposures, and the densifier
  }
}

TEST_CASE("exposures and poses are learned as by one rank, bit by bit") {
  exec_type exec = gart_test::make_exec();
  dataset data = gart_test::capture(exec, 9);
  data.train[2].view.position.x += 0.05;
  train_options options = short_run(densify_kind::error);
  options.shard_block = 64, options.iterations = 120;  // three blocks
  options.exposure = options.vignetting = options.refine_poses = true, options.dropout = 0.2f;
  options.resolution = {0.2f, 0.5f, 1};
  gaussian_model const start = gart_test::cloud(17, 0.5f);
  for (int const batch : {1, 3}) {
    CAPTURE(batch);
    options.batch = batch;
    trainer_of<deterministic_method, lone_comm> one(exec, options, data, start);
    shared all(exec, options, data, start, every_rank());
    while (all.steps_done() < options.iterations) REQUIRE(one.step().loss == all.step().loss);
    training_state const a = one.state(), b = all.state();
    CHECK(gart_test::doubles(a, "pose") == gart_test::doubles(b, "pose"));
    CHECK(gart_test::doubles(a, "pose/metric") == gart_test::doubles(b, "pose/metric"));
    CHECK(gart_test::words(a, "pose/visits") == gart_test::words(b, "pose/visits"));
    CHECK(same(gart_test::floats(a, "exposure"), gart_test::floats(b, "exposure")));
    CHECK(same(gart_test::floats(a, "vignetting"), gart_test::floats(b, "vignetting")));
    CHECK(gart_test::words(b, "vignetting/visits") == std::vector<u32>{120});
    double moved = 0;
    for (double const x : gart_test::doubles(b, "pose")) moved = std::max(moved, std::fabs(x));
    CHECK(moved > 1e-4);
    CHECK(same(one.model(), all.model()));
    if (batch > 1) continue;
    plain usual(exec, options, data, start);
    while (usual.steps_done() < options.iterations) usual.step();
    CHECK(gart_test::doubles(usual.state(), "pose") == gart_test::doubles(b, "pose"));
    CHECK(same(gart_test::floats(usual.state(), "exposure"), gart_test::floats(b, "exposure")));
    CHECK(same(usual.model(), all.model()));
  }
}

TEST_CASE("depth and lenses are learned as by one rank, bit by bit") {
  exec_type exec = gart_test::make_exec();
  dataset data = gart_test::mapped_capture(exec, 10);
  for (auto& v : data.train) v.view.fx *= 1.02f, v.view.fy *= 1.02f;
  train_options options = short_run(densify_kind::error);
  options.shard_block = 64, options.iterations = 120;  // three blocks
  options.depth_weight = 1, options.refine_lens = options.refine_poses = true;
  options.resolution = {0.2f, 0.5f, 1};
  options.lens.warm_up = 0;
  gaussian_model const start = gart_test::cloud(18, 0.5f);
  using deep = with_depth<deterministic_method>;
  for (int const batch : {1, 3}) {
    CAPTURE(batch);
    options.batch = batch;
    trainer_of<deep, lone_comm> one(exec, options, data, start);
    trainer_of<deep, rank_comm> all(exec, options, data, start, every_rank());
    while (all.steps_done() < options.iterations) REQUIRE(one.step().loss == all.step().loss);
    training_state const a = one.state(), b = all.state();
    CHECK(gart_test::doubles(a, "lens") == gart_test::doubles(b, "lens"));
    CHECK(gart_test::words(a, "lens/visits") == gart_test::words(b, "lens/visits"));
    CHECK(gart_test::doubles(a, "pose") == gart_test::doubles(b, "pose"));
    CHECK(gart_test::doubles(a, "pose/metric") == gart_test::doubles(b, "pose/metric"));
    double changed = 0;
    for (double const x : gart_test::doubles(b, "lens")) changed = std::max(changed, std::fabs(x));
    CHECK(changed > 1e-4);
    CHECK(same(one.model(), all.model()));
    if (batch > 1) continue;
    trainer_of<deep> usual(exec, options, data, start);
    trainer_of<deep> colours(
        exec,
        [&] {
          auto o = options;
          return o.depth_weight = 0, o;
        }(),
        data, start);
    while (usual.steps_done() < options.iterations) usual.step(), colours.step();
    CHECK(gart_test::doubles(usual.state(), "lens") == gart_test::doubles(b, "lens"));
    CHECK(gart_test::doubles(usual.state(), "pose") == gart_test::doubles(b, "pose"));
    CHECK(same(usual.model(), all.model()));
    CHECK(!same(usual.model(), colours.model()));
  }
}

TEST_CASE("a checkpoint continues on any number of ranks") {
  exec_type exec = gart_test::make_exec();
  mpi_comm ranks;
  dataset const data = gart_test::capture(exec, 6);
  train_options const options = short_run(densify_kind::error);
  gaussian_model const start = gart_test::cloud(14, 0.5f);
  std::string const name = "distributed_" + std::to_string(ranks.size()) + "_";
  std::string const by_all = name + "all.gart", by_one = name + std::to_string(ranks.rank()) + ".gart";
  shared all(exec, options, data, start, every_rank());
  plain one(exec, options, data, start);
  while (one.steps_done() < 90) one.step(), all.step();
  all.save(by_all), one.save(by_one);
  auto const bytes = [](std::string const& path) { return read_file(path); };
  CHECK(bytes(by_all) == bytes(by_one));
  shared resumed(exec, options, data, start, every_rank());
  resumed.load(by_one);
  plain alone(exec, options, data, start);
  alone.load(by_all);
  while (one.steps_done() < 150) one.step(), resumed.step(), alone.step();
  CHECK(same(one.model(), resumed.model()));
  CHECK(same(one.model(), alone.model()));
  ranks.barrier();
  ::unlink(by_one.c_str());
  if (ranks.rank() == 0) ::unlink(by_all.c_str());
}

TEST_CASE("more ranks than Gaussians, rows of tiles or views") {
  exec_type exec = gart_test::make_exec();
  dataset data = gart_test::capture(exec, 7);
  train_options options = short_run(densify_kind::none);
  options.shard_block = 1;
  auto const check = [&](gaussian_model const& start, int steps) {
    plain one(exec, options, data, start);
    shared all(exec, options, data, start, every_rank());
    for (int i = 0; i < steps; ++i) REQUIRE(one.step().loss == all.step().loss);
    CHECK(same(one.model(), all.model()));
  };
  gaussian_model two = gart_test::cloud(15, 0.5f);
  for_each_array([](parameter_array const& a, auto& values) { values.resize(2 * a.width(1)); }, two);
  check(two, 20);
  gaussian_model behind = two;  // of all cameras
  for (float& x : behind.mean) x = 1000;
  check(behind, 3);
  gaussian_model none;
  none.resize(0, 1);
  check(none, 3);
  for (auto& view : data.train) {  // a row of tiles, not whole
    view.view.height = 5, view.view.cy = 2.5f;
    view.image.height = 5, view.image.data.resize(static_cast<std::size_t>(view.view.width) * 5 * 3);
  }
  check(gart_test::cloud(16, 0.5f), 5);
}

TEST_CASE("a Gaussian that no view shows takes the bytes told before") {
  constexpr index_t unseen = 40'000;
  int const ranks = mpi_comm().size();
  for (auto const& [batch, antialias] : {std::pair{1, 0.0f}, {ranks, 0.0f}, {1, 0.3f}, {ranks, 0.3f}}) {
    train_options options = short_run(densify_kind::none);
    options.batch = batch, options.hit_memory = 1 << 26, options.render.antialias = antialias;
    auto const peak = [&](index_t more) {
      exec_type exec = gart_test::make_exec();
      dataset const data = gart_test::capture(exec, 4);
      gaussian_model start = gart_test::cloud(11, 0.5f);
      std::size_t const seen = start.size();
      start.resize(seen + more, start.sh_degree);
      for (std::size_t i = seen; i < start.size(); ++i) start.quaternion[4 * i] = 1, start.opacity[i] = -20;
      exec.memory.peak = exec.memory.current;  // the capture's images took more than a rank of many does
      shared run(exec, options, data, start, every_rank());
      return run.step(), run.step(), static_cast<double>(exec.memory.peak);
    };
    double const told = static_cast<double>(bytes_of_gaussian(options, 1, ranks)) * unseen / ranks,
                 taken = peak(unseen) - peak(0);
    CAPTURE(batch);
    CAPTURE(antialias);
    CHECK(taken / told > 0.98);                       // a block more here, and less there
    CHECK(taken / told < (ranks == 1 ? 1.1 : 1.02));  // one rank has its own lists of all
  }
}

TEST_CASE("a run that grows reserves the memory of its end") {
  row_owners const owners{mpi_comm().size(), mpi_comm().rank(), 8};
  for (densify_kind const kind : {densify_kind::error, densify_kind::mcmc}) {
    CAPTURE(static_cast<int>(kind));
    exec_type exec = gart_test::make_exec();
    dataset const data = gart_test::capture(exec, 4);
    train_options const options = short_run(kind);
    shared run(exec, options, data, gart_test::cloud(11, 0.5f), every_rank());
    index_t const end = owners.owned(options.max_gaussians);
    auto const holds = [&](gaussians<exec_type> const& rows) {
      bool exact = true;
      for_each_array(
          [&](parameter_array const& a, auto const& v) { exact = exact && v.capacity() == end * a.width(1); }, rows);
      return exact;
    };
    REQUIRE(run.size() < options.max_gaussians);
    CHECK(holds(run.scene()));
    CHECK(holds(run.gradients()));
    float const* const place = run.scene().sh.data();
    while (run.size() < options.max_gaussians && run.steps_done() < options.iterations) run.step();
    CHECK(run.size() == options.max_gaussians);
    CHECK(run.scene().sh.data() == place);
    CHECK(holds(run.scene()));
    CHECK(holds(run.gradients()));
  }
}

TEST_CASE("what several ranks do not train is refused by field") {
  exec_type exec = gart_test::make_exec();
  dataset const data = gart_test::capture(exec, 8);
  train_options const good = short_run(densify_kind::none);
  auto const refused = [&](train_options options, char const* field) {
    options.batch = std::max(options.batch, 2);
    try {
      shared run(exec, options, data, gart_test::cloud(1, 0.5f), every_rank());
      FAIL("not refused");
    } catch (invalid_argument const& e) {
      CHECK(std::string(e.what()).find(field) != std::string::npos);
    }
  };
  train_options o = good;
  o.refine_poses = true;  // with blocks of 8
  refused(o, "train_options.shard_block");
  o = good, o.depth_weight = 1;  // without its gradients
  refused(o, "train_options.depth_weight");
  o = good, o.shard_block = 0;
  refused(o, "train_options.shard_block");
  o = good, o.batch = -1;
  CHECK_THROWS_AS(shared(exec, o, data, gart_test::cloud(1, 0.5f), every_rank()), invalid_argument);
  o.batch = 2;
  CHECK_THROWS_AS(plain(exec, o, data, gart_test::cloud(1, 0.5f)), invalid_argument);
}
