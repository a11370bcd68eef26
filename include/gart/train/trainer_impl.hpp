#pragma once
/// \file
/// Template bodies of trainer.hpp.

#include <gart/io/image_file.hpp>
#include <gart/train/trainer.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace gart::inline GART_ISA {

template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
basic_trainer<E, Traits, Tracer, Strategy, Comm>::basic_trainer(E& exec, train_options const& options,
                                                                dataset const& data, start_model const& start,
                                                                Comm comm)
    : exec_(exec),
      options_(with_room(exec, comm, options, data, start)),
      data_(data),
      degree_(start.rows.sh_degree),
      comm_(std::move(comm)),
      shards_(exec, comm_, std::max<index_t>(options.shard_block, 1)),
      scene_(in_rows(part_of(start))),
      gradients_(exec, scene_.size(), sh_degree),
      state_(exec, scene_.size(), sh_degree),
      frame_(exec),
      passes_(exec),
      loss_(exec),
      images_(exec, data),
      order_(data.train.size(), options.held_out, options.seed),
      dropout_(exec, options.dropout, options.dropout_until, options.seed),
      min_pixel_filter_(exec),
      error_(exec, error_options_of(options, data),
             growth_budget(options.error, options.max_gaussians, data.training_pixels()), options.iterations,
             options.seed),
      error_map_(exec),
      mcmc_(exec, mcmc_options_of(options), options.max_gaussians, options.iterations, data.extent, options.seed,
            Traits::response::degree),
      adc_(exec, adc_options_of(options), options.max_gaussians, options.iterations, data.extent, options.seed),
      color_(exec),
      color_gradient_(exec),
      value_(exec, 2 + pose_gradient::floats + lens_gradient::floats),
      supervision_(exec, data, options.depth_weight),
      depth_(exec),
      transmittance_(exec),
      pose_backward_(exec),
      lens_backward_(exec),
      started_with_(static_cast<index_t>(total_of(comm_, start))),
      total_(started_with_) {
  require_ranks();
  require_resolution(options.resolution);
  if (degree_ > sh_degree)
    throw invalid_argument("trainer: the model to start from has a higher SH degree than the trainer's traits");
  make_room();
  if (order_.empty()) throw invalid_argument("trainer: there are no training views, or all are held out");
  if (options.depth_weight > 0) {
    bool mapped = false;
    for (dataset_view const& v : data.train) mapped = mapped || !v.depth.empty();
    if (!mapped)
      throw invalid_argument("train_options.depth_weight: no training view has a depth map (dataset_options.depth)");
  }
  if constexpr (Comm::alone) {
    if (options.check_finite) finite_.emplace(exec);
  } else {
    if (options.check_finite) finite_.emplace(exec, shards_.rows.owners());
  }
  // Sums in a fixed order were asked for: no budget of our own takes them away.
  if (options.lt_budget == 0 && !Strategy::ordered)
    options_.lt_budget = exec.free_bytes() / 2 / static_cast<u64>(comm_.sharers());
  if (options.exposure) exposures_.emplace(exec, data.train.size());
  if (options.vignetting) {
    std::vector<named_camera> captured;
    for (dataset_view const& view : data.train) captured.push_back({view.name, view.view});
    vignetting_.emplace(exec, captured);
  }
  if (options.refine_poses) {
    std::vector<camera> captured;
    for (dataset_view const& view : data.train) captured.push_back(view.view);
    poses_.emplace(options.poses, std::move(captured), data.extent);
  }
  if (options.refine_lens) {
    if (options.render.antialias > 0)
      throw invalid_argument(
          "train_options.refine_lens: the filter of the pixels has no gradient by the focal length; set "
          "render_options.antialias to 0");
    std::vector<named_camera> captured;
    for (dataset_view const& view : data.train) captured.push_back({view.name, view.view});
    lenses_.emplace(options.lens, captured);
  }
  growth_ = growth_for(options.mcmc, started_with_, options.max_gaussians, options.iterations);
  mcmc_.set_growth(growth_);
  error_.set_batch(options.batch), mcmc_.set_batch(options.batch), adc_.set_batch(options.batch);
}

// For all that the run is to grow to, at once: growth neither takes slack nor has an array twice while it copies it.
template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
void basic_trainer<E, Traits, Tracer, Strategy, Comm>::make_room() {
  u64 const all = gaussians_at_end(options_, data_, started_with_);
  u64 here = all;
  if constexpr (!Comm::alone) here = shards_.rows.owners().owned(all);
  for (gaussians<E>* each : {&scene_, &gradients_, &state_.first, &state_.second}) each->reserve(here);
  dropout_.reserve(here);
  if (options_.render.antialias > 0) min_pixel_filter_.reserve(here);
}

template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
void basic_trainer<E, Traits, Tracer, Strategy, Comm>::set_iterations(int iterations) {
  if (iterations == options_.iterations) return;
  options_.iterations = iterations;
  error_.set_iterations(iterations), mcmc_.set_iterations(iterations), adc_.set_iterations(iterations);
  growth_ = growth_for(options_.mcmc, started_with_, options_.max_gaussians, iterations);
  mcmc_.set_growth(growth_);
}

template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
step_report basic_trainer<E, Traits, Tracer, Strategy, Comm>::step() {
  return step_by(nullptr);
}

template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
void basic_trainer<E, Traits, Tracer, Strategy, Comm>::evaluate(loss_function<E> const* loss, loss_input<E> const& in) {
  if (loss) return (*loss)(in);
  loss_.evaluate(in.image, in.truth, in.width, in.height, options_.ssim_weight, in.gradient, in.value);
}

template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
step_report basic_trainer<E, Traits, Tracer, Strategy, Comm>::step_by(loss_function<E> const* loss) {
  if constexpr (!Comm::alone)
    if (in_ranks()) return step_in_ranks(loss);
  std::size_t const index = order_.at(step_);
  dataset_view const& view = data_.train[index];
  shrink_ = shrink_at(options_.resolution, step_, options_.iterations);
  camera const seen = traced(index);
  int const degree = sh_degree_at(step_, degree_, options_.sh_every, options_.iterations);
  learning_rates const rates = rates_of_step();
  render_options const render = render_options_of(options_, data_.extent, background_of(step_));
  std::size_t const floats = std::size_t{3} * seen.width * seen.height;
  color_.resize(floats), color_gradient_.resize(floats);

  auto shown = dropout_.leave_out(scene_, step_, options_.iterations, all_rows().owners());
  frame_.prepare(std::as_const(scene_).view(), seen, render, degree);
  span<float const> moments;
  char const* used = nullptr;
  // With less memory where the LT buffer would pass its budget or the numbers of its slots, and then with none.
  passes_.with_room(frame_, options_.lt_budget, [&]<class Pass>(Pass& pass) {
    differentiate_by(pass, loss, index, rates);
    moments = pass.moments(), lt_bytes_ = pass.lt_bytes(), used = Pass::strategy_type::name;
  });
  bool const learn_poses = learns_poses(), learn_lenses = learns_lenses();
  if (learn_poses)
    pose_backward_(frame_, std::as_const(gradients_).view(), value_.view().subspan(2, pose_gradient::floats));
  ++step_;
  if (grows_by_error()) error_.add_errors(scene_, moments);
  if (options_.densify == densify_kind::adc) adc_.accumulate(scene_, gradients_, seen);
  shown.end();
  optimize(rates, degree, all_rows());

  step_report report;
  if (finite_) report.skipped = (*finite_)(scene_, state_, "step " + std::to_string(step_) + ", view " + view.name);
  report.step = step_;
  report.gaussians = total_;
  report.view = view.name;
  report.backward = used;
  std::vector<float> const value = value_.to_host();
  if (learn_poses) poses_->step(index, pose_gradient(value.data() + 2), step_ - 1, options_.iterations);
  if (learn_lenses)
    lenses_->step(index, lens_gradient(value.data() + 2 + pose_gradient::floats, shrink_of_view(index)), step_ - 1,
                  options_.iterations);
  report.loss = value[0];
  if constexpr (has_depth<Strategy>) report.loss += supervision_.value();
  report.psnr = value[1] > 0 ? -10.0f * std::log10(value[1]) : 99.0f;
  return report;
}

template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
template <class Pass>
void basic_trainer<E, Traits, Tracer, Strategy, Comm>::differentiate_by(Pass& pass, loss_function<E> const* loss,
                                                                        std::size_t index,
                                                                        learning_rates const& rates) {
  dataset_view const& view = data_.train[index];
  image_targets targets;
  targets.color = color_.data();
  bool const measures = learns_poses() && poses_->wants_metric(index);
  if constexpr (has_depth<Strategy>) {
    supervision_.begin(targets, color_.size() / 3);
  } else if (measures) {
    depth_.resize(color_.size() / 3), transmittance_.resize(color_.size() / 3);
    targets.depth = depth_.data(), targets.transmittance = transmittance_.data();
  }
  pass.render(frame_, targets);
  {
    stage_scope stage(exec_, "loss");
    span<float const> const image = photographed(index);
    int const shrink = shrink_of_view(index);
    truth_view const truth = images_.get(index, frame_.options().background, shrink);
    depth_pixels depth;
    if constexpr (has_depth<Strategy>) supervision_.evaluate(index, truth, shrink), depth = supervision_.pixels();
    evaluate(loss, {exec_, view, truth, frame_.view().width, frame_.view().height, image, color_gradient_,
                    value_.view().subspan(0, 2), depth});
    if (grows_by_error()) error_map(exec_, image, truth, error_map_);
    if (exposures_) exposures_->step(index, through_lens(), color_gradient_, rates.exposure);
    if (vignetting_) vignetting_->step(index, captured(index), color_, color_gradient_, rates.vignetting);
  }
  image_gradients image{color_gradient_};
  depth_and_transmittance more;
  if constexpr (has_depth<Strategy>) {
    image = supervision_.gradients(color_gradient_);
    more = {supervision_.pixels().depth.data(), supervision_.pixels().transmittance.data()};
  }
  differentiate(frame_, pass, image, gradients_, error_map_);
  if (learns_lenses())
    lens_backward_(frame_, color_, image, value_.view().subspan(2 + pose_gradient::floats, lens_gradient::floats),
                   more);
  if (measures) {
    std::vector<float> depth, transmittance;
    if constexpr (has_depth<Strategy>)
      depth = supervision_.depth(), transmittance = supervision_.transmittance();
    else
      depth = depth_.to_host(), transmittance = transmittance_.to_host();
    poses_->set_metric(index, pose_metric_of(index, depth, transmittance));
  }
}

// The optimizer's step and what grows, moves and prunes the Gaussians.
template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
template <class Rows>
void basic_trainer<E, Traits, Tracer, Strategy, Comm>::optimize(learning_rates const& rates, int degree, Rows&& rows) {
  bool const use_mcmc = options_.densify == densify_kind::mcmc, use_adc = options_.densify == densify_kind::adc;
  if (grows_by_error()) error_.add_penalty(scene_, gradients_, total_);
  if (use_mcmc) mcmc_.add_penalties(scene_, gradients_, total_);
  adam_pass<E> const adam(scene_, gradients_, state_, rates, step_, degree, finite_ ? finite_->skipped() : span<u64>{},
                          options_.adam, options_.batch);
  if constexpr (Comm::alone)
    adam.all(exec_);
  else
    move_parameters(adam);
  span<float const> filter;
  bool const densifies = grows_by_error() ? error_.due(step_)
                         : use_mcmc       ? mcmc_.due(step_)
                                          : use_adc && adc_.due(step_);
  if (options_.render.antialias > 0 && densifies) {
    std::vector<std::size_t> const views = views_trained_on(data_.train.size(), options_.held_out);
    filter = min_pixel_filter_.of(
        exec_, scene_.view(), views.size(), [&](std::size_t k) { return seen_by(views[k]); },
        options_.render.antialias);
  }
  density_change change;
  if (grows_by_error()) change = error_.after_step(scene_, state_, step_, rows, filter);
  if (use_mcmc) change = mcmc_.after_step(scene_, state_, step_, rates.mean, rows, filter);
  if (use_adc) change = adc_.after_step(scene_, state_, step_, rows, filter);
  total_ += change.added - change.removed;
  if (!change.added && !change.removed) return;
  gradients_.resize_keep(scene_.size());
  if constexpr (!Comm::alone) shards_.arrived.reset();
}

template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
vec3 basic_trainer<E, Traits, Tracer, Strategy, Comm>::background_of(int step) const {
  switch (options_.background) {
    case background_kind::black:
      return vec3(0.0f);
    case background_kind::white:
      return vec3(1.0f);
    default: {
      auto const w = random_source{options_.seed ^ 0x6261636bu, static_cast<u32>(step), random_use::user}.words(0);
      return {uniform(w.v[0]), uniform(w.v[1]), uniform(w.v[2])};
    }
  }
}

template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
rendered basic_trainer<E, Traits, Tracer, Strategy, Comm>::render(camera const& view, vec3 background) {
  if constexpr (!Comm::alone)
    if (in_ranks()) return render_in_ranks(view, background);
  frame_.prepare(std::as_const(scene_).view(), view, render_options_of(options_, data_.extent, background), degree_);
  return render_image(frame_);
}

template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
image8 basic_trainer<E, Traits, Tracer, Strategy, Comm>::render_8bit(camera const& view, vec3 background) {
  if constexpr (!Comm::alone)
    if (in_ranks()) return to_8bit(render_in_ranks(view, background).color);
  frame_.prepare(std::as_const(scene_).view(), view, render_options_of(options_, data_.extent, background), degree_);
  return render_image_8bit(frame_);
}

template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
exposure_field basic_trainer<E, Traits, Tracer, Strategy, Comm>::exposures() const {
  std::vector<view_exposure> views;
  exposure_state const learned = exposures_ ? exposures_->state() : exposure_state{};
  for (std::size_t i = 0; i < learned.visits.size(); ++i) {
    if (learned.visits[i] == 0) continue;
    dataset_view const& v = data_.train[i];
    view_exposure e{v.name, v.view.position, v.view.rotation[2], {}};
    std::copy_n(learned.value.data() + i * exposure::floats, exposure::floats, e.value.m);
    views.push_back(std::move(e));
  }
  std::vector<lens_falloff> lenses;
  vignetting_state const falloffs = vignetting_ ? vignetting_->state() : vignetting_state{};
  for (std::size_t i = 0; i < falloffs.visits.size(); ++i) {
    if (falloffs.visits[i] == 0) continue;
    vignetting v;
    std::copy_n(falloffs.value.data() + i * vignetting::floats, vignetting::floats, v.k);
    lenses.emplace_back(vignetting_->lenses()[i], v);
  }
  return exposure_field(std::move(views), std::move(lenses));
}

template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
std::vector<named_camera> basic_trainer<E, Traits, Tracer, Strategy, Comm>::poses() const {
  std::vector<named_camera> out;
  for (std::size_t i = 0; (poses_ || lenses_) && i < data_.train.size(); ++i)
    out.push_back({data_.train[i].name, seen_by(i)});
  return out;
}

}  // namespace gart::inline GART_ISA
