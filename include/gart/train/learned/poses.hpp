#pragma once
/// \file
/// Poses of the training views (pose/pose_training.hpp) as a part of a training. An image gives the gradient by its
/// pose. A view's first image also gives the metric of its pose (pose/pose_metric.hpp).

#include <gart/pose/differentiate_pose.hpp>
#include <gart/pose/pose_training.hpp>
#include <gart/train/learned/part.hpp>
#include <gart/train/options.hpp>

#include <array>
#include <cstring>

namespace gart { inline namespace GART_ISA {

/// Where options.refine_poses asks for them.
template <class Frame>
class learned_poses final : public learned_part<Frame> {
  using E = typename Frame::execution_type;
  using metric = std::array<double, 36>;

 public:
  /// The dataset must outlive it. Errors: invalid_argument for a shard_block that no run of Gaussians divides.
  learned_poses(E& exec, train_options const& options, dataset const& data, bool spread)
      : data_(&data), training_(options.poses, cameras_of(data), data.extent), differentiate_(exec) {
    if (spread && options.shard_block % pose_differentiation<E>::run != 0)
      throw invalid_argument("train_options.shard_block is " + std::to_string(options.shard_block) +
                             ": with refine_poses a multiple of " + std::to_string(pose_differentiation<E>::run));
  }

  std::size_t numbers() const override { return pose_gradient::floats + sizeof(metric) / sizeof(float); }
  part_needs needs(std::size_t view, int step, int iterations) const override {
    bool const learns = training_.learns(step, iterations);
    return {.depth = learns && training_.wants_metric(view), .gradients = learns};
  }
  bool moves_cameras() const override { return true; }
  camera view(std::size_t index, camera const&) const override { return training_.view(index); }
  void after_gradients(gaussians_view<float const> const& model, gaussians_view<float const> const& gradients,
                       camera const& seen, all_rows<E>& rows, span<float> numbers) override {
    differentiate_.template of_rows<Frame::sh_degree>(model, gradients, seen.position, rows,
                                                      numbers.subspan(0, pose_gradient::floats));
  }
  void found(step_view const& v, span<float> numbers) override {
    if (!needs(v.index, v.step, v.iterations).depth) return;
    E& exec = differentiate_.exec();
    std::vector<float> depth(v.depth.depth.size()), transmittance(depth.size());
    exec.copy_out(depth.data(), v.depth.depth.data(), depth.size() * sizeof(float));
    exec.copy_out(transmittance.data(), v.depth.transmittance.data(), depth.size() * sizeof(float));
    camera const posed = training_.view(v.index);
    metric const m = training_.metric_of(
        v.shrink == 1 ? posed : downscaled(posed, v.shrink, data_->train[v.index].name), depth, transmittance);
    std::memcpy(numbers.data() + pose_gradient::floats, m.data(), sizeof m);
  }
  void step(std::size_t view, int, span<float const> numbers, int step, int iterations,
            learning_rates const&) override {
    if (!training_.learns(step, iterations)) return;
    if (training_.wants_metric(view)) {
      metric m;
      std::memcpy(m.data(), numbers.data() + pose_gradient::floats, sizeof m);
      training_.set_metric(view, m);
    }
    training_.step(view, pose_gradient(numbers.data()), step, iterations);
  }
  void save(named_arrays& state) const override { training_.save(state); }
  void load(named_arrays const& state) override { training_.load(state); }

 private:
  static std::vector<camera> cameras_of(dataset const& data) {
    std::vector<camera> all;
    for (named_camera const& v : training_cameras(data)) all.push_back(v.view);
    return all;
  }
  dataset const* data_;
  pose_training training_;
  pose_differentiation<E> differentiate_;
};

}}  // namespace gart::GART_ISA
