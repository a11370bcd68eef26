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

template <execution E, class Traits, class Tracer, strategy Strategy, class Comm>
void basic_trainer<E, Traits, Tracer, Strategy, Comm>::require_ranks() const {
  auto const refuse = [](std::string const& what) {
    throw invalid_argument(what + " with several ranks, or a batch of views");
  };
  if (options_.batch < 1)
    throw invalid_argument("train_options.batch is " + std::to_string(options_.batch) + ": at least 1");
  if (options_.shard_block < 1) throw invalid_argument("train_options.shard_block is 0: at least 1");
  if (comm_.size() == 1 && options_.batch == 1) return;
  if constexpr (Comm::alone)
    refuse("train_options.batch needs a trainer that has a communicator; self_comm has no step");
  if (options_.densify == densify_kind::adc)
    refuse("train_options.densify = adc does not train yet; take mcmc or error");
  if (options_.refine_poses) refuse("train_options.refine_poses is not there");
  if (options_.refine_lens) refuse("train_options.refine_lens is not there");
  if (options_.exposure && options_.batch > 1)
    throw invalid_argument("train_options.exposure is learned a view a step: take train_options.batch = 1");
  if (has_depth<Strategy> || options_.depth_weight > 0) refuse("train_options.depth_weight is not there");
}

template <execution E, class Traits, class Tracer, strategy Strategy, class Comm>
learning_rates basic_trainer<E, Traits, Tracer, Strategy, Comm>::rates_of_step() const {
  learning_rates rates = options_.rates;
  rates.sh_rest = sh_rest_of(rates, data_.points.size() > 0, options_.iterations);
  return rates_at(rates, data_.extent, step_, options_.iterations);
}

// A step over options.batch views, in as many rounds as it takes all ranks to trace them.
template <execution E, class Traits, class Tracer, strategy Strategy, class Comm>
step_report basic_trainer<E, Traits, Tracer, Strategy, Comm>::step_in_ranks(loss_function<E> const& loss) requires(
    !Comm::alone) {
  int const degree = sh_degree_at(step_, sh_degree, options_.sh_every, options_.iterations);
  learning_rates rates = rates_of_step();
  int const ranks = comm_.size(), batch = options_.batch;
  std::vector<float> values;  // of each view: loss, mean squared error
  std::string name;
  lt_bytes_ = 0;
  step_report report;
  for (int done = 0; done < batch;) {
    int const views = std::min(batch - done, ranks);
    std::vector<std::size_t> indices;
    std::vector<camera> cameras;
    for (int v = 0; v < views; ++v) {
      indices.push_back(order_.at(step_ + done + v));
      cameras.push_back(data_.train[indices.back()].view);
    }
    // Near distance and the like are those of any view; the background is the view's own.
    shards_.round.fetch(std::as_const(scene_).view(), cameras, render_options_of(options_, data_.extent));
    int const mine = shards_.round.unit().view;
    trace_unit(loss, indices[static_cast<std::size_t>(mine)], done + mine, degree, rates, report);
    gather_values(views, values);
    for (int v = 0; v < views; ++v) take_gradients(cameras[static_cast<std::size_t>(v)], v, done + v);
    name = data_.train[indices.back()].name;
    done += views;
  }
  shards_.sent += shards_.round.take_traffic();
  step_ += batch;
  float const haste = std::sqrt(static_cast<float>(batch));
  if (batch > 1)
    for (float* rate : {&rates.mean, &rates.log_scale, &rates.quaternion, &rates.opacity, &rates.sh_dc, &rates.sh_rest})
      *rate *= haste;
  optimize(rates, degree, shards_.rows);

  if (finite_) {
    u64 skipped = (*finite_)(scene_, state_, "step " + std::to_string(step_) + ", view " + name);
    comm_.all_reduce(span<u64>(&skipped, 1));
    report.skipped = skipped;
  }
  report.step = step_, report.gaussians = total_, report.view = name;
  double sum = 0, square = 0;
  for (std::size_t v = 0; v < values.size(); v += 2) sum += double{values[v]}, square += double{values[v + 1]};
  report.loss = static_cast<float>(sum / batch);
  float const mean_square = static_cast<float>(square / batch);
  report.psnr = mean_square > 0 ? -10.0f * std::log10(mean_square) : 99.0f;
  return report;
}

// This rank's unit of a round: its rows of the image, the loss of the whole, its sums of the gradients.
template <execution E, class Traits, class Tracer, strategy Strategy, class Comm>
void basic_trainer<E, Traits, Tracer, Strategy, Comm>::trace_unit(loss_function<E> const& loss, std::size_t index,
                                                                  int image, int degree, learning_rates const& rates,
                                                                  step_report& report) requires(!Comm::alone) {
  dataset_view const& view = data_.train[index];
  std::size_t const pixels = static_cast<std::size_t>(view.view.width) * view.view.height;
  color_.resize(3 * pixels), color_gradient_.resize(3 * pixels);
  vec3 const background = background_of(step_ + image);
  work_unit const unit = shards_.round.unit();
  auto const by_image = [&] {
    stage_scope stage(exec_, "loss");
    shards_.round.share_image(color_.data(), view.view, 3 * sizeof(float));
    span<float const> const shown = exposures_ ? exposures_->expose(index, color_) : span<float const>(color_);
    truth_view const truth = images_.get(exec_, index, background);
    loss(loss_input<E>{exec_, view, truth, view.view.width, view.view.height, shown, color_gradient_,
                       value_.view().subspan(0, 2), depth_pixels{}});
    if (grows_by_error()) error_map(exec_, shown, truth, error_map_);
    if (exposures_) exposures_->step(index, color_, color_gradient_, rates.exposure);
  };
  if (unit.empty()) {
    by_image();
    shards_.round.give_nothing_back(Strategy::ordered);
    return;
  }
  render_options render = render_options_of(options_, data_.extent, background);
  render.rows = unit.rows;
  frame_.prepare(shards_.round.scene(), view.view, render, degree);
  gaussians<E>& sums = shards_.unit_gradients;
  sums.resize_keep(shards_.round.scene().count);
  passes_.with_room(frame_, options_.lt_budget, [&]<class Pass>(Pass& pass) {
    if constexpr (Strategy::ordered && !Pass::ordered) {
      throw pass.no_room();
    } else {
      pass.render(frame_, {.color = color_.data()});
      by_image();
      sum_gradients(frame_, pass, {color_gradient_}, sums.view(), error_map_);
      shards_.round.give_back(pass, sums.sh.data());
      lt_bytes_ = std::max(lt_bytes_, pass.lt_bytes()), report.backward = Pass::strategy_type::name;
    }
  });
}

// What the loss was of each view of the round.
template <execution E, class Traits, class Tracer, strategy Strategy, class Comm>
void basic_trainer<E, Traits, Tracer, Strategy, Comm>::gather_values(int views, std::vector<float>& values) requires(
    !Comm::alone) {
  std::vector<float> const mine = value_.to_host();
  std::vector<float> all(2 * static_cast<std::size_t>(comm_.size()));
  comm_.all_gather(mine.data(), all.data(), 2 * sizeof(float));
  for (int v = 0; v < views; ++v) {
    std::size_t rank = 0;  // the first that has the view
    while (shards_.round.units()[rank].view != v) ++rank;
    values.push_back(all[2 * rank]), values.push_back(all[2 * rank + 1]);
  }
}

// From the sums over the pixels of the round's view v, which is the image'th of the step, to gradients of this rank's
// rows.
template <execution E, class Traits, class Tracer, strategy Strategy, class Comm>
void basic_trainer<E, Traits, Tracer, Strategy, Comm>::take_gradients(camera const& view, int v,
                                                                      int image) requires(!Comm::alone) {
  index_t const n = scene_.size();
  gaussians<E>& to = image == 0 ? gradients_ : shards_.view_gradients;
  to.resize_keep(n), shards_.moments.resize(std::size_t{moment_stride} * n), shards_.prepared.resize(n);
  shards_.round.sum(v, to.sh.data(), shards_.moments.data(), n);
  auto const scene = std::as_const(scene_).view();
  auto const seen = shards_.filter.of(exec_, scene, view, options_.render.antialias);
  parallel_for(exec_, "preprocess", n,
               render_kernels::prepare_gaussians<typename Traits::response>{
                   seen, view.position, options_.render.alpha_min, shards_.prepared.view()});
  finish_gradients(exec_, scene, shards_.prepared, view, options_.render.antialias, shards_.moments, to.view());
  if (grows_by_error()) error_.add_errors(scene_, shards_.moments);
  if (image > 0)
    for_each_element(exec_, "batch/add", n, sh_degree,
                     train_kernels::add_gradients_body{
                         gradients_.view(), to.view(),
                         image + 1 == options_.batch ? 1.0f / static_cast<float>(options_.batch) : 1.0f});
}

template <execution E, class Traits, class Tracer, strategy Strategy, class Comm>
rendered basic_trainer<E, Traits, Tracer, Strategy, Comm>::render_in_ranks(camera const& view,
                                                                           vec3 background) requires(!Comm::alone) {
  render_options render = render_options_of(options_, data_.extent, background);
  auto& round = shards_.round;
  round.fetch(std::as_const(scene_).view(), {view}, render);
  render.rows = round.unit().rows;
  std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
  buffer<float, E> color(exec_, 3 * pixels), transmittance(exec_, pixels), depth(exec_, pixels);
  buffer<u32, E> hits(exec_, pixels);
  if (!round.unit().empty()) {
    frame_.prepare(round.scene(), view, render);
    frame_.render({color.data(), transmittance.data(), depth.data(), hits.data()});
  }
  round.share_image(color.data(), view, 3 * sizeof(float)),
      round.share_image(transmittance.data(), view, sizeof(float));
  round.share_image(depth.data(), view, sizeof(float)), round.share_image(hits.data(), view, sizeof(u32));
  round.take_traffic();
  return rendered_of(view, color, transmittance, depth, hits);
}

}  // namespace gart::inline GART_ISA
