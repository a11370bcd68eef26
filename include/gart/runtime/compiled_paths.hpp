#pragma once
/// \file
/// Turns templates into the path renderer of a policy and a response (runtime/path_renderer.hpp). Include where the
/// kernels of the policy can be compiled, and call from GART_REGISTER_CONFIGURATIONS:
///   GART_REGISTER_CONFIGURATIONS(my_paths, gart::register_paths<gart::openmp_exec>())

#include <gart/light/mirror_paths.hpp>
#include <gart/light/mirror_service.hpp>
#include <gart/light/path_tracer.hpp>
#include <gart/render/bytes.hpp>
#include <gart/runtime/configuration_of.hpp>
#include <gart/runtime/path_renderer.hpp>
#include <gart/runtime/registry.hpp>

namespace gart { inline namespace GART_ISA {

/// The renderer of a policy and a response.
template <execution E, class Response>
class compiled_paths final : public path_renderer {
 public:
  /// Makes the policy that the request asks for.
  explicit compiled_paths(configuration_request const& request)
      : exec_(policy_of<E>(request)), model_(exec_, 0, 0), tracer_(exec_), shown_(exec_), bytes_(exec_) {}

  void set_model(gaussian_model const& model) override {
    model_.assign(model);
    tracer_.set_model(model_.view(), model.sh_degree);
  }
  void set_scene(light::scene const& scene) override { tracer_.set_scene(scene); }
  void begin(camera const& view, render_options const& options, light::path_options const& paths) override {
    tracer_.begin(view, options, paths);
    paths_ = paths, width_ = view.width, height_ = view.height;
  }
  void add(int samples) override { tracer_.add(samples); }
  int samples() const override { return tracer_.samples(); }
  image_float radiance() override { return show(0, light::tone_kind::none), filled(3, shown_); }
  image_float picture() override { return show(paths_.exposure, paths_.tone), filled(3, shown_); }
  image8 picture_8bit() override {
    show(paths_.exposure, paths_.tone);
    bytes_.resize(shown_.size());
    color_to_bytes(exec_, shown_.data(), tracer_.pixels(), bytes_.data(), 3);
    return filled(3, bytes_);
  }
  path_layers layers() override {
    std::size_t const n = tracer_.pixels();
    buffer<float, E> albedo(exec_, 3 * n), normal(exec_, 3 * n), depth(exec_, n), transmittance(exec_, n);
    buffer<u32, E> gaussian(exec_, n), mesh(exec_, n), triangle(exec_, n);
    tracer_.layers({albedo.data(), normal.data(), depth.data(), transmittance.data(), gaussian.data(), mesh.data(),
                    triangle.data()});
    return {filled(3, albedo),   filled(3, normal), filled(1, depth),   filled(1, transmittance),
            filled(1, gaussian), filled(1, mesh),   filled(1, triangle)};
  }
  profiler& profile() override {
    exec_.synchronize();
    return exec_.profile;
  }
  configuration_info configuration() const override {
    configuration_info info;
    info.backend = from_string(E::name, backend_kind::automatic), info.tracer = tracer_kind::bvh;
    info.sh_degree = model_.sh_degree(), info.kernel_degree = Response::degree;
    if constexpr (!E::device) info.instruction_set = instruction_set;
    return info;
  }

 private:
  void show(float exposure, light::tone_kind tone) {
    if (tracer_.samples() == 0)
      throw invalid_argument("path_renderer: there is no sample to show; call begin and add first");
    shown_.resize(std::size_t{3} * tracer_.pixels());
    tracer_.show(exposure, tone, shown_.data());
  }
  template <class T>
  basic_image<T> filled(int channels, buffer<T, E> const& from) const {
    basic_image<T> out(width_, height_, channels);
    if (!out.empty()) exec_.copy_out(out.data.data(), from.data(), out.data.size() * sizeof(T));
    return out;
  }

  mutable E exec_;
  gaussians<E> model_;
  path_tracer<E, Response> tracer_;
  light::path_options paths_;  // of the last begin
  buffer<float, E> shown_;     // the last picture
  buffer<u8, E> bytes_;
  int width_ = 0, height_ = 0;
};

/// The mirrors of a policy and a response.
template <execution E, class Response>
class compiled_mirrors final : public mirror_service {
 public:
  /// `exec` must outlive it.
  compiled_mirrors(E& exec, light::scene const& scene) : paths_(exec) { paths_.set_scene(scene); }

  void show(gaussians_view<float const> model, int active_degree, camera const& view, render_options const& options,
            float* image) override {
    light::path_options as_captured;
    as_captured.shadows = light::shadow_kind::none;
    paths_.set_model(model, active_degree);
    paths_.forward(view, options, as_captured, image, mirror_pixels::mirrors);
  }
  void take_out(span<float> image) override { paths_.take_out(image); }
  void backward(span<float const> by_image, gaussians_view<float> gradients) override {
    paths_.backward(by_image, gradients, with_what::there_is);
  }

 private:
  mirror_paths<E, Response> paths_;
};

/// The renderer of a policy and a response, for make_path_renderer, and its mirrors, for trainers.
template <execution E, class Response = generalized_gaussian<>>
void register_paths(bool (*available)(std::string*) = always_available) {
  register_path_renderer(from_string(E::name, backend_kind::automatic), Response::degree, available,
                         [](configuration_request const& request) -> std::unique_ptr<path_renderer> {
                           return std::make_unique<compiled_paths<E, Response>>(request);
                         });
  register_mirrors(E::name, E::device ? "" : instruction_set, Response::degree,
                   [](void* exec, light::scene const& scene) -> std::unique_ptr<mirror_service> {
                     return std::make_unique<compiled_mirrors<E, Response>>(*static_cast<E*>(exec), scene);
                   });
}

}}  // namespace gart::GART_ISA
