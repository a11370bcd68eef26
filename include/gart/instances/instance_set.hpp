#pragma once
/// \file
/// The scene of instances (instances/instance.hpp) on a policy, and its gradients back to models and poses:
///
///   instance_set<E> actors(exec, sh_degree);
///   actors.set({street, car}, {{0}, {1, axes, position}, {1, other_axes, other_position}});
///   renderer->bind(actors.scene());                          // or ray_tracer.set_scene, frame.prepare
///   actors.move(instances);                                  // poses have changed
///   actors.backward(by_scene, {by_models, {}, by_poses});    // from dL/d scene()
///
/// The scene holds a copy of each Gaussian for each instance, turned, scaled and moved with its harmonics
/// (scene/similarity.hpp). Every tracer, view, batch and gradient method takes it for a model. Hits are in exact order
/// over all instances, and a hit's direction is that of the instance's own axes. One pose holds for one trace.
///
/// An instance at rest moves by dp as a camera does by -dp. It turns about its position as a camera does the other way.
/// So pose gradients are those of pose/differentiate_pose.hpp with the sign turned, over the instance's Gaussians. Sums
/// go in the order of the list: the same bits in every run.
///
/// Memory: 44 bytes and 12 a coefficient for each Gaussian of each instance, 236 at SH degree 3. Cost: one launch an
/// instance that has moved, three an instance back. Errors: those of instance.hpp.

#include <gart/exec/parallel.hpp>
#include <gart/instances/require_instances.hpp>
#include <gart/pose/differentiate_pose.hpp>

#include <algorithm>
#include <string>
#include <vector>

namespace gart { inline namespace GART_ISA {

namespace instance_kernels {

// Rows of a scene from those of a model, whose missing bands are zero.
struct place {
  gaussians_view<float const> model;
  gaussian_mover by;
  gaussians_view<float> out;
  GART_KERNEL void operator()(index_t i) const {
    for_each_array(
        [&](parameter_array const& a, float const* from, float* to) {
          index_t const given = a.width(model.sh_degree), width = a.width(out.sh_degree);
          for (index_t k = 0; k < width; ++k)
            to[std::size_t{width} * i + k] = k < given ? from[std::size_t{given} * i + k] : 0.0f;
        },
        model, out);
    by.move(out, i);
  }
};

// The way back, to one row: written or added to.
struct pull_back {
  gaussians_view<float const> by_scene;  // rows of the instance
  gaussian_mover by;
  bool add;
  gaussians_view<float> out;  // of the model
  static constexpr int most = 3 * sh_coefficients(3);
  GART_KERNEL void operator()(index_t i) const {
    float mean[3], log_scale[3], rotation[4], opacity[1], sh[most];
    gaussians_view<float> const row{mean, log_scale, rotation, opacity, sh, 1, out.sh_degree};
    for_each_array(
        [&](parameter_array const& a, float const* from, float* to) {
          index_t const stored = a.width(by_scene.sh_degree), width = a.width(out.sh_degree);
          for (index_t k = 0; k < width; ++k) to[k] = from[std::size_t{stored} * i + k];
        },
        by_scene, row);
    by.pull_back(row, 0);
    for_each_array(
        [&](parameter_array const& a, float const* from, float* to) {
          index_t const width = a.width(out.sh_degree);
          for (index_t k = 0; k < width; ++k) {
            float& at = to[std::size_t{width} * i + k];
            at = add ? at + from[k] : from[k];
          }
        },
        row, out);
  }
};

struct add_numbers {
  float const* from;
  bool add;
  float* to;
  GART_KERNEL void operator()(index_t i) const { to[i] = add ? to[i] + from[i] : from[i]; }
};

struct negate {
  float* numbers;
  GART_KERNEL void operator()(index_t i) const { numbers[i] = -numbers[i]; }
};

// Rows [first, first + count).
template <class T>
gaussians_view<T> rows_of(gaussians_view<T> const& all, index_t first, index_t count) {
  gaussians_view<T> out = all;
  for_each_array([&](parameter_array const& a, T* from,
                     T*& to) { to = from ? from + std::size_t{a.width(all.sh_degree)} * first : nullptr; },
                 all, out);
  out.count = count;
  return out;
}

}  // namespace instance_kernels

/// The scene and its memory.
template <execution E>
class instance_set {
 public:
  /// Of a scene of that SH degree; `exec` must outlive it.
  instance_set(E& exec, int sh_degree) : exec_(&exec), scene_(exec, 0, sh_degree), features_(exec), of_poses_(exec) {
    if (sh_degree < 0 || sh_degree > 3)
      throw invalid_argument("instance_set: the SH degree is " + std::to_string(sh_degree) + ", not from 0 to 3");
  }

  /// Models, whose arrays must stay, and what stands where. `features`: of each model, of one width; none: of none.
  void set(std::vector<gaussians_view<float const>> models, std::vector<instance> instances,
           std::vector<feature_view<float const>> features = {}) {
    require_instances(models, instances, scene_.sh_degree());
    require_features(models, features);
    models_ = std::move(models), instances_ = std::move(instances), given_features_ = std::move(features);
    offsets_.assign(1, 0);
    for (instance const& one : instances_) offsets_.push_back(offsets_.back() + models_[one.model].count);
    scene_.resize_keep(offsets_.back());
    place_all();
  }
  /// The same instances at other poses: those that differ are placed again. Errors: invalid_argument where the list has
  /// other models or another number of them.
  void move(std::vector<instance> instances) {
    if (instances.size() != instances_.size())
      throw invalid_argument("instance_set.move: there are " + std::to_string(instances.size()) + " instances, and " +
                             std::to_string(instances_.size()) + " were set: call instance_set.set");
    require_instances(models_, instances, scene_.sh_degree());
    for (std::size_t i = 0; i < instances.size(); ++i)
      if (instances[i].model != instances_[i].model)
        throw invalid_argument("instance_set.move: instances[" + std::to_string(i) +
                               "] is of another model than was set: call instance_set.set");
    instances_.swap(instances);
    for (std::size_t i = 0; i < instances.size(); ++i) {
      instance const &a = instances[i], &b = instances_[i];
      if (a.rotation != b.rotation || a.position != b.position || a.scale != b.scale) place_one(i);
    }
  }
  /// Places all again: the models' arrays were written to.
  void place_all() {
    for (std::size_t i = 0; i < instances_.size(); ++i) place_one(i);
    if (width_ == 0) return;
    features_.resize(offsets_.back() * static_cast<std::size_t>(width_));
    for (std::size_t i = 0; i < instances_.size(); ++i) {
      feature_view<float const> const& from = given_features_[instances_[i].model];
      exec_->copy(feature_row(features_.data(), i), from.values, from.size() * sizeof(float));
    }
  }

  /// The scene, as a model.
  gaussians_view<float const> scene() const { return scene_.view(); }
  /// Its features; width 0: none.
  feature_view<float const> features() const { return {features_.data(), scene_.size(), width_}; }
  /// What stands where.
  std::vector<instance> const& instances() const { return instances_; }
  /// [instances + 1]: the first Gaussian of each.
  std::vector<u64> const& offsets() const { return offsets_; }
  /// Whose Gaussian `id` of the scene is, id < scene().count.
  instance_gaussian of(u32 id) const {
    auto const next = std::upper_bound(offsets_.begin(), offsets_.end(), u64{id});
    return {static_cast<u32>(next - offsets_.begin() - 1), static_cast<u32>(id - *(next - 1))};
  }

  /// From dL/d scene() (and features(), where their gradient is wanted) to what `to` wants. Errors: invalid_argument
  /// for gradients that do not fit.
  void backward(gaussians_view<float const> by_scene, instance_gradients const& to,
                feature_view<float const> by_features = {}) {
    require_gradients(by_scene, to, by_features);
    std::vector<bool> written(models_.size(), false);
    for (std::size_t i = 0; i < instances_.size(); ++i) {
      u32 const m = instances_[i].model;
      index_t const count = models_[m].count;
      if (!to.models.empty() && to.models[m].mean)
        parallel_for(
            *exec_, "instances/back", count,
            instance_kernels::pull_back{rows(by_scene, i), gaussian_mover(similarity_of(i)), written[m], to.models[m]});
      if (!to.features.empty() && to.features[m].values)
        parallel_for(
            *exec_, "instances/back", count * static_cast<index_t>(width_),
            instance_kernels::add_numbers{feature_row(by_features.values, i), written[m], to.features[m].values});
      written[m] = true;
      if (to.poses) differentiate_pose(by_scene, i, to.poses + pose_gradient::floats * i);
    }
    for (std::size_t m = 0; m < models_.size(); ++m) {
      if (written[m]) continue;
      if (!to.models.empty() && to.models[m].mean)
        for_each_array(
            [&](parameter_array const& a, float* values) {
              exec_->zero(values, sizeof(float) * a.width(to.models[m].sh_degree) * models_[m].count);
            },
            to.models[m]);
      if (!to.features.empty() && to.features[m].values)
        exec_->zero(to.features[m].values, sizeof(float) * to.features[m].size());
    }
    if (to.poses)
      parallel_for(*exec_, "instances/poses", static_cast<index_t>(pose_gradient::floats * instances_.size()),
                   instance_kernels::negate{to.poses});
  }

 private:
  similarity similarity_of(std::size_t i) const {
    instance const& one = instances_[i];
    return {one.rotation, one.scale, one.position};
  }
  template <class T>
  gaussians_view<T> rows(gaussians_view<T> const& all, std::size_t i) const {
    return instance_kernels::rows_of(all, static_cast<index_t>(offsets_[i]), models_[instances_[i].model].count);
  }
  template <class T>
  T* feature_row(T* values, std::size_t i) const {
    return values + offsets_[i] * static_cast<std::size_t>(width_);
  }
  void place_one(std::size_t i) {
    gaussians_view<float const> const& model = models_[instances_[i].model];
    parallel_for(*exec_, "instances/place", model.count,
                 instance_kernels::place{model, gaussian_mover(similarity_of(i)), rows(scene_.view(), i)});
  }
  void differentiate_pose(gaussians_view<float const> const& by_scene, std::size_t i, float* to) {
    gaussians_view<float const> const scene = rows(std::as_const(scene_).view(), i), by = rows(by_scene, i);
    all_rows<E> all = whole_scene<E>();
    span<float> const out(to, pose_gradient::floats);
    vec3d const& at = instances_[i].position;
    switch (scene.sh_degree) {
      case 0:
        return of_poses_.template of_rows<0>(scene, by, at, all, out);
      case 1:
        return of_poses_.template of_rows<1>(scene, by, at, all, out);
      case 2:
        return of_poses_.template of_rows<2>(scene, by, at, all, out);
      default:
        return of_poses_.template of_rows<3>(scene, by, at, all, out);
    }
  }

  void require_features(std::vector<gaussians_view<float const>> const& models,
                        std::vector<feature_view<float const>> const& features) {
    if (!features.empty() && features.size() != models.size())
      throw invalid_argument("instance_set.set: there are features of " + std::to_string(features.size()) +
                             " models, and " + std::to_string(models.size()) + " models: give those of each, or none");
    for (std::size_t m = 0; m < features.size(); ++m) {
      std::string const call = "instance_set.set: features[" + std::to_string(m) + "]";
      gart::require_features(features[m], models[m].count, call);
      if (features[m].width != features[0].width)
        throw invalid_argument(call + " has " + std::to_string(features[m].width) +
                               " numbers a Gaussian, and the first " + std::to_string(features[0].width) +
                               ": give all models as many");
    }
    width_ = features.empty() ? 0 : features[0].width;
  }
  void require_gradients(gaussians_view<float const> const& by_scene, instance_gradients const& to,
                         feature_view<float const> const& by_features) const {
    auto const refuse = [](std::string const& what) { throw invalid_argument("instance_set.backward: " + what); };
    if (by_scene.count != scene_.size() || by_scene.sh_degree != scene_.sh_degree())
      refuse("the gradients must have the number and the SH degree of the scene's Gaussians");
    if (!to.models.empty() && to.models.size() != models_.size())
      refuse("instance_gradients.models has " + std::to_string(to.models.size()) + " models, and there are " +
             std::to_string(models_.size()));
    for (std::size_t m = 0; m < to.models.size(); ++m)
      if (to.models[m].mean && (to.models[m].count != models_[m].count || to.models[m].sh_degree > scene_.sh_degree()))
        refuse("instance_gradients.models[" + std::to_string(m) + "] must have the number of the model's Gaussians, " +
               "and at most the scene's SH degree");
    if (to.features.empty()) return;
    if (width_ == 0 || by_features.width != width_ || by_features.count != scene_.size())
      refuse("instance_gradients.features is set: give the gradients of all features of the scene");
    if (to.features.size() != models_.size())
      refuse("instance_gradients.features has " + std::to_string(to.features.size()) + " models, and there are " +
             std::to_string(models_.size()));
    for (std::size_t m = 0; m < to.features.size(); ++m)
      if (to.features[m].values && (to.features[m].width != width_ || to.features[m].count != models_[m].count))
        refuse("instance_gradients.features[" + std::to_string(m) + "] must have the size of the model's features");
  }

  E* exec_;
  std::vector<gaussians_view<float const>> models_;
  std::vector<instance> instances_;
  std::vector<feature_view<float const>> given_features_;
  int width_ = 0;  // of features
  std::vector<u64> offsets_{0};
  gaussians<E> scene_;
  buffer<float, E> features_;
  pose_differentiation<E> of_poses_;
};

}}  // namespace gart::GART_ISA
