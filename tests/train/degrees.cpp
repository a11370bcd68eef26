// Bands of spherical harmonics on trial, on the serial policy: what is stored when, what a trial decides, and that
// nothing depends on where a run was interrupted.
#include <support/policies.hpp>

#include <gart/runtime/degree_selection.hpp>
#include <gart/runtime/renderer.hpp>
#include <gart/runtime/session.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>

#include <unistd.h>

namespace {

constexpr int iterations = 600, views = 20;
gart::configuration_request const serial{gart::backend_kind::serial};

gart::configuration_request with_degree(int sh_degree) {
  gart::configuration_request request = serial;
  request.sh_degree = sh_degree;
  return request;
}

struct fixture {
  gart::dataset data;
  gart::gaussian_model start;
  gart::train_options options;
};

// Noisy pictures of a cloud whose colours depend on the direction by band 1, or not at all; the cloud to start from has
// its places and other colours.
fixture make(std::uint64_t seed, float view_dependence) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<float> normal;
  gart::gaussian_model truth;
  truth.resize(60, 1);
  for (auto& x : truth.mean) x = 0.6f * normal(engine);
  for (auto& x : truth.log_scale) x = -1.6f + 0.3f * normal(engine);
  for (auto& x : truth.quaternion) x = normal(engine);
  for (auto& x : truth.opacity) x = 1 + normal(engine);
  for (std::size_t i = 0; i < truth.sh.size(); ++i)
    truth.sh[i] = (i % 12 < 3 ? 0.5f : view_dependence) * normal(engine);

  fixture f;
  auto const renderer = gart::make_renderer(with_degree(1));
  renderer->set_model(truth);
  for (int v = 0; v < views; ++v) {
    gart::dataset_view view;
    view.name = std::to_string(v);
    view.view.width = 20, view.view.height = 16;
    view.view.fx = view.view.fy = 22, view.view.cx = 10, view.view.cy = 8;
    float const angle = 6.2831853f * static_cast<float>(v) / views, c = std::cos(angle), s = std::sin(angle);
    view.view.rotation = gart::mat3(gart::vec3(c, 0, -s), gart::vec3(0, 1, 0), gart::vec3(s, 0, c));
    view.view.position = gart::vec3d(-4.0 * s, 0, -4.0 * c);
    auto const picture = renderer->render(view.view, gart::render_options{});
    view.image = gart::image8(view.view.width, view.view.height, 3);
    for (std::size_t i = 0; i < picture.color.data.size(); ++i) {
      float const noisy = 255 * picture.color.data[i] + 8 * normal(engine);
      view.image.data[i] = static_cast<gart::u8>(std::lround(std::clamp(noisy, 0.0f, 255.0f)));
    }
    f.data.train.push_back(std::move(view));
  }
  f.start = gart::with_sh_degree(gart::with_sh_degree(truth, 0), 3);
  for (auto& x : f.start.opacity) x -= 0.5f;
  f.options.iterations = iterations;
  f.options.densify = gart::densify_kind::none;
  f.options.sh_gain = 0.02f;
  f.options.rates.sh_rest = 1e-3f;  // so that 600 steps are enough to learn a band
  return f;
}

std::unique_ptr<gart::session> session_of(fixture const& f) {
  return gart::make_session(serial, f.options, f.data, &f.start);
}

bool same_bits(gart::gaussian_model const& a, gart::gaussian_model const& b) {
  return a.sh_degree == b.sh_degree && a.mean == b.mean && a.log_scale == b.log_scale && a.quaternion == b.quaternion &&
         a.opacity == b.opacity && a.sh == b.sh;
}

struct scratch_file {
  static inline int made = 0;
  std::filesystem::path path = std::filesystem::temp_directory_path() /
                               ("gart_degrees_" + std::to_string(::getpid()) + "_" + std::to_string(made++) + ".gart");
  ~scratch_file() {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
  }
};

}  // namespace

TEST_CASE("a length that is set moves the trials as one that was known") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  fixture f = make(seed, 0.5f);
  auto const known = session_of(f);
  f.options.iterations = 6 * iterations;
  auto const told = session_of(f);
  told->set_iterations(iterations);
  while (known->steps_done() < iterations) known->step(), told->step();
  REQUIRE_FALSE(known->trials().empty());
  REQUIRE(told->trials().size() == known->trials().size());
  for (std::size_t i = 0; i < known->trials().size(); ++i) {
    CHECK(told->trials()[i].step == known->trials()[i].step);
    CHECK(told->trials()[i].forecast == known->trials()[i].forecast);
  }
  CHECK(same_bits(known->model(), told->model()));

  // One that leaves no room to measure stores every band, and trains on every view.
  auto const brief = session_of(f);
  for (int i = 0; i < 100; ++i) brief->step();
  brief->set_iterations(150);
  while (brief->steps_done() < 150) CHECK_FALSE(brief->step().trial);
  CHECK(brief->trials().empty());
  CHECK(brief->configuration().sh_degree == 3);
}

TEST_CASE("a band has no floats before it is used, and its coming changes no bit of the training") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  fixture f = make(seed, 0.5f);
  auto const growing = session_of(f);
  f.options.held_out = gart::plan_trials(serial, f.options, views).held_out;
  f.options.sh_gain = 0;
  auto const full = session_of(f);
  std::set<std::size_t> floats;
  for (int i = 0; i < 250; ++i) {
    growing->step(), full->step();
    auto const state = growing->state();
    CHECK(state.second.sh.size() == state.scene.sh.size());
    floats.insert(state.scene.sh.size() / state.scene.size());
  }
  CHECK(floats == std::set<std::size_t>{3, 12, 27, 48});
  CHECK(full->configuration().sh_degree == 3);
  CHECK(same_bits(growing->model(), full->model()));
  CHECK(same_bits(growing->state().second, full->state().second));
}

TEST_CASE("a scene without view dependence ends in 14 floats a Gaussian, one with keeps the band it has") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  for (float const dependence : {0.0f, 0.8f}) {
    CAPTURE(dependence);
    fixture f = make(seed, dependence);
    f.options.sh_gain = 0.2f;  // over what two small noisy views make of no gain, up to 0.05 dB; the band's is over 1
    auto const run = session_of(f);
    while (run->steps_done() < iterations) run->step();
    auto const trials = run->trials();
    for (auto const& t : trials) MESSAGE("band ", t.band, ": gain ", t.gain(), " dB, forecast ", t.forecast, " dB");
    auto const model = run->model();
    if (dependence == 0) {
      CHECK(trials.size() == 3);
      CHECK(run->configuration().sh_degree == 0);
      CHECK(model.sh.size() + 11 * model.size() == 14 * model.size());
      auto const state = run->state();
      CHECK(state.first.sh.size() == 3 * model.size());
      scratch_file const file;
      run->save(file.path);
      // Three times 14 floats, the statistic of densification if it were on, and names and counters.
      CHECK(std::filesystem::file_size(file.path) < 3 * 14 * 4 * model.size() + 1500);
    } else {
      CHECK(run->configuration().sh_degree >= 1);
      CHECK(trials.back().kept());
      CHECK(trials.back().band == run->configuration().sh_degree);
    }
    CHECK(model.sh_degree == run->configuration().sh_degree);
  }
}

TEST_CASE("a band goes where its gain is too small and the views agree on it to 0.05 dB or to what was wanted") {
  // Gains of 1, 2 and 6: a mean of 3, squares about it of 14.
  CHECK(gart::gain_error({11, 22, 36}, {10, 20, 30}) == doctest::Approx(std::sqrt(14.0 / 2 / 3)));
  CHECK(gart::gain_error({11, 21}, {10, 20}) == 0);
  gart::band_trial t{1, 300, 20.0, 20.1, -0.2, 0.02};
  t.error = 0.05;
  CHECK_FALSE(t.kept());
  t.error = 0.06;
  CHECK(t.kept());
  t.gain_wanted = 0.1;
  CHECK_FALSE(t.kept());
  t.forecast = 0.1;
  CHECK(t.kept());
}

TEST_CASE("the threshold decides, the scores are those of the views held out, and these are not trained on before") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  fixture f = make(seed, 0.8f);
  f.options.sh_gain = 100;
  auto const held_out = gart::plan_trials(serial, f.options, views).held_out;
  REQUIRE(held_out.size() == 2);
  auto const is_held = [&](std::string const& name) {
    return std::find(held_out.begin(), held_out.end(), std::stoul(name)) != held_out.end();
  };
  auto const run = session_of(f);
  std::set<std::string> before, after;
  int trial_steps = 0;
  std::size_t judged = 0;
  while (run->steps_done() < iterations) {
    int const step = run->steps_done();
    auto const report = run->step();
    (run->configuration().sh_degree == 0 && run->trials().size() == 3 && !report.trial ? after : before)
        .insert(report.view);
    CHECK(report.step == run->steps_done());
    trial_steps += report.trial;
    if (run->trials().size() == judged) {
      CHECK(run->steps_done() == step + (report.trial ? 0 : 1));
      continue;
    }
    ++judged;
    CHECK(run->steps_done() == step + 50);
    // The branch without the band won: its end is where the run is.
    std::vector<double> psnr;
    for (std::size_t const v : held_out) {
      auto const& view = f.data.train[v];
      auto const picture = run->render(view.view, gart::vec3(0.0f)).color;
      auto const bytes = run->render_8bit(view.view, gart::vec3(0.0f));
      REQUIRE(bytes.data.size() == picture.data.size());
      double rounded = 0;
      for (std::size_t i = 0; i < bytes.data.size(); ++i)
        rounded = std::max(rounded, std::abs(255.0 * std::clamp(picture.data[i], 0.0f, 1.0f) - bytes.data[i]));
      CHECK(rounded <= 0.5001);
      double error = 0;
      for (std::size_t i = 0; i < picture.data.size(); ++i) {
        double const d = std::clamp(static_cast<double>(picture.data[i]), 0.0, 1.0) - view.image.data[i] / 255.0;
        error += d * d / static_cast<double>(picture.data.size());
      }
      psnr.push_back(-10 * std::log10(error));
    }
    CHECK(run->trials().back().without == doctest::Approx((psnr[0] + psnr[1]) / 2).epsilon(1e-5));
    CHECK(run->trials().back().error > 0);
    CHECK(run->trials().back().error < 1);
  }
  CHECK(judged == 3);
  CHECK(trial_steps == 3 * 2 * 50);
  CHECK(run->configuration().sh_degree == 0);
  CHECK(std::none_of(before.begin(), before.end(), is_held));
  CHECK(after.size() == views);

  f.options.sh_gain = 1e-6f;
  auto const kept = gart::make_session(with_degree(1), f.options, f.data, &f.start);
  while (kept->steps_done() < iterations) kept->step();
  REQUIRE(kept->trials().size() == 1);
  CHECK(kept->trials()[0].kept());
  CHECK(kept->trials()[0].gain() > 0);
  CHECK(kept->configuration().sh_degree == 1);
}

TEST_CASE("a run resumed while its bands grow, in a trial or after ends with the same bits") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  fixture f = make(seed, 0.3f);
  f.options.densify = gart::densify_kind::mcmc;
  f.options.max_gaussians = 80;
  f.options.mcmc.from = 100;
  // Calls of step: the first trial's branch with the band is calls 300 to 349, the one without 350 to 399.
  std::set<int> const interruptions{90, 300, 320, 370, 420};
  std::map<int, scratch_file> files;
  std::map<int, gart::gaussian_model> models;
  auto const whole = session_of(f);
  for (int calls = 0; whole->steps_done() < iterations; ++calls, whole->step()) {
    if (!interruptions.count(calls)) continue;
    whole->save(files[calls].path);
    models[calls] = whole->model();
  }
  REQUIRE(files.size() == interruptions.size());
  REQUIRE_FALSE(whole->trials().empty());
  for (auto const& [calls, file] : files) {
    CAPTURE(calls);
    CHECK(same_bits(gart::read_checkpoint(file.path).scene, models[calls]));
    auto const resumed = session_of(f);
    resumed->load(file.path);
    CHECK(resumed->steps_done() == (calls < 300 ? calls : calls < 400 ? 300 : resumed->steps_done()));
    while (resumed->steps_done() < iterations) resumed->step();
    CHECK(same_bits(resumed->model(), whole->model()));
    CHECK(resumed->trials().size() == whole->trials().size());
    CHECK(resumed->trials().back().with == whole->trials().back().with);
  }
}

TEST_CASE("coefficients that a model brings along are not lost while bands grow") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  fixture f = make(seed, 0.5f);
  f.start = gart::with_sh_degree(f.start, 3);
  f.start.sh[3 * 4] = 0.25f;  // band 2
  auto const run = session_of(f);
  CHECK(run->configuration().sh_degree == 2);
  CHECK(run->model().sh[3 * 4] == 0.25f);
}
