// How validation runs its trials: on a device in parallel, where memory ends one after another, and never on after one
// has failed. The sessions are fakes of a device that may hold so many at a time.
#include <support/policies.hpp>

#include <gart/runtime/capture_defaults.hpp>
#include <gart/runtime/registry.hpp>
#include <gart/runtime/validation.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <set>
#include <thread>

namespace {

using gart::u64;

constexpr int unlimited = 1000;

// What all fakes share.
struct device {
  std::atomic<int> room{unlimited}, alive{0}, most{0}, made{0}, steps{0}, together{1}, failing{unlimited};
  std::atomic<bool> slow{false};
  std::atomic<float> overfit{0};  // what a trial of more than 2,500 steps loses
  std::mutex guard;
  std::set<std::thread::id> threads;
  std::vector<int> lengths;  // of trials

  void reset(int new_room, int wait_for) {
    room = new_room, together = wait_for, failing = unlimited, slow = false;
    alive = 0, most = 0, made = 0, steps = 0, threads.clear(), lengths.clear();
  }
};
device& the_device() {
  static device d;
  return d;
}

class fake_session : public gart::session {
 public:
  explicit fake_session(gart::train_options const& options) : options_(options), number_(the_device().made++) {
    device& d = the_device();
    int const now = ++d.alive;
    for (int most = d.most; now > most && !d.most.compare_exchange_weak(most, now);) {
    }
    if (now > d.room) {
      --d.alive;
      throw gart::out_of_memory("fake", 1, 0, "a test");
    }
    std::lock_guard const lock(d.guard);
    d.threads.insert(std::this_thread::get_id());
    d.lengths.push_back(options.iterations);
  }
  ~fake_session() override { --the_device().alive; }

  gart::step_report step() override {
    device& d = the_device();
    // The first step waits for the others: trials that do not run in parallel never see them.
    auto const patience = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (done_ == 0 && d.made < d.together && std::chrono::steady_clock::now() < patience) std::this_thread::yield();
    if (number_ == d.failing) throw gart::unsupported("a trial failed");
    if (d.slow) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    ++done_, ++d.steps;
    return {};
  }
  int steps_done() const override { return done_; }
  void set_iterations(int) override {}
  gart::gaussian_model model() const override { return {}; }
  u64 size() const override { return 0; }
  void save_model(std::filesystem::path const&, gart::splat_traits const&) const override {}
  gart::rendered render(gart::camera const& view, gart::vec3) override {
    gart::rendered out;
    out.color = gart::image_float(view.width, view.height, 3);
    // The photographs are grey at 0.5; an exposure helps, vignetting harms.
    float off = options_.exposure ? 0.01f : options_.vignetting ? 0.1f : 0.05f;
    if (options_.iterations > 2500) off += the_device().overfit;
    for (float& v : out.color.data) v = 0.5f + off + 0.0001f * static_cast<float>(view.fx);
    return out;
  }
  gart::image8 render_8bit(gart::camera const&, gart::vec3) override { return {}; }
  void save(std::filesystem::path const&) const override {}
  void load(std::filesystem::path const&) override {}
  gart::training_state state() const override { return {}; }
  void set_state(gart::training_state const&) override {}
  gart::profiler& profile() override { return profile_; }
  std::size_t peak_bytes() const override { return 0; }
  std::size_t hit_buffer_bytes() const override { return 0; }
  gart::configuration_info configuration() const override { return {}; }

 private:
  gart::train_options options_;
  gart::profiler profile_;
  int number_, done_ = 0;
};

// Of lower rank than any other, so that no other test gets it.
bool const registered = [] {
  gart::configuration_info info;
  info.backend = gart::backend_kind::cuda, info.tracer = gart::tracer_kind::own, info.backward = "fake";
  gart::register_configuration({info, -1000, gart::always_available,
                                [](gart::configuration_request const&) { return std::unique_ptr<gart::renderer>(); },
                                [](gart::configuration_request const&, gart::train_options const& options,
                                   gart::dataset const&, gart::start_model const&) -> std::unique_ptr<gart::session> {
                                  return std::make_unique<fake_session>(options);
                                }});
  return true;
}();

gart::configuration_request fake_request() {
  gart::configuration_request request;
  request.backend = gart::backend_kind::cuda, request.tracer = gart::tracer_kind::own, request.backward = "fake";
  return request;
}

gart::dataset grey() {
  gart::dataset data;
  data.extent = 1;
  for (int v = 0; v < 16; ++v) {
    gart::dataset_view view;
    view.name = std::to_string(v);
    view.view.width = view.view.height = 12;
    view.view.fx = view.view.fy = static_cast<float>(10 + v), view.view.cx = view.view.cy = 6;
    view.view.position = gart::vec3d(v, 0, 0);
    view.image = gart::image8(12, 12, 3);
    for (auto& x : view.image.data) x = 128;
    data.train.push_back(std::move(view));
  }
  return data;
}

gart::validation measured(gart::configuration_request const& request, gart::validation_progress const& progress = {}) {
  gart::train_options options;
  options.iterations = 30000, options.random_points = 10;  // long enough for all trials in turn
  return gart::validate(request, options, grey(),
                        {{"exposure", "on", [](gart::train_options& o) { o.exposure = true; }},
                         {"vignetting", "on", [](gart::train_options& o) { o.vignetting = true; }}},
                        progress);
}

void require_verdict(gart::validation const& of) {
  REQUIRE(of.trials.size() == 3);
  CHECK(of.trials[1].gain > 5);
  CHECK(of.trials[2].gain < -3);
  CHECK(of.options.exposure);
  CHECK(!of.options.vignetting);
}

}  // namespace

TEST_CASE("trials on a device run in parallel, one thread each") {
  REQUIRE(registered);
  device& d = the_device();
  d.reset(unlimited, 3);
  auto const parallel = measured(fake_request());
  CHECK(parallel.plan.beside);
  require_verdict(parallel);
  CHECK(d.most == 3);
  CHECK(d.threads.size() == 3);
  CHECK(d.steps == 3 * parallel.plan.steps);
  CHECK(d.alive == 0);

  // With the caller's stream one after another, with the same verdict.
  d.reset(unlimited, 1);
  auto request = fake_request();
  int stream = 0;
  request.stream = &stream;
  auto const in_turn = measured(request);
  CHECK(!in_turn.plan.beside);
  require_verdict(in_turn);
  CHECK(d.most == 1);
  CHECK(d.threads == std::set<std::thread::id>{std::this_thread::get_id()});
  for (std::size_t i = 0; i < 3; ++i) CHECK(in_turn.trials[i].psnr == parallel.trials[i].psnr);
}

TEST_CASE("trials without room in parallel run in turn") {
  device& d = the_device();
  for (int const room : {1, 2}) {
    CAPTURE(room);
    d.reset(room, 3);
    auto const result = measured(fake_request());
    CHECK(!result.plan.beside);
    require_verdict(result);
    CHECK(d.made > 3);  // some were begun twice
    CHECK(d.alive == 0);
  }
  d.reset(0, 1);  // not even one has room
  CHECK_THROWS_AS(measured(fake_request()), gart::out_of_memory);
  CHECK(d.alive == 0);
}

TEST_CASE("a trial that fails in parallel ends the others") {
  device& d = the_device();
  d.reset(unlimited, 3);
  d.failing = 1, d.slow = true;
  CHECK_THROWS_AS(measured(fake_request()), gart::unsupported);
  CHECK(d.alive == 0);
  CHECK(d.steps < 700);  // of two trials of 700 or more each
}

TEST_CASE("progress is told between parallel steps, and may end them") {
  device& d = the_device();
  d.reset(unlimited, 3);
  auto const caller = std::this_thread::get_id();
  bool same_thread = true;
  double last = 0;
  auto const whole = measured(fake_request(), [&](double done, std::string const&) {
    same_thread = same_thread && std::this_thread::get_id() == caller && done >= last;
    last = done;
    return true;
  });
  CHECK(same_thread);
  require_verdict(whole);

  d.reset(unlimited, 3);
  d.slow = true;
  auto const ended = measured(fake_request(), [](double, std::string const&) { return false; });
  CHECK(ended.trials.empty());
  CHECK(!ended.options.exposure);
  CHECK(d.alive == 0);
}

TEST_CASE("a verdict that one noise would not give says why") {
  device& d = the_device();
  gart::train_options options;
  options.iterations = 30000, options.random_points = 10;
  gart::candidate helps{"exposure", "on", [](gart::train_options& o) { o.exposure = true; }};
  gart::candidate harms{"vignetting", "on", [](gart::train_options& o) { o.vignetting = true; }};
  helps.why = "it helps", harms.why = "it harms";
  auto const found = [&] {
    d.reset(unlimited, 3);
    return gart::validate(fake_request(), options, grey(), {helps, harms});
  };
  auto const usual = found();
  CHECK(usual.trials[1].why.empty());
  CHECK(usual.trials[2].why.empty());
  helps.least_noises = 1e6, harms.least_noises = -1e6;
  auto const other = found();
  CHECK(!other.options.exposure);
  CHECK(other.options.vignetting);
  CHECK(other.trials[1].why == "it helps");
  CHECK(other.trials[2].why == "it harms");
}

TEST_CASE("blank and masked photographs decide nothing") {
  device& d = the_device();
  gart::train_options options;
  options.iterations = 30000, options.random_points = 10;
  std::vector<gart::candidate> const candidates{{"exposure", "on", [](gart::train_options& o) { o.exposure = true; }}};
  gart::dataset data = grey();
  auto const found = [&] {
    d.reset(unlimited, 2);
    return gart::validate(fake_request(), options, data, candidates);
  };
  auto const all = found();
  data.train[2].mask = gart::image8(12, 12, 1, 0);  // held out, as 6, 10 and 14 are
  auto const masked = found();
  REQUIRE(masked.trials.size() == 2);
  CHECK(std::isfinite(masked.trials[1].gain));
  CHECK(masked.trials[1].gain == doctest::Approx(all.trials[1].gain).epsilon(0.05));
  // Rendered exactly, its error is none, and its gain from there would be any.
  data.train[2].mask = {};
  for (auto& x : data.train[2].image.data) x = 0;
  data.train[2].view.fx = -5100;  // the fake renders 0 at most
  auto const blank = found();
  CHECK(std::isfinite(blank.trials[1].noise));
  for (gart::trial const& t : blank.trials) CHECK(t.psnr < 59);
  for (std::size_t const i : {2u, 6u, 10u}) data.train[i].mask = gart::image8(12, 12, 1, 0);
  CHECK(found().trials.empty());
}

TEST_CASE("trials have the capture's mirrors, and name a view that is too small") {
  gart::dataset data = grey();
  data.mirrors.meshes.resize(1);
  CHECK(gart::shrunk(data, 2).mirrors.meshes.size() == 1);
  CHECK_THROWS_AS(gart::shrunk(data, 100), gart::invalid_argument);
}

TEST_CASE("a third of the steps is tried last, against a long trial") {
  device& d = the_device();
  gart::train_options options;
  options.random_points = 10;
  auto const length = gart::default_candidates({}, options).back();
  std::vector<gart::candidate> const candidates{{"exposure", "on", [](gart::train_options& o) { o.exposure = true; }},
                                                length};
  for (float const overfit : {-0.005f, -0.0005f, 0.0f, 0.005f}) {
    CAPTURE(overfit);
    d.reset(unlimited, 2);
    d.overfit = overfit;
    auto const found = gart::validate(fake_request(), options, grey(), candidates);
    d.overfit = 0;
    CHECK(found.plan.trials == 4);
    REQUIRE(found.trials.size() == 3);
    CHECK(found.options.exposure);
    CHECK(found.trials[2].setting == "iterations");
    bool const taken = overfit > -0.001f;  // a loss of less than a decibel is none
    CHECK(found.trials[2].taken == taken);
    CHECK(found.options.iterations == (taken ? 10000 : 30000));
    REQUIRE(d.lengths.size() == 4);
    std::sort(d.lengths.begin() + 2, d.lengths.end());
    CHECK(d.lengths == std::vector<int>{found.plan.steps, found.plan.steps, found.plan.steps, 3 * found.plan.steps});
  }
  // Alone, it has no other trial.
  d.reset(unlimited, 2);
  auto const alone = gart::validate(fake_request(), options, grey(), {length});
  CHECK(alone.plan.trials == 2);
  CHECK(alone.trials.size() == 2);
  CHECK(d.lengths.size() == 2);
}
