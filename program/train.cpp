#include "choices.hpp"
#include "commands.hpp"
#include "history.hpp"
#include "interrupt.hpp"
#include "output.hpp"
#include "process_memory.hpp"
#include "progress.hpp"
#include "report.hpp"
#include "run_folder.hpp"
#include "scores.hpp"
#include "train_arguments.hpp"

#include <gart/io/exposure_file.hpp>
#include <gart/io/file.hpp>
#include <gart/io/image_file.hpp>
#include <gart/io/ply.hpp>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>

namespace gart_cli {

namespace {

namespace fs = std::filesystem;

// Timing each launch slows a step a little: one step in so many is timed.
constexpr int profile_every = 16;

class stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(clock::now() - start_).count(); }

 private:
  using clock = std::chrono::steady_clock;
  clock::time_point start_ = clock::now();
};

// The running means that the progress line shows.
struct recent_steps {
  double loss = 0, psnr = 0, seconds = 0;
  void add(gart::step_report const& report, double step_seconds) {
    double const keep = count_ < 50 ? count_ / (count_ + 1.0) : 0.98;
    ++count_;
    loss = keep * loss + (1 - keep) * report.loss;
    psnr = keep * psnr + (1 - keep) * report.psnr;
    seconds = keep * seconds + (1 - keep) * step_seconds;
  }

 private:
  int count_ = 0;
};

class training_run {
 public:
  explicit training_run(train_arguments& a) : a_(a), say_(a.quiet), course_(course_of(a)) {}

  int run() {
    prepare();
    std::optional<interrupt_guard> interrupt(std::in_place);  // until a run that it stops is saved
    bool const finished = train(*interrupt);
    stopwatch const saving;
    save();
    save_seconds_ += saving.seconds();
    if (!finished) {
      say_.note("Stopped after step " + with_commas(static_cast<std::uint64_t>(session_->steps_done())) + ". Saved " +
                a_.checkpoint_file().string() + " and " + a_.model_file().string() +
                ".\nContinue with: gart train --resume --out " + a_.out.string());
      return exit_interrupted;
    }
    interrupt.reset();  // all is saved, and --resume concludes anew: Ctrl-C may end it at once
    conclude();
    return 0;
  }

 private:
  void prepare() {
    use_threads(a_.threads);
    stopwatch const loading;
    if (fs::is_directory(a_.out)) enter();
    if (a_.resume) continue_run(a_);
    if (a_.dataset.empty()) throw usage_error("DATASET is missing (see gart train --help)");
    row_ = gart::resolve(configuration_request_of(a_));  // what is not there is known before images are read
    course_ = course_of(a_);
    load();
    chosen_ = choose(a_, data_);
    row_ = gart::resolve(configuration_request_of(a_));
    a_.backend = row_.backend, a_.tracer = row_.tracer, a_.backward = row_.backward;
    a_.lt_format = row_.lt_format, a_.tile_size = row_.tile_size, a_.window = row_.window;
    for (auto& choice : chosen_) {
      if (choice["option"] == "--tracer") choice["value"] = a_.tracer;
      if (choice["option"] == "--backward") choice["value"] = a_.backward;
    }
    eval_background_ = background_color(a_.background);
    if (!a_.start.empty()) {
      std::error_code not_there;
      if (!a_.resume && fs::equivalent(a_.start, a_.model_file(), not_there)) {
        throw usage_error("--start " + a_.start +
                          ": is the model in --out, which the run replaces (choose another --out)");
      }
      gart::model_file const file = gart::load_model(a_.start);
      if (file.kernel_degree != a_.kernel_degree) {
        throw usage_error("--start " + a_.start + ": is of kernel degree " + std::to_string(file.kernel_degree) +
                          ", the run of " + std::to_string(a_.kernel_degree) + " (give --kernel-degree " +
                          std::to_string(file.kernel_degree) + ")");
      }
      start_ = gart::with_sh_degree(file.model, row_.sh_degree);
      if (start_.size() > a_.max_gaussians) {
        throw usage_error("--start " + a_.start + ": has " + with_commas(start_.size()) +
                          " Gaussians, more than --max-gaussians " + std::to_string(a_.max_gaussians));
      }
    }
    prepare_folder(a_.out);
    enter();
    prepare_folder(a_.out / "renders");
    session_ = gart::make_session(configuration_request_of(a_), train_options_of(a_), data_,
                                  a_.start.empty() ? nullptr : &start_);
    a_.resume ? go_on() : begin_anew();
    trials_ = session_->trials().size();
    say_choices();
    say_.note(row_.backend + " backend, " + row_.tracer + " tracer, " + row_.backward + " backward pass");
    load_seconds_ = loading.seconds();
  }

  void say_choices() {
    say_.note("chosen for this capture, each by its option where one is given:");
    for (auto const& choice : chosen_) {
      auto const text = [&](char const* key) { return choice.value(key, std::string()); };
      say_.note("  " + text("option") + " " + text("value") + ": " + text("why"));
    }
  }

  // The folder is this run's from here on.
  void enter() {
    if (lock_) return;
    lock_.emplace(a_.out);
    if (!a_.resume) refuse_foreign_files(a_.out);
  }

  void load() {
    std::mutex mutex;  // images are decoded by several threads
    gart::dataset_options options;
    options.downscale = a_.downscale;
    options.test_every = a_.test_every;
    options.progress = [&](std::size_t done, std::size_t total) {
      std::lock_guard const lock(mutex);
      say_.state("loading " + std::to_string(done) + "/" + std::to_string(total) + " images",
                 static_cast<double>(done) / static_cast<double>(std::max<std::size_t>(total, 1)));
    };
    data_ = gart::load_dataset(a_.dataset, options);
    if (data_.train.empty()) {
      throw gart::io_error(a_.dataset.string(), "has no training views",
                           "raise --test-every, which keeps views for testing");
    }
    say_.note(data_.format + " capture: " + std::to_string(data_.train.size()) + " training views, " +
              std::to_string(data_.test.size()) + " test views (" + data_.split + "), " + image_size() + ", " +
              with_commas(data_.points.size()) + " points");
    for (auto const& note : data_.notes) say_.note("  " + note);
  }

  // The first checkpoint is written before the first step: what cannot be saved is then known before it costs anything.
  // An earlier run's results go, lest they be taken for this one's.
  void begin_anew() {
    remove_run(a_.out);
    nlohmann::json config = config_of(a_, data_);
    config["chosen"] = chosen_;
    write_json(a_.config_file(), config);
    session_->save(a_.checkpoint_file());
  }

  void go_on() {
    check_same_dataset(a_, data_);
    nlohmann::json config = read_json(a_.config_file());
    chosen_ = chosen_before(config, chosen_);
    try {
      session_->load(a_.checkpoint_file());
    } catch (gart::io_error const& e) {
      throw gart::error(std::string(e.what()) + "; without --resume the run starts anew, --out names another");
    }
    int const step = session_->steps_done();
    // It tells how much of a time budget is used.
    if (a_.time_budget > 0 || fs::exists(a_.history_file())) course_.restore(a_.history_file(), step);
    say_.note("resuming after step " + with_commas(step));
    auto const now = a_.recorded.values();
    for (auto const& [name, before] : a_.raised.items()) {
      say_.note("--" + name + " " + now[name].dump() + " instead of " + before.dump() +
                ": rates, degrees and densification follow the new length from here on");
      config["options"][name] = now[name];
      config["raised"].push_back({{"option", name}, {"step", step}, {"from", before}, {"to", now[name]}});
    }
    if (!a_.raised.empty()) {
      remove_results(a_.out);
      write_json(a_.config_file(), config);
    }
    raised_ = config.value("raised", nlohmann::json::array());
  }

  // True when all steps are done, false when it was asked to stop.
  bool train(interrupt_guard const& interrupt) {
    recent_steps recent;
    stopwatch since_start;
    double last_checkpoint = 0;
    for (;;) {
      int const before = session_->steps_done(), length = a_.length(before, course_.seconds);
      if (before >= length) return true;
      // The first steps load images and are no measure of the others.
      session_->set_iterations(before < 100 ? a_.iterations : length);
      double const done_before = progress_at(before);
      if (interrupt.wanted() || (a_.stop_at > 0 && before >= a_.stop_at)) return false;
      session_->profile().enable(before % profile_every == profile_every - 1);
      stopwatch const step;
      gart::step_report const report = checked_step();
      double const seconds = step.seconds();
      if (session_->profile().enabled()) ++profiled_steps_, profiled_seconds_ += seconds;
      session_->profile().enable(false);
      if (report.backward != row_.backward && !fell_back_) {
        fell_back_ = true;
        say_.note("step " + with_commas(report.step) +
                  ": the LT buffer would pass --lt-budget or its 2^32 slots, this step and others like it are " +
                  report.backward);
      }
      if (!std::isfinite(report.loss)) {
        throw gart::error("step " + std::to_string(report.step) + ", view " + report.view +
                          ": the loss is not a number (the last checkpoint is whole: " + a_.checkpoint_file().string() +
                          ")");
      }
      finite_steps_ += a_.check_finite, skipped_updates_ += report.skipped;
      ++steps_, step_seconds_ += seconds, course_.seconds += seconds, gaussians_ = report.gaussians;
      if (!report.trial) course_.add(report);
      say_new_trials();
      recent.add(report, seconds);
      show(report, recent);
      double const done = progress_at(report.step);
      auto const passes = [&](int parts) { return std::floor(done * parts) > std::floor(done_before * parts); };
      bool const by_time = a_.time_budget > 0;
      if (by_time && passes(200)) course_.close_point();
      int const between = a_.steps_between_tests();
      bool const due = by_time && a_.eval_every < 0 ? passes(5) : between > 0 && report.step % between == 0;
      if (!report.trial && due && report.step < a_.length(report.step, course_.seconds)) test(report.step);
      if (a_.checkpoint_minutes > 0 && since_start.seconds() - last_checkpoint > 60 * a_.checkpoint_minutes) {
        stopwatch const saving;
        save_checkpoint();
        save_seconds_ += saving.seconds();
        last_checkpoint = since_start.seconds();
      }
    }
  }

  // Of a run that ends at a time, a point for each two hundredth of it, whatever the number of steps.
  static history course_of(train_arguments const& a) {
    return history(a.time_budget > 0 ? std::numeric_limits<int>::max() : a.iterations);
  }
  double progress_at(int step) const { return a_.progress(step, course_.seconds); }

  gart::step_report checked_step() {
    try {
      return session_->step();
    } catch (gart::not_finite const& e) {
      throw gart::error(std::string(e.what()) + "; the last checkpoint is whole: " + a_.checkpoint_file().string());
    }
  }

  void say_new_trials() {
    auto const trials = session_->trials();
    for (; trials_ < trials.size(); ++trials_)
      say_.note("step " + with_commas(session_->steps_done()) + ": " + in_words(trials[trials_]));
  }

  void show(gart::step_report const& report, recent_steps const& recent) {
    double const share = progress_at(report.step);
    if (!say_.due(share)) return;
    double const rate = recent.seconds > 0 ? 1 / recent.seconds : 0;
    double const left = (a_.iterations - report.step) * recent.seconds;
    say_.state(with_commas(report.step) + (a_.time_budget > 0 ? "" : "/" + with_commas(a_.iterations)) + "  " +
                   fixed(rate, rate < 10 ? 2 : 0) + " it/s  loss " + fixed(recent.loss, 4) + "  PSNR " +
                   fixed(recent.psnr, 2) + " dB  " + with_commas(report.gaussians) + " Gaussians  " +
                   as_duration(a_.time_budget > 0 ? std::min(left, a_.time_budget - course_.seconds) : left) + " left" +
                   (report.trial ? ", a band on trial" : ""),
               share);
  }

  gart::scores score(gart::some_views const& views, gart::keep_view const& keep = {}) {
    return gart::evaluate(
        views, eval_background_, session_->exposures(),
        [this](gart::camera const& c) { return session_->render(c, eval_background_); }, keep);
  }

  gart::scores test(int step, gart::keep_view const& keep = {}) {
    stopwatch const testing;
    gart::scores const result = score(gart::all_of(data_.test), keep);
    if (!result.views.empty()) {
      course_.test.push_back({step, result.psnr, result.ssim, course_.seconds});
      say_.note("step " + with_commas(step) + ": test PSNR " + fixed(result.psnr, 2) + " dB, SSIM " +
                fixed(result.ssim, 4));
    }
    test_seconds_ += testing.seconds();
    return result;
  }

  void save_checkpoint() {
    course_.close_point();
    session_->save(a_.checkpoint_file());
    write_json(a_.history_file(), course_.to_json());
  }

  // The model first: where the disk is full, the smaller and more precious one is there.
  void save() {
    gart::model_file const file{session_->model(), traced_with(), row_.kernel_degree};
    gaussians_ = file.model.size();
    gart::save_model(a_.model_file(), file);
    if (auto const exposures = session_->exposures(); !exposures.empty())
      gart::write_exposures(a_.out / "exposures.json", exposures);
    try {
      save_checkpoint();
    } catch (gart::io_error const& e) {
      throw gart::error(std::string(e.what()) + "; the model is whole: " + a_.model_file().string());
    }
  }

  // What the model was traced with.
  gart::render_options traced_with() const {
    gart::train_options const options = train_options_of(a_);
    gart::render_options render = options.render;
    render.near = options.near * data_.extent;
    return render;
  }

  void conclude() {
    remove_results(a_.out);
    std::vector<report_view> shown;
    stopwatch const writing;
    double const tests_before = test_seconds_;
    gart::scores const result = test(
        session_->steps_done(),
        [&](std::size_t i, gart::view_score const& s, gart::image_float const& render, gart::image_float const& truth) {
          gart::write_png(a_.out / "renders" / (s.name + ".png"), gart::to_8bit(render));
          gart::write_png(a_.out / "renders" / (s.name + "_truth.png"), gart::to_8bit(truth));
          if (in_report(i, data_.test.size())) shown.push_back(make_report_view(s.name, s.psnr, s.ssim, render, truth));
          say_.state("testing " + std::to_string(i + 1) + "/" + std::to_string(data_.test.size()),
                     static_cast<double>(i + 1) / static_cast<double>(data_.test.size()));
        });
    say_.state("testing on training views", 1);
    stopwatch const training_views;
    gart::scores const training = score(gart::evenly_spread(data_.train, data_.test.size()));
    test_seconds_ += training_views.seconds();
    write_json(a_.history_file(), course_.to_json());
    save_seconds_ += writing.seconds() - (test_seconds_ - tests_before);
    nlohmann::json const metrics = metrics_of(result, training);
    write_json(a_.out / "metrics.json", metrics);
    gart::write_file(a_.out / "report.html", report_page(metrics, read_json(a_.config_file()), course_, shown));
    if (a_.quiet) return;
    say_.clear();
    std::printf("trained %s steps in %s, %s Gaussians\n", with_commas(session_->steps_done()).c_str(),
                as_duration(course_.seconds).c_str(), with_commas(gaussians_).c_str());
    if (!result.views.empty()) std::fputs(in_words(result, training, data_.train.size()).c_str(), stdout);
    std::printf("model   %s\nreport  %s\n", a_.model_file().string().c_str(),
                (a_.out / "report.html").string().c_str());
  }

  std::string image_size() const {
    auto const& first = data_.train.front().image;
    std::string const size = std::to_string(first.width) + " x " + std::to_string(first.height);
    for (auto const& v : data_.train) {
      if (v.image.width != first.width || v.image.height != first.height) return size + " and other sizes";
    }
    return size;
  }

  nlohmann::json metrics_of(gart::scores const& result, gart::scores const& training) {
    nlohmann::json m = to_json(result, training, data_.train.size());
    fs::path const named = fs::absolute(a_.dataset).lexically_normal();
    m["scene"] = (named.has_filename() ? named : named.parent_path()).filename().string();
    m["format"] = data_.format, m["split"] = data_.split, m["resize_filter"] = data_.resize_filter;
    m["psnr_over_seconds"] = course_.psnr_over_seconds();
    m["image_size"] = image_size(), m["notes"] = data_.notes;
    m["background"] = a_.background == "random" ? "random in training, black in testing" : a_.background;
    m["exposure"] = a_.exposure == "on";
    m["iterations"] = session_->steps_done(), m["time_budget"] = a_.time_budget, m["raised"] = raised_;
    m["gaussians"] = gaussians_, m["sh_degree"] = session_->configuration().sh_degree;
    m["floats_per_gaussian"] = 11 + 3 * gart::sh_coefficients(session_->configuration().sh_degree);
    m["chosen"] = chosen_, m["sh_trials"] = trials_of(session_->trials());
    m["model_bytes"] = fs::file_size(a_.model_file()), m["checkpoint_bytes"] = fs::file_size(a_.checkpoint_file());
    m["backend"] = row_.backend, m["tracer"] = row_.tracer, m["backward"] = row_.backward;
    m["kernel_degree"] = row_.kernel_degree;
    m["approximations"] = approximations_of(train_options_of(a_).render, row_);
    m["approximations"]["preset"] = a_.preset, m["approximations"]["adam"] = a_.adam;
    m["finite_steps"] = finite_steps_;
    if (a_.check_finite) m["skipped_updates"] = skipped_updates_;
    m["seconds"] = course_.seconds;
    m["iterations_per_second"] = course_.seconds > 0 ? session_->steps_done() / course_.seconds : 0;
    m["wall_seconds"] = {
        {"loading", load_seconds_}, {"training", step_seconds_}, {"testing", test_seconds_}, {"saving", save_seconds_}};
    m["stages_ms"] = nlohmann::json::object();
    for (auto const& [label, time] : session_->profile().stages()) {
      if (profiled_steps_ > 0) m["stages_ms"][label] = time.milliseconds / profiled_steps_;
    }
    m["profiled_steps"] = profiled_steps_;
    m["profiled_step_ms"] = profiled_steps_ > 0 ? 1000 * profiled_seconds_ / profiled_steps_ : 0;
    m["peak_bytes"] = session_->peak_bytes(),
    m["peak_process_bytes"] = static_cast<std::uint64_t>(peak_process_bytes());
    return m;
  }

  train_arguments& a_;
  std::optional<run_lock> lock_;
  progress say_;
  history course_;
  gart::configuration_info row_;
  bool fell_back_ = false;
  gart::dataset data_;
  nlohmann::json chosen_, raised_ = nlohmann::json::array();
  std::size_t trials_ = 0;  // that have been told of
  gart::gaussian_model start_;
  gart::vec3 eval_background_{0.0f};
  std::unique_ptr<gart::session> session_;
  std::size_t gaussians_ = 0;
  int steps_ = 0, profiled_steps_ = 0;
  int finite_steps_ = 0;               // steps of this process after which everything was finite, by --check-finite
  std::uint64_t skipped_updates_ = 0;  // numbers that Adam left as they were in them
  double load_seconds_ = 0, step_seconds_ = 0, test_seconds_ = 0, save_seconds_ = 0, profiled_seconds_ = 0;
};

}  // namespace

void add_train(CLI::App& app, command& selected) {
  auto a = std::make_shared<train_arguments>();
  CLI::App* train = app.add_subcommand(
      "train", "Train Gaussians on the photographs of a capture, test them on held-out views, and report.");
  add_arguments(*train, *a);
  train->footer(
      "\nWrites into DIR:\n"
      "  model.ply         the Gaussians, as other viewers read them\n"
      "  exposures.json    with --exposure: of each training view, for gart render and gart eval\n"
      "  report.html       one page: scores, curves, test views with their errors, where time and memory went\n"
      "  metrics.json      the same in figures\n"
      "  renders/          each test view: NAME.png, and NAME_truth.png beside it\n"
      "  checkpoint.gart   all that the next step depends on; with config.json and history.json what --resume needs\n"
      "A run that was in DIR before is replaced, all of it; files of these names that no run left there are not.\n"
      "Ctrl-C, SIGTERM or SIGHUP finishes the step, saves, and exits with 130.\n"
      "\nExamples:\n"
      "  gart train lego --out run --downscale 4 --iterations 2000 --max-gaussians 20000\n"
      "  gart train --resume --out run");
  train->callback([a, train, &selected] {
    fill_in(*train, *a);
    selected = [a] { return training_run(*a).run(); };
  });
}

}  // namespace gart_cli
