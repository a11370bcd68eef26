#pragma once
// Turns templates into rows: sessions and renderers of a policy, traits, a tracer and a strategy. Include where the
// kernels of the policy can be compiled, and call from GART_REGISTER_ROWS register_rows, for every SH degree, or
// register_row_of for one row:
//   using response = gart::generalized_gaussian<4>;
//   GART_REGISTER_ROWS(my_rows,
//                      gart::register_row_of<gart::openmp_exec, gart::scene_traits<3, response>,
//                                            gart::tile_tracer<gart::openmp_exec, 8, response>,
//                                            gart::primitive_strategy>(-1))

#include <gart/train/rows.hpp>
#include <gart/train/trainer.hpp>

namespace gart::inline GART_ISA {

template <execution E, class Traits, class Tracer, class Strategy>
row_info row_of() {
  using response = typename Traits::response;
  row_info row{E::name, Tracer::name, Strategy::name, Traits::sh_degree, response::degree};
  row.arithmetic = response::fast ? "fast" : "exact";
  using record = typename Strategy::template record<tile_size_of<Tracer>>;
  if constexpr (requires { record::entry::name; }) row.lt_format = record::entry::name;
  row.tile_size = tile_size_of<Tracer>;
  row.window = Tracer::window;
  if constexpr (!E::device) row.instruction_set = instruction_set;
  return row;
}

template <execution E, class Traits, class Tracer, class Strategy>
class compiled_session final : public session {
 public:
  compiled_session(train_options const& options, dataset const& data, gaussian_model const& start)
      : trainer_(exec_, options, data, start) {}
  step_report step() override { return trainer_.step(); }
  int steps_done() const override { return trainer_.steps_done(); }
  void set_iterations(int iterations) override { trainer_.set_iterations(iterations); }
  gaussian_model model() const override { return trainer_.model(); }
  rendered render(camera const& view, vec3 background) override { return trainer_.render(view, background); }
  void save(std::filesystem::path const& path) const override { trainer_.save(path); }
  void load(std::filesystem::path const& path) override { trainer_.load(path); }
  training_state state() const override { return trainer_.state(); }
  void set_state(training_state const& state) override { trainer_.set_state(state); }
  exposure_field exposures() const override { return trainer_.exposures(); }
  profiler& profile() override {
    exec_.synchronize();
    return exec_.profile;
  }
  std::size_t peak_bytes() const override { return exec_.memory.peak; }
  std::size_t lt_bytes() const override { return trainer_.lt_bytes(); }
  row_info row() const override { return row_of<E, Traits, Tracer, Strategy>(); }

 private:
  E exec_;
  trainer<E, Traits, Tracer, Strategy> trainer_;
};

template <execution E, class Traits, class Tracer, class Strategy>
class compiled_renderer final : public renderer {
 public:
  static constexpr int sh_degree = Traits::sh_degree;

  compiled_renderer()
      : filter_(exec_),
        records_(exec_),
        tracer_(exec_),
        pass_(exec_),
        scene_(exec_, 0, sh_degree),
        gradients_(exec_, 0, sh_degree),
        color_(exec_),
        color_gradient_(exec_) {}
  void set_model(gaussian_model const& model) override {
    if (model.sh_degree != Traits::sh_degree) throw invalid_argument("renderer: the model has another SH degree");
    scene_.assign(model);
  }
  rendered render(camera const& view, render_options const& options) override {
    return render_image<Traits::sh_degree>(exec_, tracer_, records_, std::as_const(scene_).view(), view, options);
  }
  void differentiate(camera const& view, render_options const& options, image_float const& color_gradient) override {
    std::size_t const floats = std::size_t{3} * view.width * view.height;
    if (color_gradient.data.size() != floats)
      throw invalid_argument("renderer: the colour's gradient must have three values for each pixel of the view");
    color_.resize(floats), color_gradient_.assign(color_gradient.data);
    gradients_.resize_keep(scene_.size());
    auto const scene = std::as_const(scene_).view();
    stage_scope stage(exec_, "gradients");
    auto const seen = filter_.of(exec_, scene, view, options.antialias);
    records_.template prepare<typename Traits::response>(exec_, seen, view, options.alpha_min);
    configure(tracer_, options);
    tracer_.prepare(exec_, seen, records_.view(), view, options.alpha_min, options.near);
    if (!pass_.prepare(exec_, tracer_, seen, view, options.alpha_min, options.near)) throw pass_.no_room();
    forward<sh_degree>(exec_, tracer_, scene, view, options, sh_degree, pass_.targets(color_.data()), pass_.record());
    pass_.template run<sh_degree>(exec_, tracer_, scene, records_.view(), view, options, sh_degree, color_,
                                  color_gradient_, gradients_);
  }
  gaussian_model gradients() const override { return gradients_.to_host(); }
  profiler& profile() override {
    exec_.synchronize();
    return exec_.profile;
  }
  std::size_t peak_bytes() const override { return exec_.memory.peak; }
  std::size_t lt_bytes() const override { return pass_.lt_bytes(); }
  row_info row() const override { return row_of<E, Traits, Tracer, Strategy>(); }

 private:
  E exec_;
  antialiased<E> filter_;
  frame_records<E> records_;
  Tracer tracer_;
  backward<E, Strategy, tile_size_of<Tracer>> pass_;
  gaussians<E> scene_, gradients_;
  buffer<float, E> color_, color_gradient_;
};

template <execution E, class Traits, class Tracer, class Strategy>
void register_row_of(int rank, bool (*available)(std::string*) = always_available) {
  register_row(
      {row_of<E, Traits, Tracer, Strategy>(), rank, available,
       []() -> std::unique_ptr<renderer> { return std::make_unique<compiled_renderer<E, Traits, Tracer, Strategy>>(); },
       [](train_options const& options, dataset const& data, gaussian_model const& start) -> std::unique_ptr<session> {
         return std::make_unique<compiled_session<E, Traits, Tracer, Strategy>>(options, data, start);
       }});
}

template <execution E, class Tracer, class Strategy>
void register_rows(int rank, bool (*available)(std::string*) = always_available) {
  register_row_of<E, scene_traits<0>, Tracer, Strategy>(rank, available);
  register_row_of<E, scene_traits<1>, Tracer, Strategy>(rank, available);
  register_row_of<E, scene_traits<2>, Tracer, Strategy>(rank, available);
  register_row_of<E, scene_traits<3>, Tracer, Strategy>(rank, available);
}

}  // namespace gart::inline GART_ISA
