#include "commands.hpp"
#include "field_names.hpp"
#include "options.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "timing.hpp"
#include "tradeoff_page.hpp"
#include "tradeoff_settings.hpp"
#include "tradeoff_views.hpp"

#include <gart/io/file.hpp>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <random>
#if defined(_OPENMP)
#include <omp.h>
#endif

namespace gart_cli {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct tradeoff_arguments {
  fs::path model, cameras, out;
  configuration_options configuration;
  std::string backward = "auto", background = "auto", clock = "wall";
  std::vector<std::string> settings;
  view_choice views;
  int repeats = 5;
  float reference_alpha_min = 0;
  bool quiet = false;
};

double mean(std::vector<double> const& values) {
  double sum = 0;
  for (double const v : values) sum += v;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

// The geometry after one more step of training, about: every number moves by up to Adam's rate for it.
void move_geometry(gart::gaussian_model& model, float extent, std::mt19937& engine) {
  gart::learning_rates const rates;
  std::uniform_real_distribution<float> uniform(-1, 1);
  for (float& x : model.mean) x += rates.mean * extent * uniform(engine);
  for (float& x : model.log_scale) x += rates.log_scale * uniform(engine);
  for (float& x : model.quaternion) x += rates.quaternion * uniform(engine);
  for (float& x : model.opacity) x += rates.opacity * uniform(engine);
}

class tradeoff_run {
 public:
  explicit tradeoff_run(tradeoff_arguments const& a) : a_(a), say_(a.quiet) {}

  int run() {
    stopwatch const whole;
    prepare();
    json result = description();
    result["settings"] = json::array(), result["absent"] = json::array();
    for (std::size_t i = 0; i < settings_.size(); ++i) {
      say_.state(
          "measuring " + std::to_string(i + 1) + "/" + std::to_string(settings_.size()) + "  " + settings_[i].name(),
          static_cast<double>(i) / static_cast<double>(settings_.size()));
      auto const absent = [&](std::string const& why) {
        result["absent"].push_back({{"name", settings_[i].name()}, {"why", why}});
      };
      try {
        through_format(settings_[i]);
        gart::resolve(settings_[i].use.configuration);
      } catch (gart::unsupported const& e) {
        absent(in_options(e.what()));
        continue;
      } catch (gart::io_error const& e) {
        absent(e.what());  // the format has no room for the kernel, or a library is not there
        continue;
      }
      result["settings"].push_back(measure(settings_[i]));
    }
    mark_fronts(result);
    result["seconds"] = whole.seconds(), result["reference_seconds"] = reference_seconds_;
    std::string const table = tradeoff_table(result);
    write_json(a_.out / "tradeoff.json", result);
    gart::write_file(a_.out / "table.txt", table);
    gart::write_file(a_.out / "tradeoff.html", tradeoff_page(result));
    say_.clear();
    if (!a_.quiet) {
      std::printf("%s\npage  %s\n", table.c_str(), (a_.out / "tradeoff.html").string().c_str());
    }
    return 0;
  }

 private:
  void prepare() {
#if defined(_OPENMP)
    if (a_.configuration.threads > 0) omp_set_num_threads(a_.configuration.threads);  // the reference's
#endif
    file_ = gart::load_model(a_.model);
    say_.notes(file_.notes);
    configuration exact;
    gart::configuration_request wanted = a_.configuration.request();
    wanted.backward = a_.backward;
    exact.configuration = configuration_request_for(file_, a_.model, wanted);
    gart::configuration_info const configuration = gart::resolve(exact.configuration);
    exact.configuration.backend = configuration.backend, exact.configuration.tracer = configuration.tracer,
    exact.configuration.backward = configuration.backward;
    exact.render = file_.render;
    settings_ = selected_settings(settings_of(exact), a_.settings);

    say_.state("reading views", 0);
    set_ = load_views(a_.cameras, a_.views, file_.origin);
    background_ = a_.background != "auto" ? a_.background : set_.background;
    for (setting& s : settings_) s.use.render.background = background_color(background_);
    prepare_folder(a_.out);

    reference_ = settings_.front().use.render;
    reference_.transmittance_min = 0, reference_.max_hits = 0;
    if (a_.reference_alpha_min > 0) reference_.alpha_min = a_.reference_alpha_min;
    auto const renderer = gart::make_renderer(settings_.front().use.configuration);
    renderer->set_model(file_.model);
    float const ssim_weight = gart::train_options().ssim_weight;
    for (std::size_t i = 0; i < set_.views.size(); ++i) {
      say_.state("reference of view " + std::to_string(i + 1) + "/" + std::to_string(set_.views.size()) + "  " +
                     set_.views[i].name,
                 0);
      auto& v = set_.views[i];
      set_color_gradient(v, renderer->render(v.view, settings_.front().use.render).color, reference_.background,
                         ssim_weight);
      stopwatch const reference;
      trace_reference(v, file_, reference_);
      reference_seconds_ += reference.seconds();
    }
  }

  json description() const {
    auto const& first = set_.views.front();
    auto const& exact = settings_.front().use;
    json names = json::array();
    std::size_t pixels = 0;
    for (auto const& v : set_.views) names.push_back(v.name), pixels += v.pixels.size();
    return {{"model", a_.model.filename().string()},
            {"cameras", fs::absolute(a_.cameras).lexically_normal().filename().string()},
            {"gaussians", file_.model.size()},
            {"sh_degree", file_.model.sh_degree},
            {"kernel_degree", file_.kernel_degree},
            {"backend", gart::to_string(exact.configuration.backend)},
            {"width", first.view.width},
            {"height", first.view.height},
            {"views", names},
            {"pixels", pixels},
            {"repeats", a_.repeats},
            {"clock", a_.clock},
            {"background", background_},
            {"gradient_of", first.truth.empty() ? "a random weight of every colour" : "the training loss"},
            {"reference", {{"alpha_min", reference_.alpha_min}, {"transmittance_min", reference_.transmittance_min}}}};
  }

  // Takes the model through a file of the setting's format, which may hold fewer bands.
  void through_format(setting& s) {
    packed_ = {}, file_bytes_ = 0;
    if (s.use.format.empty()) return;
    fs::path const file = a_.out / ("packed" + s.use.format);
    gart::write_splats(file, file_.model, gart::traits_of(file_.render, file_.kernel_degree), s.use.packing);
    packed_ = gart::read_splats(file);
    file_bytes_ = fs::file_size(file);
    fs::remove(file);
    s.use.configuration.sh_degree = std::min(s.use.configuration.sh_degree, packed_.sh_degree);
  }

  json measure(setting const& s) {
    gart::gaussian_model const model =
        gart::with_sh_degree(s.use.format.empty() ? file_.model : packed_, s.use.configuration.sh_degree);
    auto const renderer = gart::make_renderer(s.use.configuration);
    renderer->set_model(model);
    error_sums errors;
    std::map<std::string, double> stages;
    double hit_buffer_bytes = 0;
    double const share = 1 / static_cast<double>(set_.views.size());
    for (tradeoff_view const& v : set_.views) {
      gart::camera const view = s.use.shrink == 1 ? v.view : smaller(v.view, s.use.shrink);
      gart::image_float const gradient =
          s.use.shrink == 1 ? v.color_gradient : gradient_of_smaller(v.color_gradient, view.width, view.height);
      for (auto const& [label, samples] : time(*renderer, s, model, view, gradient)) {
        stages[label] += share * (s.use.render.rebuild_every > 1 ? mean(samples) : median(samples));
      }
      // A format may store the Gaussians in another order: they are not those of the reference, one by one.
      if (s.use.format.empty()) errors.add_gradients(v, renderer->gradients());
      hit_buffer_bytes += share * static_cast<double>(renderer->hit_buffer_bytes());
      gart::image_float const image = renderer->render(view, s.use.render).color;
      errors.add_image(v, s.use.shrink == 1 ? image : enlarged(image, v.view.width, v.view.height));
    }
    return entry(s, renderer->configuration(), errors, stages, hit_buffer_bytes, renderer->peak_bytes());
  }

  static constexpr char const* processor = "processor";

  // Milliseconds of every stage, and of the processor, repeat by repeat. A refitted tree is timed over whole intervals
  // between builds, while the Gaussians move. In the end they are back in place.
  std::map<std::string, std::vector<double>> time(gart::renderer& renderer, setting const& s,
                                                  gart::gaussian_model const& model, gart::camera const& view,
                                                  gart::image_float const& gradient) {
    std::map<std::string, std::vector<double>> samples;
    int const interval = s.use.render.rebuild_every;
    int const repeats = (a_.repeats + interval - 1) / interval * interval;
    gart::gaussian_model moved = model;
    std::mt19937 engine(0);
    renderer.differentiate(view, s.use.render, gradient);  // allocates, and warms the caches
    for (int i = 0; i < repeats; ++i) {
      if (interval > 1) {
        move_geometry(moved, set_.extent, engine);
        renderer.set_model(moved);
      }
      renderer.profile().clear();
      renderer.profile().enable(true);
      double const before = processor_ms();
      renderer.differentiate(view, s.use.render, gradient);
      samples[processor].push_back(processor_ms() - before);
      for (auto const& [label, stage] : renderer.profile().stages()) {
        samples[label].resize(static_cast<std::size_t>(i));  // a stage may be there in some repeats only
        samples[label].push_back(stage.milliseconds);
      }
      renderer.profile().enable(false);
    }
    for (auto& [label, list] : samples) list.resize(static_cast<std::size_t>(repeats));
    if (interval > 1) {
      renderer.set_model(model);
      renderer.differentiate(view, s.use.render, gradient);
    }
    return samples;
  }

  static gart::camera smaller(gart::camera const& view, int by) {
    return gart::resized(view, std::max(1, view.width / by), std::max(1, view.height / by));
  }

  json entry(setting const& s, gart::configuration_info const& configuration, error_sums const& errors,
             std::map<std::string, double> const& stages, double hit_buffer_bytes, std::size_t peak_bytes) const {
    auto const of = [&](char const* label) { return stages.count(label) ? stages.at(label) : 0.0; };
    bool const packed = !s.use.format.empty();
    auto const groups = errors.gradients();
    double worst = 0;
    for (auto const& [name, error] : groups) worst = error <= worst ? worst : error;
    json gradients = groups;
    if (packed)
      for (char const* group : tradeoff_groups) gradients[group] = nullptr;
    auto without_processor = stages;
    without_processor.erase(processor);
    double const total = of("gradients"), forward = of("forward"), backward = of("backward");
    return {{"name", s.name()},
            {"knob", s.knob},
            {"tracer", gart::to_string(configuration.tracer)},
            {"backward", configuration.backward},
            {"sh_degree", configuration.sh_degree},
            {"kernel_degree", configuration.kernel_degree},
            {"approximations", approximations_of(s.use.render, configuration)},
            {"rebuild_every", s.use.render.rebuild_every},
            {"shrink", s.use.shrink},
            {"file_bytes", packed ? json(file_bytes_) : json()},
            {"image", {{"max", errors.image_max()}, {"rms", errors.image_rms()}, {"psnr", errors.psnr()}}},
            {"gradients", gradients},
            {"gradient_worst", packed ? json() : json(worst)},
            {"total_ms", total},
            {"prepare_ms", total - forward - backward},
            {"forward_ms", forward},
            {"backward_ms", backward},
            {"processor_ms", of(processor)},
            {"stages_ms", without_processor},
            {"hit_buffer_bytes", hit_buffer_bytes},
            {"peak_bytes", peak_bytes}};
  }

  tradeoff_arguments const& a_;
  progress say_;
  gart::model_file file_;
  gart::gaussian_model packed_;    // as it came back from the setting's format
  std::uintmax_t file_bytes_ = 0;  // of the model in that format
  std::vector<setting> settings_;
  view_set set_;
  std::string background_;
  gart::render_options reference_;
  double reference_seconds_ = 0;
};

}  // namespace

void add_tradeoff(CLI::App& app, command& selected) {
  auto a = std::make_shared<tradeoff_arguments>();
  CLI::App* tradeoff = app.add_subcommand(
      "tradeoff",
      "Measure what each approximation costs and buys: errors against a reference in double, times, bytes.");
  add_model(*tradeoff, a->model)->required();
  add_open(*tradeoff, "CAMERAS", a->cameras, "",
           "A capture, whose photographs give the loss that is\ndifferentiated; or a camera JSON as for gart "
           "render")
      ->required();
  add_open(*tradeoff, "--out", a->out, "DIR", "Folder of the results; made if missing")->required();
  add_open(*tradeoff, "--settings", a->settings, "A,B",
           "Only these knobs or settings, comma-separated: transmittance_min,\ntracer=bvh and so on; exact is always "
           "measured")
      ->delimiter(',');
  add_value(*tradeoff, "--views", a->views.count, "N", "Views, evenly spread; more for a mean over more of the scene")
      ->check(between(1, 10000));
  add_value(*tradeoff, "--pixels", a->views.pixels, "N",
            "Pixels of each view that are compared, at random; times\nare of whole views")
      ->check(between(1, 1e9));
  add_value(*tradeoff, "--repeats", a->repeats, "N", "Timed runs a view and setting; the median counts")
      ->check(between(1, 1000));
  add_downscale(*tradeoff, a->views.downscale);
  add_value(*tradeoff, "--background", a->background, "NAME", "white or black; auto: as gart train chooses")
      ->check(one_of({"auto", "white", "black"}));
  add_value(*tradeoff, "--backward", a->backward, "NAME",
            "Gradient method of all settings that do not name one:\nauto, pixel, hybrid, primitive or deterministic")
      ->check(one_of_methods());
  add_value(*tradeoff, "--reference-alpha-min", a->reference_alpha_min, "A",
            "Opacity below which the reference sees no hit, 0: the\nmodel's own, with which it was trained; "
            "1e-5 shows what\nthat cut-off itself leaves out")
      ->check(between(0, 0.99));
  add_value(*tradeoff, "--clock", a->clock, "NAME",
            "Time axis of the fronts: wall, or processor, the time of all\nthreads together, for a CPU "
            "with other work")
      ->check(one_of({"wall", "processor"}));
  add_quiet(*tradeoff, a->quiet);
  add_configuration_options(*tradeoff, a->configuration);
  tradeoff->footer(
      "\nThe reference traces in double, ends no ray early and evaluates every band of colour. Each setting turns one\n"
      "knob of the model as it was trained (exact), or a few. Errors: the largest and the root mean square of the\n"
      "colour's, and for each parameter group |gradient - reference| / |reference|. Times: a forward and a backward\n"
      "pass of a view with all that prepares them.\n"
      "\nWrites into DIR:\n"
      "  tradeoff.html   one page: error against time, settings that another one beats in both greyed, and the table\n"
      "  table.txt       the table as printed\n"
      "  tradeoff.json   everything, every stage's time included\n"
      "\nExamples:\n"
      "  gart tradeoff run/model.ply lego --out trade\n"
      "  gart tradeoff scene.ply path.json --out trade --settings alpha_min,transmittance_min --views 4 --repeats 20");
  tradeoff->callback([a, &selected] { selected = [a] { return tradeoff_run(*a).run(); }; });
}

}  // namespace gart_cli
