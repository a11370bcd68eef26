#pragma once
// Turns templates into rows: sessions and renderers of a policy, a tracer and a strategy, for every SH degree. Include
// where the kernels of the policy can be compiled, and call register_rows from GART_REGISTER_ROWS.

#include <gart/train/rows.hpp>
#include <gart/train/trainer.hpp>

namespace gart {

template <execution E, class Traits, class Tracer, class Strategy>
class compiled_session final : public session {
 public:
  compiled_session(train_options const& options, dataset const& data, gaussian_model const& start)
      : trainer_(exec_, options, data, start) {}
  step_report step() override { return trainer_.step(); }
  int steps_done() const override { return trainer_.steps_done(); }
  gaussian_model model() const override { return trainer_.model(); }
  rendered render(camera const& view, vec3 background) override { return trainer_.render(view, background); }
  void save(std::filesystem::path const& path) const override { trainer_.save(path); }
  void load(std::filesystem::path const& path) override { trainer_.load(path); }
  training_state state() const override { return trainer_.state(); }
  void set_state(training_state const& state) override { trainer_.set_state(state); }
  profiler& profile() override {
    exec_.synchronize();
    return exec_.profile;
  }
  std::size_t peak_bytes() const override { return exec_.memory.peak; }
  std::size_t lt_bytes() const override { return trainer_.lt_bytes(); }
  row_info row() const override { return {E::name, Tracer::name, Strategy::name, Traits::sh_degree}; }

 private:
  E exec_;
  trainer<E, Traits, Tracer, Strategy> trainer_;
};

template <execution E, class Traits, class Tracer, class Strategy>
class compiled_renderer final : public renderer {
 public:
  compiled_renderer() : records_(exec_), tracer_(exec_), scene_(exec_, 0, Traits::sh_degree) {}
  void set_model(gaussian_model const& model) override {
    if (model.sh_degree != Traits::sh_degree) throw invalid_argument("renderer: the model has another SH degree");
    scene_.assign(model);
  }
  rendered render(camera const& view, render_options const& options) override {
    return render_image<Traits::sh_degree>(exec_, tracer_, records_, std::as_const(scene_).view(), view, options);
  }
  profiler& profile() override {
    exec_.synchronize();
    return exec_.profile;
  }
  std::size_t peak_bytes() const override { return exec_.memory.peak; }
  row_info row() const override { return {E::name, Tracer::name, Strategy::name, Traits::sh_degree}; }

 private:
  E exec_;
  frame_records<E> records_;
  Tracer tracer_;
  gaussians<E> scene_;
};

template <execution E, class Traits, class Tracer, class Strategy>
void register_row_of(int rank, bool (*available)(std::string*)) {
  register_row(
      {{E::name, Tracer::name, Strategy::name, Traits::sh_degree},
       rank,
       available,
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

}  // namespace gart
