#pragma once
/// \file
/// The bodies of trainer.hpp that several ranks, or a batch of views, have in place of those of one: a step, and a
/// view rendered by all.

#include <gart/train/trainer.hpp>

#include <cmath>
#include <limits>

namespace gart::inline GART_ISA {

namespace train_kernels {

// Sums over the views of a batch, and their mean with the last.
struct add_gradients_body {
  gaussians_view<float> sum, view;
  float share;
  GART_KERNEL void operator()(index_t row, index_t column) const {
    float& to = row_element(sum, row, column);
    to = (to + row_element(view, row, column)) * share;
  }
};

}  // namespace train_kernels

template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
void basic_trainer<E, Traits, Tracer, Strategy, Comm>::require_ranks() const {
  if (options_.batch < 1)
    throw invalid_argument("train_options.batch is " + std::to_string(options_.batch) + ": at least 1");
  if (options_.shard_block < 1) throw invalid_argument("train_options.shard_block is 0: at least 1");
  if (comm_.size() == 1 && options_.batch == 1) return;
  if constexpr (Comm::alone) throw invalid_argument("train_options.batch needs a trainer that has a communicator");
  if (options_.refine_poses && options_.shard_block % pose_differentiation<E>::run != 0)
    throw invalid_argument("train_options.shard_block is " + std::to_string(options_.shard_block) +
                           ": with refine_poses a multiple of " + std::to_string(pose_differentiation<E>::run));
}

template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
learning_rates basic_trainer<E, Traits, Tracer, Strategy, Comm>::rates_of_step() const {
  return rates_at(options_.rates, data_.extent, step_, options_.iterations);
}

// A step over options.batch views, in as many rounds as it takes all ranks to trace them.
template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
step_report basic_trainer<E, Traits, Tracer, Strategy, Comm>::step_in_ranks(loss_function<E> const* loss) requires(
    !Comm::alone) {
  int const degree = sh_degree_at(step_, degree_, options_.sh_every, options_.iterations);
  learning_rates const rates = rates_of_step();
  int const ranks = comm_.size(), batch = options_.batch, before = step_;
  bool const learn_poses = learns_poses(), learn_lenses = learns_lenses();
  std::vector<image_result> images(static_cast<std::size_t>(batch));  // of the step, in their order
  lt_bytes_ = 0, shards_.arrived.reset();
  shrink_ = shrink_at(options_.resolution, step_, options_.iterations);
  step_report report;
  auto shown = dropout_.leave_out(scene_, before, options_.iterations, shards_.rows.owners());
  for (int done = 0; done < batch;) {
    int const views = std::min(batch - done, ranks);
    span<image_result> const round =
        span<image_result>(images).subspan(static_cast<std::size_t>(done), static_cast<std::size_t>(views));
    std::vector<camera> cameras;
    std::vector<std::size_t> names;
    for (int v = 0; v < views; ++v) {
      std::size_t const index = round.data()[v].view = order_.at(before + done + v);
      cameras.push_back(traced(index));
      // What a view costs is remembered of each size of its image.
      names.push_back(index + data_.train.size() * static_cast<std::size_t>(shrink_of_view(index)));
    }
    // Near distance and the like are those of any view; the background is the view's own.
    shards_.round.fetch(std::as_const(scene_).view(), cameras, names, render_options_of(options_, data_.extent));
    int const mine = shards_.round.unit().view;
    trace_unit(loss, cameras[static_cast<std::size_t>(mine)], done + mine, degree, round.data()[mine], report);
    take_gradients(cameras, done, round, learn_poses);
    done += views;
    if (done < batch) collect_results(round, learn_poses, learn_lenses);
  }
  shards_.sent += shards_.round.take_traffic();
  step_ += batch;
  float const batch_scale = std::sqrt(static_cast<float>(batch));
  learning_rates scaled_rates = rates;
  if (batch > 1)
    for (float* rate : {&scaled_rates.mean, &scaled_rates.log_scale, &scaled_rates.quaternion, &scaled_rates.opacity,
                        &scaled_rates.sh_dc, &scaled_rates.sh_rest})
      *rate *= batch_scale;
  shown.end();
  optimize(scaled_rates, degree, shards_.rows);
  // Read when all is queued: a device that waits for its host to read has nothing to do.
  std::size_t const last = static_cast<std::size_t>((batch - 1) / ranks * ranks);
  collect_results(span<image_result>(images).subspan(last, images.size() - last), learn_poses, learn_lenses);
  // From what each image said of the exposures, poses and lenses that the step began with, whoever traced it.
  for (int k = 0; k < batch; ++k) {
    image_result const& image = images[static_cast<std::size_t>(k)];
    if (exposures_) exposures_->move(image.view, {image.by_exposure, exposure::floats}, rates.exposure);
    if (vignetting_) vignetting_->move_lens_of(image.view, {image.by_falloff, vignetting::floats}, rates.vignetting);
    if (learn_poses) poses_->step(image.view, image.by_pose, before + k, options_.iterations);
    if (learn_lenses)
      lenses_->step(image.view, lens_gradient(image.by_lens, shrink_of_view(image.view)), before + k,
                    options_.iterations);
  }

  report.step = step_, report.gaussians = total_, report.view = data_.train[images.back().view].name;
  if (finite_) {
    u64 skipped = (*finite_)(scene_, state_, "step " + std::to_string(step_) + ", view " + report.view);
    comm_.all_reduce(span<u64>(&skipped, 1));
    report.skipped = skipped;
  }
  double sum = 0, square = 0;
  for (image_result const& image : images) sum += double{image.loss}, square += double{image.mean_square};
  report.loss = static_cast<float>(sum / batch);
  float const mean_square = static_cast<float>(square / batch);
  report.psnr = mean_square > 0 ? -10.0f * std::log10(mean_square) : 99.0f;
  return report;
}

// This rank's unit of a round: its rows of the image, the loss of the whole, its sums of the gradients.
template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
void basic_trainer<E, Traits, Tracer, Strategy, Comm>::trace_unit(loss_function<E> const* loss, camera const& seen,
                                                                  int image, int degree, image_result& result,
                                                                  step_report& report) requires(!Comm::alone) {
  std::size_t const index = result.view;
  dataset_view const& view = data_.train[index];
  std::size_t const pixels = static_cast<std::size_t>(seen.width) * seen.height;
  color_.resize(3 * pixels), color_gradient_.resize(3 * pixels);
  vec3 const background = background_of(step_ + image);
  work_unit const unit = shards_.round.unit();
  image_targets targets;
  targets.color = color_.data();
  bool const measures = learns_poses() && poses_->wants_metric(index), learn_lenses = learns_lenses();
  depth_and_transmittance more;  // of the image
  image_gradients gradient{color_gradient_};
  if constexpr (has_depth<Strategy>) {
    supervision_.begin(targets, pixels), gradient = supervision_.gradients(color_gradient_);
    more = {targets.depth, targets.transmittance};
  } else if (measures) {
    depth_.resize(pixels), transmittance_.resize(pixels);
    targets.depth = depth_.data(), targets.transmittance = transmittance_.data();
  }
  auto const share = [&](float* plane) { shards_.round.share_image(plane, seen, sizeof(float)); };
  span<float> const by_lens = value_.view().subspan(2 + pose_gradient::floats, lens_gradient::floats);
  shards_.loss_by_strips = !loss && !exposures_ && !vignetting_ && !targets.depth && !learn_lenses;
  auto const by_image = [&] {
    stage_scope stage(exec_, "loss");
    if (shards_.loss_by_strips) return differentiate_strip(seen, images_.get(index, background, shrink_of_view(index)));
    shards_.round.share_image(color_.data(), seen, 3 * sizeof(float));
    if (targets.depth) share(targets.depth), share(targets.transmittance);
    span<float const> const shown = photographed(index);
    truth_view const truth = images_.get(index, background, shrink_of_view(index));
    depth_pixels depth;
    if constexpr (has_depth<Strategy>)
      supervision_.evaluate(index, truth, shrink_of_view(index)), depth = supervision_.pixels();
    evaluate(loss,
             {exec_, view, truth, seen.width, seen.height, shown, color_gradient_, value_.view().subspan(0, 2), depth});
    if (grows_by_error()) error_map(exec_, shown, truth, error_map_);
    if (exposures_) shards_.by_exposure = exposures_->differentiate(index, through_lens(), color_gradient_);
    if (vignetting_) shards_.by_falloff = vignetting_->differentiate(index, captured(index), color_, color_gradient_);
  };
  if (unit.empty()) {
    shards_.round.finish_fetch();
    by_image();
    if (learn_lenses) lens_backward_.of_others(pixels, by_lens, share);
    shards_.round.give_nothing_back(Strategy::ordered);
    return;
  }
  render_options render = render_options_of(options_, data_.extent, background);
  render.rows = unit.rows;
  frame_.prepare(shards_.round.scene(), seen, render, degree);
  shards_.round.finish_fetch();
  gaussians<E>& sums = shards_.unit_gradients;
  sums.resize_keep(shards_.round.scene().count);
  passes_.with_room(frame_, options_.lt_budget, [&]<class Pass>(Pass& pass) {
    if constexpr (Strategy::ordered && !Pass::ordered) {
      throw pass.out_of_memory_error();
    } else {
      pass.render(frame_, targets);
      by_image();
      sum_gradients(frame_, pass, gradient, sums.view(), error_map_);
      if (learn_lenses) lens_backward_(frame_, color_, gradient, by_lens, more, share);
      if (shards_.round.finishes())
        finish_gradients(exec_, frame_.scene(), frame_.gaussians(), frame_.view(), render.antialias, pass.moments(),
                         sums.view());
      shards_.round.give_back(pass, std::as_const(sums).view());
      lt_bytes_ = std::max(lt_bytes_, pass.lt_bytes()), report.backward = Pass::strategy_type::name;
    }
  });
}

// The loss of this rank's strip alone, where nobody asks for the whole image: its own rows and those that windows reach
// come from the others, and the sums of the loss go to them, while gradients are gathered.
template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
void basic_trainer<E, Traits, Tracer, Strategy, Comm>::differentiate_strip(
    camera const& seen, truth_view const& truth) requires(!Comm::alone) {
  auto const rows = [&](work_unit const& unit) { return rows_in(unit, seen.height); };
  shards_.round.share_image(color_.data(), seen, 3 * sizeof(float),
                            [&](work_unit const& unit) { return image_loss<E>::reads(rows(unit), seen.height); });
  image_rows const mine = rows(shards_.round.unit());
  loss_.differentiate(color_, truth, seen.width, seen.height, options_.ssim_weight, color_gradient_, mine);
  if (grows_by_error()) error_map(exec_, color_, truth, error_map_, mine, seen.width);
  shards_.round.begin_sharing({loss_.sums(0), loss_.sums(1)}, image_loss<E>::sums_of({}, seen.height).end,
                              [&](work_unit const& unit) { return image_loss<E>::sums_of(rows(unit), seen.height); });
}

// What this rank has found of the image that it traced last.
template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
void basic_trainer<E, Traits, Tracer, Strategy, Comm>::read_result(image_result& result, bool metric,
                                                                   bool lens) requires(!Comm::alone) {
  if (shards_.loss_by_strips) loss_.total(value_.view().subspan(0, 2));
  float values[2];
  exec_.copy_out(values, value_.data(), sizeof values);
  result.loss = values[0], result.mean_square = values[1];
  if (exposures_) exec_.copy_out(result.by_exposure, shards_.by_exposure.data(), sizeof result.by_exposure);
  if (vignetting_) exec_.copy_out(result.by_falloff, shards_.by_falloff.data(), sizeof result.by_falloff);
  if (lens) exec_.copy_out(result.by_lens, value_.data() + 2 + pose_gradient::floats, sizeof result.by_lens);
  bool const measures = metric && poses_->wants_metric(result.view);
  if constexpr (has_depth<Strategy>) {
    result.loss += supervision_.value();
    if (measures) result.metric = pose_metric_of(result.view, supervision_.depth(), supervision_.transmittance());
  } else if (measures) {
    result.metric = pose_metric_of(result.view, depth_.to_host(), transmittance_.to_host());
  }
}

// What the first rank of each of the round's views has found, to all; by_pose all have.
template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
void basic_trainer<E, Traits, Tracer, Strategy, Comm>::collect_results(span<image_result> round, bool metrics,
                                                                       bool lens) requires(!Comm::alone) {
  image_result& mine = round.data()[shards_.round.unit().view];
  read_result(mine, metrics, lens);
  std::vector<image_result> all(static_cast<std::size_t>(comm_.size()));
  comm_.all_gather(&mine, all.data(), sizeof(image_result));
  for (std::size_t rank = all.size(); rank-- > 0;) {
    image_result& to = round.data()[shards_.round.units()[rank].view];
    pose_gradient const by_pose = to.by_pose;
    to = all[rank], to.by_pose = by_pose;
  }
  for (std::size_t v = 0; metrics && v < round.size(); ++v) {
    image_result const& found = round.data()[v];
    if (poses_->wants_metric(found.view)) poses_->set_metric(found.view, found.metric);
  }
}

// From the sums over the pixels of the round's views, of which the first is the image'th of the step, to gradients of
// this rank's rows. Colours are added over all views at once, but where each view's are asked for: by its pose.
template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
void basic_trainer<E, Traits, Tracer, Strategy, Comm>::take_gradients(std::vector<camera> const& views, int image,
                                                                      span<image_result> round,
                                                                      bool learn_poses) requires(!Comm::alone) {
  index_t const n = scene_.size();
  int const count = static_cast<int>(views.size());
  auto const share_after = [&](int images) {
    return images == options_.batch ? 1.0f / static_cast<float>(options_.batch) : 1.0f;
  };
  // Whether a view's own gradients are asked for by nobody, and those of all are added as they come.
  bool const finishes = shards_.round.finishes(),
             at_once = finishes && !learn_poses && options_.densify != densify_kind::adc;
  gradients_.resize_keep(n);
  if (!finishes) shards_.moments.resize(std::size_t{moment_stride} * n), shards_.prepared.resize(n);
  if (options_.batch > 1 && !at_once) shards_.view_gradients.resize_keep(n);
  bool const adds = image > 0;
  auto const scene = std::as_const(scene_).view();
  float* const errors = finishes && grows_by_error() ? error_.statistic_of(n).data() : nullptr;
  if (at_once)
    shards_.round.sum_finished(0, count, share_after(image + count), gradients_.view(), errors, adds), image += count;
  for (int v = 0; v < count && !at_once; ++v, ++image) {
    camera const& view = views[static_cast<std::size_t>(v)];
    gaussians<E>& to = image == 0 ? gradients_ : shards_.view_gradients;
    if (learn_poses) shards_.round.sum_colors(v, v + 1, 1, to.sh.view(), false);
    if (finishes) {
      shards_.round.sum_finished(v, v + 1, 1, to.view(), errors, false);
    } else {
      shards_.round.sum_moments(v, shards_.moments.view());
      auto const seen = shards_.filter.of(exec_, scene, view, options_.render.antialias);
      parallel_for(exec_, "preprocess", n,
                   render_kernels::prepare_gaussians<typename Traits::response>{
                       seen, view.position, options_.render.alpha_min, shards_.prepared.view()});
      finish_gradients(exec_, scene, shards_.prepared, view, options_.render.antialias, shards_.moments, to.view());
      if (grows_by_error()) error_.add_errors(scene_, shards_.moments);
    }
    if (options_.densify == densify_kind::adc) adc_.accumulate(scene_, to, view);
    if (learn_poses) {
      span<double const> const runs =
          pose_backward_.template sum_runs<sh_degree>(scene, std::as_const(to).view(), view.position);
      std::vector<double> mine(runs.size());
      exec_.copy_out(mine.data(), runs.data(), runs.size() * sizeof(double));
      round.data()[v].by_pose = pose_backward_.total(shards_.pose_runs.whole_of(mine, pose_gradient::floats));
    }
    if (image > 0)
      for_each_column(exec_, "batch/add", n, learn_poses ? row_width(sh_degree) : geometry_columns + 1,
                      train_kernels::add_gradients_body{gradients_.view(), to.view(), share_after(image + 1)});
  }
  // Last: they arrive last. A device's Adam takes the step's last ones as they come: 8 bytes less to move an element.
  if (learn_poses) return;
  if (E::device && image == options_.batch)
    shards_.arrived = {count, share_after(image), adds};
  else
    shards_.round.sum_colors(0, count, share_after(image), gradients_.sh.view(), adds);
}

// Adam's step, while the last colours arrive.
template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
void basic_trainer<E, Traits, Tracer, Strategy, Comm>::move_parameters(adam_pass<E> const& adam) requires(
    !Comm::alone) {
  if (!shards_.arrived) return adam.all(exec_);
  adam.geometry(exec_);
  auto const [views, share, adds] = *shards_.arrived;
  adam.colors([&](auto const& take) {
    shards_.round.take_colors(0, views, share, gradients_.sh.view(), adds, "adam/colors", take);
  });
}

// Into gradients_.sh, for who asks for it.
template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
void basic_trainer<E, Traits, Tracer, Strategy, Comm>::sum_arrived() const requires(!Comm::alone) {
  if (auto const arrived = std::exchange(shards_.arrived, {}))
    shards_.round.sum_colors(0, arrived->views, arrived->share, gradients_.sh.view(), arrived->adds);
}

template <execution E, class Traits, class Tracer, strategy Strategy, communicator<E> Comm>
rendered basic_trainer<E, Traits, Tracer, Strategy, Comm>::render_in_ranks(camera const& view,
                                                                           vec3 background) requires(!Comm::alone) {
  render_options render = render_options_of(options_, data_.extent, background);
  auto& round = shards_.round;
  sum_arrived();  // before what they are made of goes
  round.fetch(std::as_const(scene_).view(), {view}, {}, render);
  render.rows = round.unit().rows;
  bool const traces = !round.unit().empty();
  std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
  buffer<float, E> color(exec_, 3 * pixels), transmittance(exec_, pixels), depth(exec_, pixels);
  buffer<u32, E> hits(exec_, pixels);
  if (traces) frame_.prepare(round.scene(), view, render, degree_);
  round.finish_fetch();
  if (traces) {
    frame_.render({color.data(), transmittance.data(), depth.data(), hits.data()});
  }
  round.share_image(color.data(), view, 3 * sizeof(float)),
      round.share_image(transmittance.data(), view, sizeof(float));
  round.share_image(depth.data(), view, sizeof(float)), round.share_image(hits.data(), view, sizeof(u32));
  round.take_traffic();
  return rendered_of(view, color, transmittance, depth, hits);
}

}  // namespace gart::inline GART_ISA
