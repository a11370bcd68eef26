#include "choices.hpp"
#include "image_writer.hpp"
#include "output.hpp"
#include "process_memory.hpp"
#include "report/report.hpp"
#include "training_run.hpp"

#include <gart/io/camera_file.hpp>
#include <gart/io/exposure_file.hpp>
#include <gart/io/file.hpp>
#include <gart/io/image_file.hpp>
#include <gart/loss/metrics.hpp>
#include <gart/runtime/model_file.hpp>
#include <gart/runtime/track.hpp>

#include <cstdio>

namespace gart_cli {

namespace fs = std::filesystem;

gart::scores training_run::score(gart::some_views const& views, gart::keep_view const& keep,
                                 gart::place_view const& place) {
  return gart::evaluate(
      views, eval_background_, session_->exposures(),
      [this](gart::camera const& c) { return session_->render(session_->as_learned(c), eval_background_); }, keep,
      place);
}

// Each test view at the pose where the unchanged model agrees best with its photograph.
gart::place_view training_run::aligned_to_photographs(std::vector<gart::named_camera>& found) {
  auto request = configuration_request_of(a_);
  request.sh_degree = session_->configuration().sh_degree;
  auto without_buffer = request;
  without_buffer.backward = "pixel", without_buffer.hit_format = gart::hit_format_kind::automatic;
  std::shared_ptr<gart::renderer> renderer;
  try {
    renderer = gart::make_renderer(without_buffer);
  } catch (gart::unsupported const&) {
    renderer = gart::make_renderer(request);
  }
  renderer->set_model(session_->model());
  gart::track_options options;
  options.render = gart::render_options_of(train_options_of(a_), data_.extent, eval_background_);
  options.steps = 20, options.blur = 0.01f;
  return [this, renderer, options, exposures = session_->exposures(), &found](gart::dataset_view const& view) mutable {
    options.response = exposures.at(view.view);
    gart::camera at = session_->as_learned(view.view);
    if (writes_)
      at = gart::track(*renderer, gart::composited(view.image, eval_background_), at, options, view.mask).view;
    found.push_back({view.name, ranks::agreed(at)});
    return found.back().view;
  };
}

// Each training view at the pose that was learned for it.
gart::place_view training_run::as_learned() const {
  return [this, poses = session_->poses()](gart::dataset_view const& view) {
    return poses[static_cast<std::size_t>(&view - data_.train.data())].view;
  };
}

gart::scores training_run::test(int step, gart::keep_view const& keep, gart::place_view const& place) {
  stopwatch const testing;
  gart::scores const result = score(gart::all_of(data_.test), keep, place);
  if (!result.views.empty()) {
    course_.test.push_back({step, result.psnr, result.ssim, course_.seconds});
    say_.note("step " + with_commas(step) + ": test PSNR " + fixed(result.psnr, 2) + " dB, SSIM " +
              fixed(result.ssim, 4));
  }
  test_seconds_ += testing.seconds();
  return result;
}

std::vector<gart::named_camera> training_run::from_zero(std::vector<gart::named_camera> cameras) const {
  for (gart::named_camera& c : cameras) c.view.position += data_.origin;
  return cameras;
}

void training_run::save_checkpoint() {
  course_.close_point();
  session_->save(a_.checkpoint_file());
  if (writes_) write_json(a_.history_file(), course_.to_json());
}

// The model first: where the disk is full, the smaller and more precious one is there.
void training_run::save() {
  gaussians_ = session_->size();
  session_->save_model(a_.model_file(), gart::traits_of(gart::render_options_of(train_options_of(a_), data_.extent),
                                                        configuration_.kernel_degree));
  if (auto const exposures = session_->exposures(); writes_ && !exposures.empty())
    gart::write_exposures(a_.out / "exposures.json", exposures, data_.origin);
  if (auto const poses = session_->poses(); writes_ && !poses.empty())
    gart::write_cameras(a_.out / "poses.json", from_zero(poses));
  try {
    save_checkpoint();
  } catch (gart::io_error const& e) {
    throw gart::error(std::string(e.what()) + "; the model is whole: " + a_.model_file().string());
  }
}

void training_run::conclude() {
  if (writes_) remove_results(a_.out);
  report_views shown;
  image_writer files;
  stopwatch const writing;
  double const tests_before = test_seconds_;
  std::vector<gart::named_camera> aligned;
  gart::scores const result = test(
      session_->steps_done(),
      [&](std::size_t i, gart::view_score const& s, gart::image_float const& render, gart::image_float const& truth) {
        if (!writes_) return;
        files.png(a_.out / "renders" / (s.name + ".png"), gart::to_8bit(render));
        files.png(a_.out / "renders" / (s.name + "_truth.png"), gart::to_8bit(truth));
        shown.add(i, data_.test.size(), s.name, s.psnr, s.ssim, render, truth);
        say_.state("testing " + std::to_string(i + 1) + "/" + std::to_string(data_.test.size()),
                   static_cast<double>(i + 1) / static_cast<double>(data_.test.size()));
      },
      a_.options.refine_poses ? aligned_to_photographs(aligned) : gart::place_view());
  if (a_.options.refine_lens && !a_.options.refine_poses)
    for (auto const& view : data_.test) aligned.push_back({view.name, session_->as_learned(view.view)});
  if (writes_ && !aligned.empty()) gart::write_cameras(a_.out / "poses_test.json", from_zero(aligned));
  say_.state("testing on training views", 1);
  stopwatch const training_views;
  gart::scores const training = score(gart::evenly_spread(data_.train, data_.test.size()), {},
                                      a_.options.refine_poses ? as_learned() : gart::place_view());
  test_seconds_ += training_views.seconds();
  report_cover cover = shown.cover();
  if (data_.test.empty())
    cover = make_report_cover(data_.train.front().name,
                              session_->render(session_->as_learned(data_.train.front().view), eval_background_).color);
  files.finish();
  gart::u64 const most_bytes = ranks::largest(session_->peak_bytes()),
                  most_sent = ranks::largest(session_->sent_bytes());
  if (!writes_) return;
  write_json(a_.history_file(), course_.to_json());
  save_seconds_ += writing.seconds() - (test_seconds_ - tests_before);
  nlohmann::json metrics = metrics_of(result, training);
  // At a corner as far from the middle as half of the diagonal.
  gart::exposure_field const photographed = session_->exposures();
  for (auto const& lens : photographed.lenses())
    metrics["corner_gains"].push_back((lens.value.gain(0, 1) + lens.value.gain(1, 1) + lens.value.gain(2, 1)) / 3);
  metrics["ranks"] = ranks::size(), metrics["batch"] = a_.options.batch;
  metrics["peak_bytes"] = most_bytes, metrics["sent_bytes"] = most_sent;
  write_json(a_.out / "metrics.json", metrics);
  gart::write_file(a_.out / "report.html",
                   report_page(metrics, read_json(a_.config_file()), course_, cover, shown.worst_first()));
  if (a_.quiet) return;
  say_.clear();
  std::printf("trained %s steps in %s, %s Gaussians\n", with_commas(session_->steps_done()).c_str(),
              as_duration(course_.seconds).c_str(), with_commas(gaussians_).c_str());
  if (!result.views.empty()) std::fputs(in_words(result, training, data_.train.size()).c_str(), stdout);
  if (metrics.contains("corner_gains"))
    std::printf("corners of photographs at %s of the light in their middle%s\n",
                fixed(metrics["corner_gains"][0].get<double>(), 3).c_str(),
                metrics["corner_gains"].size() > 1 ? ", through the first of several lenses" : "");
  std::printf("model   %s\nreport  %s\n", a_.model_file().string().c_str(), (a_.out / "report.html").string().c_str());
}

std::string training_run::image_size() const {
  auto const& first = data_.train.front().image;
  std::string const size = std::to_string(first.width) + " x " + std::to_string(first.height);
  for (auto const& v : data_.train) {
    if (v.image.width != first.width || v.image.height != first.height) return size + " and other sizes";
  }
  return size;
}

nlohmann::json training_run::metrics_of(gart::scores const& result, gart::scores const& training) {
  nlohmann::json m = to_json(result, training, data_.train.size());
  fs::path const named = fs::absolute(a_.dataset).lexically_normal();
  m["scene"] = (named.has_filename() ? named : named.parent_path()).filename().string();
  m["format"] = data_.format, m["split"] = data_.split, m["resize_filter"] = data_.resize_filter;
  m["psnr_over_seconds"] = course_.psnr_over_seconds();
  m["image_size"] = image_size(), m["notes"] = data_.notes;
  m["background"] = a_.background == "random" ? "random in training, black in testing" : a_.background;
  m["match"] = a_.match == "on", m["exposure"] = a_.exposure == "on", m["vignetting"] = a_.vignetting == "on",
  m["refine_poses"] = a_.options.refine_poses;
  m["refine_lens"] = a_.options.refine_lens;
  m["iterations"] = session_->steps_done(), m["time_budget"] = a_.time_budget, m["raised"] = raised_;
  m["gaussians"] = gaussians_, m["sh_degree"] = session_->configuration().sh_degree;
  m["floats_per_gaussian"] = 11 + 3 * gart::sh_coefficients(session_->configuration().sh_degree);
  m["chosen"] = chosen_, m["measured"] = measured_;
  m["model_bytes"] = fs::file_size(a_.model_file()), m["checkpoint_bytes"] = fs::file_size(a_.checkpoint_file());
  m["backend"] = a_.backend, m["tracer"] = a_.tracer, m["backward"] = configuration_.backward;
  m["kernel_degree"] = configuration_.kernel_degree;
  m["approximations"] = approximations_of(train_options_of(a_).render, configuration_);
  m["approximations"]["preset"] = a_.preset, m["approximations"]["adam"] = a_.adam;
  m["finite_steps"] = finite_steps_;
  if (a_.options.check_finite) m["skipped_updates"] = skipped_updates_;
  m["seconds"] = course_.seconds;
  m["iterations_per_second"] = step_seconds_ > 0 ? steps_ / step_seconds_ : 0;
  m["wall_seconds"] = {{"loading", load_seconds_},
                       {"measuring", measure_seconds_},
                       {"training", step_seconds_},
                       {"testing", test_seconds_},
                       {"saving", save_seconds_}};
  m["stages_ms"] = nlohmann::json::object();
  for (auto const& [label, time] : session_->profile().stages()) {
    if (profiled_steps_ > 0) m["stages_ms"][label] = time.milliseconds / profiled_steps_;
  }
  m["profiled_steps"] = profiled_steps_;
  m["profiled_step_ms"] = profiled_steps_ > 0 ? 1000 * profiled_seconds_ / profiled_steps_ : 0;
  m["peak_bytes"] = session_->peak_bytes(), m["peak_process_bytes"] = static_cast<std::uint64_t>(peak_process_bytes());
  return m;
}

}  // namespace gart_cli
