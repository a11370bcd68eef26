#pragma once
/// \file
/// Turns templates into the service that renderers trace batches of rays by (runtime/ray_service.hpp). Include where
/// the kernels of the policy can be compiled, and call from GART_REGISTER_CONFIGURATIONS:
///   GART_REGISTER_CONFIGURATIONS(my_rays, gart::register_rays<gart::openmp_exec, gart::generalized_gaussian<4>>())

#include <gart/rays/ray_tracer.hpp>
#include <gart/runtime/compiled_instances.hpp>
#include <gart/runtime/configuration_of.hpp>
#include <gart/runtime/ray_service.hpp>
#include <gart/runtime/registry.hpp>

namespace gart { inline namespace GART_ISA {

/// A model for renderers that share it. Its policy has a queue of its own, so that no renderer has to outlive it.
template <execution E, class Response>
class compiled_shared_model final : public shared_model {
 public:
  /// Waits until all of it is there.
  compiled_shared_model(configuration_request const& request, gaussian_model const& model,
                        render_options const& options, vec3d const& frame)
      : request_(request),
        exec_(policy_of<E>(request_)),
        gaussians_(exec_, model),
        features_(exec_, model.features),
        channels_{{features_.data(), gaussians_.size(), model.feature_count}},
        tree_(exec_, std::as_const(gaussians_).view(), options.alpha_min, frame) {}
  configuration_request const& request() const override { return request_; }
  char const* compiled_for() const override { return E::device ? "" : instruction_set; }
  gaussians_view<float const> gaussians() const override { return gaussians_.view(); }
  gaussian_channels channels() const override { return channels_; }
  std::size_t bytes() const override { return exec_.memory.current; }
  /// For tracers.
  shared_index<E, Response> const& tree() const { return tree_; }

 private:
  configuration_request request_;
  E exec_;
  gart::gaussians<E> gaussians_;
  buffer<float, E> features_;
  gaussian_channels channels_;
  shared_index<E, Response> tree_;
};

/// The service of a policy and a response.
template <execution E, class Response>
class compiled_rays final : public ray_service {
 public:
  /// Makes the policy that the request asks for.
  explicit compiled_rays(configuration_request const& request) : exec_(policy_of<E>(request)), tracer_(exec_) {}

  void set_scene(gaussians_view<float const> scene, int active_degree) override {
    tracer_.set_scene(scene, active_degree);
  }
  void share(shared_model const* model) override {
    auto const* const own = dynamic_cast<compiled_shared_model<E, Response> const*>(model);
    tracer_.share(own ? &own->tree() : nullptr);
  }
  void set_channels(gaussian_channels const& channels) override {
    tracer_.set_channels(channels), features_ = channels.features.width;
  }
  traced_rays trace(ray_batch const& rays, render_options const& options, bool with_features) override {
    host_rays const there(exec_, rays);
    std::size_t const n = rays.count();
    buffer<float, E> color(exec_, 3 * n), transmittance(exec_, n), depth(exec_, n), median(exec_, n), first(exec_, n);
    buffer<u32, E> hits(exec_, n), first_id(exec_, n), median_id(exec_, n), top_id(exec_, n);
    buffer<float, E> features(exec_, with_features ? n * static_cast<std::size_t>(features_) : 0);
    batch_targets out{color.data(), transmittance.data(), depth.data(),     median.data(), first.data(),
                      hits.data(),  first_id.data(),      median_id.data(), top_id.data()};
    if (features.size() > 0) out.channels.features = features.data();
    tracer_.trace(there.rays, options, out);
    return {color.to_host(), transmittance.to_host(), depth.to_host(),     median.to_host(), first.to_host(),
            hits.to_host(),  first_id.to_host(),      median_id.to_host(), top_id.to_host(), features.to_host()};
  }
  hit_lists list_hits(ray_batch const& rays, render_options const& options) override {
    host_rays const there(exec_, rays);
    return tracer_.list(there.rays, options).to_host();
  }
  void trace_to(ray_batch const& rays, render_options const& options, batch_targets const& targets) override {
    tracer_.trace(rays, options, targets);
  }
  std::unique_ptr<forward_context> forward(ray_batch const& rays, render_options const& options,
                                           batch_targets const& targets, gradient_form form) override {
    return std::make_unique<context>(tracer_, tracer_.forward(rays, options, targets, form));
  }
  void wait() override { exec_.synchronize(); }
  std::size_t peak_bytes() const override { return exec_.memory.peak; }

 private:
  class context final : public forward_context {
   public:
    context(ray_tracer<E, Response>& tracer, batch_context<E>&& left) : tracer_(tracer), left_(std::move(left)) {}
    void backward(output_gradients const& by, gradient_targets const& to) override {
      if (to.pose)
        throw invalid_argument("forward_context.backward: a batch has no pose; gradient_targets.pose is of a view");
      tracer_.backward(left_, by, to.gaussians, to.rays, to.channels);
    }

   private:
    ray_tracer<E, Response>& tracer_;
    batch_context<E> left_;
  };

  // Rays of the host in memory of the policy.
  struct host_rays {
    host_rays(E& exec, ray_batch const& from) : origins(exec), directions(exec), t_max(exec) {
      require_batch(from);
      origins.assign(from.origins), directions.assign(from.directions), t_max.assign(from.t_max);
      rays = {from.frame, origins, directions, t_max};
    }
    buffer<float, E> origins, directions, t_max;
    ray_batch rays;
  };

  E exec_;
  ray_tracer<E, Response> tracer_;
  int features_ = 0;  // of a Gaussian
};

/// The service of a policy and a response, for all renderers of theirs, and scenes of instances.
template <execution E, class Response = generalized_gaussian<>>
void register_rays() {
  register_ray_service(
      from_string(E::name, backend_kind::automatic), Response::degree,
      [](configuration_request const& request) -> std::unique_ptr<ray_service> {
        return std::make_unique<compiled_rays<E, Response>>(request);
      },
      [](configuration_request const& request, gaussian_model const& model, render_options const& options,
         vec3d const& frame) -> std::shared_ptr<shared_model const> {
        configuration_request own = request;
        own.stream = nullptr;
        return std::make_shared<compiled_shared_model<E, Response>>(own, model, options, frame);
      });
  register_instances<E>();
}

}}  // namespace gart::GART_ISA
