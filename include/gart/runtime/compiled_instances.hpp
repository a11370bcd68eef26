#pragma once
/// \file
/// Scenes of instances (runtime/instances.hpp) on a policy. register_rays (runtime/compiled_rays.hpp) registers them.

#include <gart/instances/instance_set.hpp>
#include <gart/runtime/configuration_of.hpp>
#include <gart/runtime/instances.hpp>
#include <gart/runtime/model_arrays.hpp>

#include <utility>

namespace gart { inline namespace GART_ISA {

/// The scene, and models that came from the host.
template <execution E>
class compiled_instances final : public instance_scene {
 public:
  /// Makes the policy that the request asks for.
  explicit compiled_instances(configuration_request const& request)
      : exec_(policy_of<E>(request)), set_(exec_, request.sh_degree) {}

  void set_models(std::vector<gaussian_model> const& models, std::vector<instance> const& instances) override {
    std::vector<gaussians<E>> copies;
    std::vector<buffer<float, E>> numbers;
    std::vector<gaussians_view<float const>> views;
    std::vector<feature_view<float const>> features;
    for (gaussian_model const& m : models) {
      require_arrays(m, "instance_scene.set_models");
      copies.emplace_back(exec_, m), numbers.emplace_back(exec_, m.features);
      views.push_back(std::as_const(copies.back()).view());
      features.push_back({numbers.back().data(), static_cast<index_t>(m.size()), m.feature_count});
    }
    set_.set(std::move(views), instances, std::move(features));
    models_.swap(copies), features_.swap(numbers);
  }
  void bind_models(std::vector<gaussians_view<float const>> const& models, std::vector<instance> const& instances,
                   std::vector<feature_view<float const>> const& features) override {
    for (gaussians_view<float const> const& m : models) require_arrays(m, "instance_scene.bind_models");
    set_.set(models, instances, features);
    models_.clear(), features_.clear();
  }
  void move(std::vector<instance> const& instances) override { set_.move(instances); }
  void place_all() override { set_.place_all(); }
  gaussians_view<float const> scene() const override { return set_.scene(); }
  feature_view<float const> features() const override { return set_.features(); }
  instance_gaussian of(u32 id) const override {
    if (id >= set_.scene().count)
      throw invalid_argument("instance_scene.of: the scene has " + std::to_string(set_.scene().count) +
                             " Gaussians, and none of number " + std::to_string(id));
    return set_.of(id);
  }
  void backward(gaussians_view<float const> by_scene, instance_gradients const& to,
                feature_view<float const> by_features) override {
    set_.backward(by_scene, to, by_features);
  }
  void wait() override { exec_.synchronize(); }

 private:
  E exec_;
  std::vector<gaussians<E>> models_;
  std::vector<buffer<float, E>> features_;
  instance_set<E> set_;
};

/// Of a policy, for all renderers of theirs.
template <execution E>
void register_instances() {
  gart::register_instances(from_string(E::name, backend_kind::automatic),
                           [](configuration_request const& request) -> std::unique_ptr<instance_scene> {
                             return std::make_unique<compiled_instances<E>>(request);
                           });
}

}}  // namespace gart::GART_ISA
