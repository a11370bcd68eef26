#include "training_run.hpp"

#include "choices.hpp"
#include "commands.hpp"
#include "output.hpp"
#include "ranks.hpp"

#include <gart/io/placed_views.hpp>
#include <gart/io/scene_file.hpp>
#include <gart/runtime/matched_points.hpp>
#include <gart/runtime/model_file.hpp>
#include <gart/train/memory_need.hpp>

#include <mutex>

namespace gart_cli {

namespace fs = std::filesystem;

int training_run::run() {
  broken_pipe_guard const unread;
  read_capture();
  std::optional<interrupt_guard> interrupt(std::in_place);  // until a run that it stops is saved
  if (!a_.resume && !measure_capture(*interrupt)) {
    say_.note("Stopped before the first step: nothing is saved, and nothing was replaced.");
    return exit_interrupted;
  }
  begin();
  serve();
  bool const finished = train(*interrupt);
  stopwatch const saving;
  save();
  save_seconds_ += saving.seconds();
  if (view_)
    view_->end(finished ? "The training is done, and saved in " + a_.out.string() + "."
                        : "The training was stopped, and saved: gart train --resume --out " + a_.out.string() +
                              " continues it.");
  view_.reset();  // there is nothing to see any more
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

// What is given is looked at before what takes long.
void training_run::read_capture() {
  stopwatch const loading;
  if (a_.out.empty()) throw usage_error("--out: a folder belongs there (see gart train --help)");
  if (writes_ && fs::is_directory(a_.out)) enter();
  if (writes_) try_folder(a_.out);
  if (a_.resume) continue_run(a_);
  share_out();
  if (a_.dataset.empty()) throw usage_error("DATASET is missing (see gart train --help)");
  check_poses();
  configuration_ = gart::resolve(request());  // a missing file is known before images are read
  load();
  load_start();
  match_photographs();
  chosen_ = choose(a_, data_);
  configuration_ = gart::resolve(request());
  a_.backend = to_string(configuration_.backend), a_.tracer = to_string(configuration_.tracer),
  a_.backward = configuration_.backward;
  a_.hit_format = to_string(configuration_.hit_format);
  for (auto& choice : chosen_) {
    if (choice["option"] == "--tracer") choice["value"] = a_.tracer;
    if (choice["option"] == "--backward") choice["value"] = a_.backward;
  }
  eval_background_ = background_color(a_.background);
  load_seconds_ = loading.seconds() - measure_seconds_;
}

void training_run::begin() {
  stopwatch const beginning;
  course_ = course_of(a_), course_.seconds = measure_seconds_;
  if (writes_) {
    prepare_folder(a_.out);
    enter();
    prepare_folder(a_.out / "renders");
  }
  if (ranks::size() > 1) say_memory();
  session_ = a_.start.empty() || a_.resume
                 ? gart::make_session(request(), train_options_of(a_), data_)
                 : gart::make_session(request(), train_options_of(a_), data_, gart::start_model(start_, true));
  start_ = {};
  a_.resume ? go_on() : begin_anew();
  say_choices();
  say_.note(a_.backend + " backend, " + a_.tracer + " tracer, " + configuration_.backward + " backward pass");
  load_seconds_ += beginning.seconds();
}

// The Gaussians of --start; a checkpoint has all of a run that is resumed.
void training_run::load_start() {
  if (a_.start.empty() || a_.resume) return;
  std::error_code not_there;
  if (fs::equivalent(a_.start, a_.model_file(), not_there)) {
    throw usage_error("--start " + a_.start + ": is the model in --out, which the run replaces (choose another --out)");
  }
  gart::model_file file = gart::load_model(a_.start, owners());
  say_.notes(file.notes);
  if (file.kernel_degree != a_.kernel_degree) {
    throw usage_error("--start " + a_.start + ": is of kernel degree " + std::to_string(file.kernel_degree) +
                      ", the run of " + std::to_string(a_.kernel_degree) + " (give --kernel-degree " +
                      std::to_string(file.kernel_degree) + ")");
  }
  gart::move_origin(file.model, file.origin, data_.origin);
  start_ = gart::with_sh_degree(std::move(file.model), configuration_.sh_degree);
  start_total_ = file.total;
  if (file.total > a_.options.max_gaussians) {
    throw usage_error("--start " + a_.start + ": has " + with_commas(file.total) +
                      " Gaussians, more than --max-gaussians " + std::to_string(a_.options.max_gaussians));
  }
}

// What --scene names.
void training_run::read_mirrors() {
  gart::scene_file file = gart::read_scene(a_.scene, data_.origin);
  for (std::string const& note : file.notes) say_.note("  " + note);
  if (file.scene.meshes.empty())
    throw gart::io_error(a_.scene, "has no mesh", "describe the capture's mirrors in 'meshes' (docs/light.md)");
  data_.mirrors = std::move(file.scene);
}

// The message about --poses.
void training_run::check_poses() {
  if (a_.poses.empty()) return;
  if (!a_.options.refine_poses)
    throw usage_error("--poses " + a_.poses +
                      ": needs --refine-poses, which also aligns the test views before they are scored");
  std::error_code not_there;
  if (!a_.resume && fs::equivalent(a_.poses, a_.out / "poses.json", not_there))
    throw usage_error("--poses " + a_.poses +
                      ": is of the run in --out, which the run replaces (choose another --out)");
}

// A step among the ranks there are.
void training_run::share_out() {
  if (a_.parallel == "views" && a_.options.batch == 1 && !a_.resume) a_.options.batch = ranks::size();
  ranks::start(a_.options.batch > 1);
  if (ranks::size() == 1) return;
  if (a_.viewed) throw usage_error("--view needs a single rank: leave it out, or start one rank");
  say_.note(std::to_string(ranks::size()) + " ranks, each a part of the Gaussians and of every step: " +
            (a_.options.batch == 1 ? "strips of a view" : "a batch of " + std::to_string(a_.options.batch) + " views"));
}

gart::configuration_request training_run::request() const {
  auto wanted = configuration_request_of(a_);
  wanted.ranks = ranks::comm();
  return wanted;
}

// Which Gaussians are this rank's.
gart::row_owners training_run::owners() const {
  return {ranks::size(), ranks::rank(), train_options_of(a_).shard_block};
}

// The ranks' needs, before they take memory.
void training_run::say_memory() {
  gart::train_options const options = train_options_of(a_);
  gart::u64 const begin = start_total_ > 0 ? start_total_ : gart::choose_start(data_, options).value.count;
  gart::u64 const most = gart::gaussians_at_end(options, data_, begin);
  say_.note(
      "each rank needs " +
      as_bytes(static_cast<double>(gart::least_bytes(options, most, configuration_.stored_degree, ranks::size()))) +
      " at the least, for its part of " + with_commas(most) + " Gaussians, and the memory of the views");
}

// Rank 0 measures, and all take its result. For a run with a time limit it is at most a tenth of that time, and a
// fiftieth where the first steps show that no trial would end.
// False where it was interrupted.
bool training_run::measure_capture(interrupt_guard const& interrupt) {
  stopwatch const measuring;
  if (writes_) {
    measured_ = measure(a_, data_, [&](double done, std::string const& plan) {
      say_.state("measuring what the capture asks for: " + plan + ", " + fixed(100 * done, 0) + "% done", done);
      if (interrupt.wanted()) return false;
      double const spent = measuring.seconds(), most = 0.1 * a_.time_budget;
      return a_.time_budget == 0 || (spent < most && !(spent > 0.2 * most && done < 0.1));
    });
  }
  if (ranks::agreed(interrupt.wanted())) return false;
  measured_ = nlohmann::json::parse(ranks::agreed_text(measured_.dump()));
  settle(a_, data_, measured_, chosen_);
  measure_seconds_ += measuring.seconds();
  return true;
}

void training_run::say_choices() {
  say_.note("chosen for this capture, each by its option where one is given:");
  for (auto const& choice : chosen_) {
    auto const text = [&](char const* key) { return choice.value(key, std::string()); };
    say_.note("  " + text("option") + " " + text("value") + ": " + text("why"));
  }
}

// The folder is this run's from here on.
void training_run::enter() {
  if (lock_) return;
  lock_.emplace(a_.out);
  remove_temporary_files(a_.out);
  if (!a_.resume) refuse_foreign_files(a_.out);
}

void training_run::load() {
  std::mutex mutex;  // images are decoded by several threads
  gart::dataset_options options;
  options.downscale = a_.downscale;
  options.test_every = a_.test_every;
  options.test_split = gart::from_string<gart::split_kind>(a_.test_split);
  options.photos = a_.photos, options.masks = !a_.no_masks;
  options.depth = {a_.options.depth_weight > 0, gart::from_string<gart::depth_kind>(a_.depth_kind), a_.depth_unit};
  options.progress = [&](std::size_t done, std::size_t total) {
    std::lock_guard const lock(mutex);
    say_.state("loading " + std::to_string(done) + "/" + std::to_string(total) + " images",
               static_cast<double>(done) / static_cast<double>(std::max<std::size_t>(total, 1)));
  };
  options.origin = a_.origin;
  options.host = ranks::on_host();
  data_ = gart::load_dataset(a_.dataset, options);
  if (data_.train.empty()) {
    throw gart::io_error(a_.dataset.string(), "has no training views",
                         "raise --test-every, which keeps views for testing");
  }
  if (!a_.poses.empty()) gart::place_training_views(data_, a_.poses);
  if (!a_.scene.empty()) read_mirrors();
  say_.note(data_.format + " capture: " + std::to_string(data_.train.size()) + " training views, " +
            std::to_string(data_.test.size()) + " test views (" + data_.split + "), " + image_size() + ", " +
            with_commas(data_.points.size()) + " points");
  for (auto const& note : data_.notes) say_.note("  " + note);
}

// Starting points, where neither the capture nor its depth maps have any, or where trials tell whether they pay.
void training_run::match_photographs() {
  if (a_.resume || !a_.start.empty() || a_.match == "off") return;
  // No photograph tells how long matching takes: a run with a time limit does it only where there is no point.
  bool const pays =
      data_.points.size() > 0 ? a_.time_budget == 0 && has_trials(a_, data_) : a_.options.depth_weight == 0;
  if (a_.match == "auto" && !pays) return;
  stopwatch const matching;
  data_.matched = gart::match_photographs(data_, a_.options.random_points, a_.options.seed,
                                          [&](double done) { say_.state("matching photographs", done); });
  measure_seconds_ = matching.seconds();
  say_.note("  " + with_commas(data_.matched.size()) + " points matched in the photographs, in " +
            as_duration(measure_seconds_));
}

// The first checkpoint is written before the first step: what cannot be saved is then known before it costs anything.
// An earlier run's results go, lest they be taken for this one's.
void training_run::begin_anew() {
  if (writes_) {
    remove_run(a_.out);
    nlohmann::json config = config_of(a_, data_);
    config["chosen"] = chosen_, config["measured"] = measured_;
    write_json(a_.config_file(), config);
    write_json(a_.history_file(), course_.to_json());  // how much of a time budget is used
  }
  session_->save(a_.checkpoint_file());
}

void training_run::go_on() {
  check_same_dataset(a_, data_);
  nlohmann::json config = read_json(a_.config_file());
  chosen_ = chosen_before(config, chosen_);
  measured_ = config.value("measured", nlohmann::json::object());
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
  ranks::barrier();  // all have read it
  if (!a_.raised.empty() && writes_) {
    remove_results(a_.out);
    write_json(a_.config_file(), config);
  }
  raised_ = config.value("raised", nlohmann::json::array());
}

}  // namespace gart_cli
