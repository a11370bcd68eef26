#pragma once
/// \file
/// Turns templates into configurations: sessions and renderers of a policy, traits, a tracer and a method. Include it
/// where the policy's kernels can be compiled. In GART_REGISTER_CONFIGURATIONS call register_configurations for all SH
/// degrees, or register_configuration_of for one configuration. The latter takes models up to its degree:
///   using response = gart::generalized_gaussian<4>;
///   GART_REGISTER_CONFIGURATIONS(my_configurations,
///                                gart::register_configuration_of<gart::openmp_exec, gart::scene_traits<3, response>,
///                                                                gart::tile_tracer<gart::openmp_exec, 8, response>,
///                                                                gart::primitive_method>(-1))

#include <gart/runtime/compiled_renderer.hpp>
#include <gart/runtime/registry.hpp>
#include <gart/train/trainer.hpp>

namespace gart { inline namespace GART_ISA {

/// A session of one configuration.
template <execution E, class Traits, class Tracer, gradient_method Method, class Comm = self_comm>
class compiled_session final : public session {
 public:
  /// For make_session; `start` has the request's degree.
  compiled_session(configuration_request const& request, train_options const& options, dataset const& data,
                   start_model const& start)
      : exec_(policy_of<E, Comm>(request)), trainer_(exec_, options, data, start, comm_of<Comm>(request)) {
    if (start.rows.sh_degree != request.sh_degree)
      throw invalid_argument("session: the model to start from has another SH degree than the request");
  }
  step_report step() override { return trainer_.step(); }
  int steps_done() const override { return trainer_.steps_done(); }
  void set_iterations(int iterations) override { trainer_.set_iterations(iterations); }
  gaussian_model model() const override { return trainer_.model(); }
  rendered render(camera const& view, vec3 background) override { return trainer_.render(view, background); }
  image8 render_8bit(camera const& view, vec3 background) override { return trainer_.render_8bit(view, background); }
  void save(std::filesystem::path const& path) const override { trainer_.save(path); }
  void load(std::filesystem::path const& path) override { trainer_.load(path); }
  training_state state() const override { return trainer_.state(); }
  void set_state(training_state const& state) override { trainer_.set_state(state); }
  u64 size() const override { return trainer_.size(); }
  void save_model(std::filesystem::path const& path, splat_traits const& traits) const override {
    trainer_.save_model(path, traits);
  }
  exposure_field exposures() const override { return trainer_.exposures(); }
  std::vector<named_camera> poses() const override { return trainer_.poses(); }
  camera as_learned(camera const& view) const override { return trainer_.as_learned(view); }
  profiler& profile() override {
    exec_.synchronize();
    return exec_.profile;
  }
  std::size_t peak_bytes() const override { return exec_.memory.peak; }
  std::size_t hit_buffer_bytes() const override { return trainer_.hit_buffer_bytes(); }
  u64 sent_bytes() const override { return trainer_.sent_bytes(); }
  configuration_info configuration() const override {
    return configuration_of<E, Traits, Tracer, Method, Comm>(trainer_.degree());
  }

 private:
  E exec_;
  trainer<E, Traits, Tracer, Method, Comm> trainer_;
};

/// One configuration; with a communicator other than self_comm for training on several ranks.
template <execution E, class Traits, class Tracer, gradient_method Method, class Comm = self_comm>
void register_configuration_of(int rank, bool (*available)(std::string*) = always_available) {
  register_configuration({configuration_of<E, Traits, Tracer, Method, Comm>(), rank, available,
                          [](configuration_request const& request) -> std::unique_ptr<renderer> {
                            return std::make_unique<compiled_renderer<E, Traits, Tracer, Method>>(request);
                          },
                          [](configuration_request const& request, train_options const& options, dataset const& data,
                             start_model const& start) -> std::unique_ptr<session> {
                            return std::make_unique<compiled_session<E, Traits, Tracer, Method, Comm>>(request, options,
                                                                                                       data, start);
                          }});
}

/// For SH degree 0, and for 1 to 3 in rows of degree 3.
template <execution E, class Tracer, gradient_method Method, class Comm = self_comm>
void register_configurations(int rank, bool (*available)(std::string*) = always_available) {
  register_configuration_of<E, scene_traits<0>, Tracer, Method, Comm>(rank, available);
  register_configuration_of<E, scene_traits<3>, Tracer, Method, Comm>(rank, available);
}

/// The configuration with depth gradients: the primitive method, for all SH degrees in rows of degree 3.
template <execution E, class Tracer>
void register_depth(int rank, bool (*available)(std::string*) = always_available) {
  register_configuration_of<E, scene_traits<3>, Tracer, with_depth<primitive_method>>(rank, available);
}

/// All methods, ranked from first_rank in the list's order. On hosts those with ordered sums are left to the
/// variants. Only the primitive method, which is taken where none is named, is worth compiling for degree 0 too.
template <execution E, class Tracer>
void register_methods(int first_rank, bool (*available)(std::string*) = always_available) {
  int rank = first_rank;
  gradient_methods::for_each([&]<gradient_method Method>(Method) {
    if constexpr (std::is_same_v<Method, primitive_method>)
      register_configurations<E, Tracer, Method>(rank++, available);
    else if constexpr (E::device || !Method::ordered)
      register_configuration_of<E, scene_traits<3>, Tracer, Method>(rank++, available);
  });
}

}}  // namespace gart::GART_ISA
