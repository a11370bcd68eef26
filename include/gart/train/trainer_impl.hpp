#pragma once
/// \file
/// Template bodies of trainer.hpp: how a run is made, a step, and the views that it renders.

#include <gart/io/image_file.hpp>
#include <gart/train/trainer.hpp>

#include <algorithm>
#include <cmath>

namespace gart { inline namespace GART_ISA {

template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
basic_trainer<E, Traits, Tracer, Method, Comm>::basic_trainer(E& exec, train_options const& options,
                                                              dataset const& data, start_model const& start, Comm comm)
    : exec_(exec),
      options_(checked(exec, comm, options, data, start)),
      data_(data),
      comm_(std::move(comm)),
      plans_{{}, {exec, comm_, options.shard_block}},
      gaussians_(exec, local_part(start), sh_degree),
      tracing_{frame_type(exec), backward_passes<frame_type, Method>(exec)},
      views_{{exec, data}, {data.train.size(), options.held_out, options.seed}, min_pixel_filter<E>(exec)},
      image_(exec),
      dropout_(exec, options.dropout, options.dropout_until, options.seed) {
  gaussians_.total = static_cast<index_t>(total_of(comm_, start));
  make_room();
  if (views_.order.empty()) throw invalid_argument("trainer: there are no training views, or all are held out");
  if (options.check_finite) {
    if constexpr (Comm::alone)
      finite_.emplace(exec);
    else
      finite_.emplace(exec, plans_.ranks.rows().owners());
  }
  // Sums in a fixed order were asked for: no budget of our own takes them away.
  if (options.hit_memory == 0 && !Method::ordered)
    options_.hit_memory = exec.free_bytes() / 2 / static_cast<u64>(comm_.sharers());
  parts_ = make_learned_parts<frame_type, has_depth<Method>>(exec, options, data, in_ranks());
  densify_by(make_densifier(exec, density_setup{options, data, gaussians_.total, Traits::response::degree}));
}

// For all that the run is to grow to, at once.
template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
void basic_trainer<E, Traits, Tracer, Method, Comm>::make_room() {
  u64 here = gaussians_at_end(options_, data_, gaussians_.total);
  if constexpr (!Comm::alone) here = plans_.ranks.rows().owners().owned(here);
  gaussians_.reserve(here);
  dropout_.reserve(here);
  if (options_.render.antialias > 0) views_.filter.reserve(here);
}

template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
void basic_trainer<E, Traits, Tracer, Method, Comm>::densify_by(std::unique_ptr<densifier<E>> own) {
  if (!own) throw invalid_argument("trainer.densify_by: there is no densifier; give one that does nothing");
  densifier_ = std::move(own);
  densifier_->set_batch(options_.batch);
}

template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
void basic_trainer<E, Traits, Tracer, Method, Comm>::set_iterations(int iterations) {
  if (iterations == options_.iterations) return;
  options_.iterations = iterations;
  densifier_->set_iterations(iterations);
}

template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
void basic_trainer<E, Traits, Tracer, Method, Comm>::resize(index_t total) {
  index_t const before = gaussians_.size();
  index_t here = total;
  if constexpr (!Comm::alone) here = plans_.ranks.rows().here(total), plans_.ranks.end_step(true);
  gaussians_.resize(here), gaussians_.total = total;
  gaussians_.clear_from(exec_, before);
}

template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
step_report basic_trainer<E, Traits, Tracer, Method, Comm>::step_by(loss_function<E> const* loss) {
  step_report const report = [&] {
    if constexpr (!Comm::alone)
      if (in_ranks()) return step_on(plans_.ranks, loss);
    return step_on(plans_.whole, loss);
  }();
  if (progress_.hooks.after_step) progress_.hooks.after_step(report);
  return report;
}

// A step over options.batch views, in as many rounds as it takes all ranks to trace them.
template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
template <class Plan>
step_report basic_trainer<E, Traits, Tracer, Method, Comm>::step_on(Plan& plan, loss_function<E> const* loss) {
  int const before = progress_.step, batch = options_.batch, iterations = options_.iterations;
  int const degree = sh_degree_at(before, gaussians_.degree, options_.sh_every, iterations);
  learning_rates rates = rates_at(options_.rates, data_.extent, before, iterations);
  if (progress_.hooks.rates) progress_.hooks.rates(rates, before);
  step_report report;
  progress_.hit_buffer_bytes = 0;
  plan.begin_step();
  std::size_t const width = numbers(parts_.size());
  image_.numbers.resize(width * static_cast<std::size_t>(batch)), image_.numbers.zero();
  std::vector<float> found(image_.numbers.size());  // a row for each image
  std::vector<step_view> images;
  for (int k = 0; k < batch; ++k) images.push_back(view_of(before, k));
  auto const row = [&](auto&& rows, int image) { return rows.subspan(static_cast<std::size_t>(image) * width, width); };
  int mine = 0;  // this rank's image of the round
  auto const send = [&] {
    span<float> const device = row(image_.numbers.view(), mine);
    plan.finish_loss(image_, device.subspan(0, 2));
    return early_copy<E>(exec_, device.data(), width * sizeof(float));
  };
  auto const collect = [&](early_copy<E> sent, int first) {
    span<float> const host = row(span<float>(found), mine);
    sent.read(host.data());
    for (std::size_t i = 0; i < parts_.size(); ++i)
      parts_[i]->found(images[static_cast<std::size_t>(mine)], numbers_of(host, i));
    plan.collect(found, width, first);
  };

  auto shown = dropout_.leave_out(gaussians_.model, before, iterations, plan.rows().owners());
  int last = 0;
  for (int done = 0; done < batch;) {
    int const views = std::min(batch - done, plan.views());
    std::vector<camera> cameras;
    std::vector<std::size_t> names;
    part_needs round;
    for (int v = 0; v < views; ++v) {
      step_view const& view = images[static_cast<std::size_t>(done + v)];
      cameras.push_back(view.seen);
      // The cost of a view is remembered for each size of its image.
      names.push_back(view.index + data_.train.size() * static_cast<std::size_t>(view.shrink));
      for (auto const& part : parts_) round.gradients |= part->needs(view.index, before, iterations).gradients;
    }
    // Near distance and the like are those of any view; the background is the view's own.
    render_options const options = render_options_of(options_, data_.extent);
    plan.fetch(std::as_const(gaussians_.model).view(), cameras, names, options);
    mine = done + plan.unit().view;
    trace(plan, loss, images[static_cast<std::size_t>(mine)], mine, degree, report);
    plan.take(exec_, gaussians_, cameras, done, batch, options, *densifier_, round.gradients,
              [&](int v, gaussians<E> const& by_view) {
                camera const& seen = cameras[static_cast<std::size_t>(v)];
                if (densifier_->by_gradient()) densifier_->observe(gaussians_.model, by_view, seen);
                if (!round.gradients) return;
                for (std::size_t i = 0; i < parts_.size(); ++i)
                  if (parts_[i]->needs(images[static_cast<std::size_t>(done + v)].index, before, iterations).gradients)
                    parts_[i]->after_gradients(std::as_const(gaussians_.model).view(), by_view.view(), seen,
                                               plan.rows(), numbers_of(row(image_.numbers.view(), done + v), i));
              });
    last = done, done += views;
    if (done < batch) collect(send(), last);
  }
  if constexpr (requires { plan.take_traffic(); }) progress_.sent += plan.take_traffic();
  progress_.step += batch;
  learning_rates scaled_rates = rates;
  if (batch > 1)
    for (float* rate : {&scaled_rates.mean, &scaled_rates.log_scale, &scaled_rates.quaternion, &scaled_rates.opacity,
                        &scaled_rates.sh_dc, &scaled_rates.sh_rest})
      *rate *= std::sqrt(static_cast<float>(batch));
  shown.end();
  // Sent before the optimizer and read when that is queued. So the device is never idle: it is at the optimizer while
  // the host reads, and while it queues the next step.
  auto const sent = send();
  optimize(plan, scaled_rates, degree);
  collect(sent, last);

  report.step = progress_.step, report.gaussians = gaussians_.total;
  report.view = data_.train[images.back().index].name;
  if (finite_)
    report.skipped = plan.sum((*finite_)(gaussians_.model, gaussians_.moments,
                                         "step " + std::to_string(report.step) + ", view " + report.view));
  double sum = 0, square = 0;
  // All ranks have the numbers of all images, so all do the same.
  for (int k = 0; k < batch; ++k) {
    span<float> const of_image = row(span<float>(found), k);
    step_view const& view = images[static_cast<std::size_t>(k)];
    float loss_of_image = of_image.data()[0];
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      span<float const> const said = numbers_of(of_image, i);
      loss_of_image += parts_[i]->loss(said);
      parts_[i]->step(view.index, view.shrink, said, before + k, iterations, rates);
    }
    sum += double{loss_of_image}, square += double{of_image.data()[1]};
  }
  report.loss = static_cast<float>(sum / batch);
  float const mean_square = static_cast<float>(square / batch);
  report.psnr = mean_square > 0 ? -10.0f * std::log10(mean_square) : 99.0f;
  return report;
}

// An image of the step that begins after `before` images.
template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
step_view basic_trainer<E, Traits, Tracer, Method, Comm>::view_of(int before, int image) {
  step_view v;
  v.index = views_.order.at(before + image);
  v.step = before, v.iterations = options_.iterations;
  dataset_view const& view = data_.train[v.index];
  v.shrink = shrink_of(view.view, shrink_at(options_.resolution, before, options_.iterations), options_.resolution);
  auto const at_size = [&](camera const& c) { return v.shrink == 1 ? c : downscaled(c, v.shrink, view.name); };
  v.seen = at_size(seen_by(v.index)), v.captured = at_size(view.view);
  return v;
}

// Traces this rank's unit of a round, and sums its gradients. The loss is that of the whole image.
template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
template <class Plan>
void basic_trainer<E, Traits, Tracer, Method, Comm>::trace(Plan& plan, loss_function<E> const* loss, step_view& v,
                                                           int image, int degree, step_report& report) {
  part_needs needs;
  for (auto const& part : parts_) {
    part_needs const of = part->needs(v.index, v.step, v.iterations);
    needs.image |= of.image, needs.depth |= of.depth;
  }
  std::size_t const width = numbers(parts_.size());
  span<float> const row = image_.numbers.view().subspan(static_cast<std::size_t>(image) * width, width);
  image_targets const targets =
      image_.begin(static_cast<std::size_t>(v.seen.width) * v.seen.height, needs.depth, has_depth<Method>);
  v.color = image_.color, v.depth = image_.depth(), v.by_image = image_.gradients();
  v.model = plan.scene(), v.degree = degree;
  v.share = [&](float* plane) { plan.share(plane, v.seen, sizeof(float)); };
  vec3 const background = background_of(v.step + image);
  v.options = render_options_of(options_, data_.extent, background);
  bool const divides_loss = plan.divides_loss(!loss && !needs.image && !needs.depth);
  auto const differentiate_loss = [&] {
    stage_scope stage(exec_, "loss");
    v.truth = views_.photos.get(v.index, background, v.shrink);
    if (divides_loss)
      return plan.differentiate_loss(image_, v.truth, v.seen, options_.ssim_weight, densifier_->by_error());
    plan.share(image_.color.data(), v.seen, 3 * sizeof(float));
    if (targets.depth) v.share(targets.depth), v.share(targets.transmittance);
    span<float const> photo = v.color;
    for (std::size_t i = 0; i < parts_.size(); ++i) photo = parts_[i]->before_loss(v, photo, numbers_of(row, i));
    if (loss)
      (*loss)({exec_, data_.train[v.index], v.truth, v.seen.width, v.seen.height, photo, image_.by_color,
               row.subspan(0, 2), has_depth<Method> ? v.depth : depth_pixels{}});
    else
      image_.loss.evaluate(photo, v.truth, v.seen.width, v.seen.height, options_.ssim_weight, image_.by_color,
                           row.subspan(0, 2));
    if (densifier_->by_error()) {
      error_map(exec_, photo, v.truth, image_.error);
      for (auto const& part : parts_) part->leave_out(image_.error);
    }
    for (std::size_t i = parts_.size(); i-- > 0;) parts_[i]->after_loss(v, image_.by_color, numbers_of(row, i));
  };
  auto const after_backward = [&](frame_type* frame) {
    if (!in_ranks()) v.gradients = gaussians_.gradients.view();
    for (std::size_t i = 0; i < parts_.size(); ++i) parts_[i]->after_backward(frame, v, numbers_of(row, i));
  };
  if (plan.unit().empty()) {
    plan.finish_fetch();
    differentiate_loss();
    after_backward(nullptr);
    return plan.give_nothing_back();
  }
  render_options render = v.options;
  render.rows = plan.unit().rows;
  frame_type& frame = tracing_.frame;
  frame.prepare(plan.scene(), v.seen, render, degree);
  plan.finish_fetch();
  // Falls back to a smaller hit buffer, then to none, where one exceeds its budget or the largest slot number.
  tracing_.passes.with_room(frame, options_.hit_memory, [&]<class Pass>(Pass& pass) {
    plan.require(pass);
    pass.render(frame, targets);
    differentiate_loss();
    plan.sum(frame, pass, image_, gaussians_.gradients);
    after_backward(&frame);
    plan.give_back(frame, pass, render.antialias);
    progress_.hit_buffer_bytes = std::max(progress_.hit_buffer_bytes, pass.hit_buffer_bytes()),
    report.backward = Pass::method_type::name;
  });
}

// The optimizer's step and what grows, moves and prunes the Gaussians.
template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
template <class Plan>
void basic_trainer<E, Traits, Tracer, Method, Comm>::optimize(Plan& plan, learning_rates const& rates, int degree) {
  trained_gaussians<E>& g = gaussians_;
  int const step = progress_.step;
  densifier_->penalty(g, g.total);
  if (progress_.hooks.before_optimizer) {
    plan.sum_arrived(g.gradients);
    progress_.hooks.before_optimizer(std::as_const(g.model).view(), g.gradients.view(), step - options_.batch);
  }
  adam_options adam = options_.adam;
  adam.sh_pull = options_.sh_penalty / static_cast<float>(std::max<u64>(g.total, 1));
  plan.move(exec_,
            adam_pass<E>(g.model, g.gradients, g.moments, rates, step, degree,
                         finite_ ? finite_->skipped() : span<u64>{}, adam, options_.batch),
            g.gradients);
  span<float const> filter;
  if (options_.render.antialias > 0 && densifier_->due(step)) {
    std::vector<std::size_t> const views = views_trained_on(data_.train.size(), options_.held_out);
    filter = views_.filter.of(
        exec_, g.model.view(), views.size(), [&](std::size_t k) { return seen_by(views[k]); },
        options_.render.antialias);
  }
  density_change const change = densifier_->step(g, {step, rates.mean, plan.rows(), filter});
  g.total += change.added - change.removed;
  if (g.moments.first.size() != g.size() || g.moments.second.size() != g.size() || g.gradients.size() != g.size())
    throw invalid_argument("densifier: it has resized the Gaussians without their moments: call its argument's resize");
  plan.end_step(change.added || change.removed);
}

template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
vec3 basic_trainer<E, Traits, Tracer, Method, Comm>::background_of(int step) const {
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

template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
rendered basic_trainer<E, Traits, Tracer, Method, Comm>::render(camera const& view, vec3 background) {
  render_options const options = render_options_of(options_, data_.extent, background);
  if constexpr (!Comm::alone)
    if (in_ranks()) return plans_.ranks.render(tracing_.frame, gaussians_, view, options, gaussians_.degree);
  tracing_.frame.prepare(std::as_const(gaussians_.model).view(), view, options, gaussians_.degree);
  rendered out = render_image(tracing_.frame);
  if (!shows_more()) return out;
  buffer<float, E> image(exec_, out.color.data.size());
  image.assign(span<float const>(out.color.data));
  for (auto const& part : parts_)
    part->show(view, options, std::as_const(gaussians_.model).view(), gaussians_.degree, image);
  out.color.data = image.to_host();
  return out;
}

template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
image8 basic_trainer<E, Traits, Tracer, Method, Comm>::render_8bit(camera const& view, vec3 background) {
  if constexpr (!Comm::alone)
    if (in_ranks()) return to_8bit(render(view, background).color);
  if (shows_more()) return to_8bit(render(view, background).color);
  tracing_.frame.prepare(std::as_const(gaussians_.model).view(), view,
                         render_options_of(options_, data_.extent, background), gaussians_.degree);
  return render_image_8bit(tracing_.frame);
}

}}  // namespace gart::GART_ISA
