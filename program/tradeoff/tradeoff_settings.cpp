#include "tradeoff_settings.hpp"

#include "commands.hpp"

#include <algorithm>
#include <cstdio>
#include <gart/backward/gradient_methods.hpp>
#include <iterator>

namespace gart_cli {

namespace {

// Three digits.
std::string rounded(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

class table {
 public:
  explicit table(configuration const& exact) : exact_(exact) { all_.push_back({"exact", "", exact}); }

  template <class F>
  void add(std::string const& knob, std::string const& value, F const& turn) {
    setting s{knob, value, exact_};
    turn(s.use);
    all_.push_back(s);
  }
  // One knob over several values, without the one it already has.
  template <class Member, class Value>
  void sweep(std::string const& knob, Member const& member, std::vector<Value> const& values) {
    for (Value const& v : values) {
      configuration probe = exact_;
      if (member(probe) == v) continue;
      if constexpr (std::is_arithmetic_v<Value>)
        add(knob, rounded(v), [&](configuration& c) { member(c) = v; });
      else if constexpr (gart::named<Value>)
        add(knob, gart::to_string(v), [&](configuration& c) { member(c) = v; });
      else
        add(knob, v, [&](configuration& c) { member(c) = v; });
    }
  }
  std::vector<setting> take() { return std::move(all_); }

 private:
  configuration exact_;
  std::vector<setting> all_;
};

}  // namespace

std::vector<setting> settings_of(configuration const& exact) {
  using c = configuration;
  table t(exact);
  t.sweep(
      "alpha_min", [](c& x) -> float& { return x.render.alpha_min; },
      std::vector<float>{0.5f / 255, 1.0f / 255, 2.0f / 255, 4.0f / 255, 0.02f, 0.05f});
  t.sweep(
      "transmittance_min", [](c& x) -> float& { return x.render.transmittance_min; },
      std::vector<float>{0.0f, 1e-5f, 1e-4f, 1e-3f, 1e-2f, 0.05f});
  t.sweep(
      "max_hits", [](c& x) -> gart::u32& { return x.render.max_hits; }, std::vector<gart::u32>{64, 32, 16, 8});
  std::vector<int> degrees;
  for (int d = exact.configuration.sh_degree - 1; d >= 0; --d) degrees.push_back(d);
  t.sweep(
      "sh_degree", [](c& x) -> int& { return x.configuration.sh_degree; }, degrees);
  t.sweep(
      "kernel_degree", [](c& x) -> int& { return x.configuration.kernel_degree; }, std::vector<int>{2, 4});
  t.sweep(
      "hit_format", [](c & x) -> auto& { return x.configuration.hit_format; },
      std::vector{gart::hit_format_kind::half});
  t.sweep(
      "backward", [](c& x) -> std::string& { return x.configuration.backward; }, gart::gradient_method_names());
  t.sweep(
      "tracer", [](c & x) -> auto& { return x.configuration.tracer; },
      std::vector{gart::tracer_kind::tiles, gart::tracer_kind::bvh, gart::tracer_kind::embree});
  for (int const every : {4, 16}) {
    t.add("rebuild_every", std::to_string(every),
          [&](c& x) { x.configuration.tracer = gart::tracer_kind::bvh, x.render.rebuild_every = every; });
  }
  for (int const shrink : {2, 4}) {
    t.add("resolution", "1/" + std::to_string(shrink), [&](c& x) { x.shrink = shrink; });
  }
  for (gart::splat_format const* const f : gart::splat_formats())
    if (f->write && f->extension != std::string(".ply"))
      t.add("format", std::string(f->extension).substr(1), [&](c& x) { x.format = f->extension; });
  t.add("together", "format=spz+sh_bits=8",
        [](c& x) { x.format = ".spz", x.packing.sh1_bits = x.packing.sh_bits = 8; });
  t.add("together", "alpha_min=0.02+transmittance_min=0.01",
        [](c& x) { x.render.alpha_min = 0.02f, x.render.transmittance_min = 0.01f; });
  t.add("together", "alpha_min=0.02+transmittance_min=0.01+resolution=1/2",
        [](c& x) { x.render.alpha_min = 0.02f, x.render.transmittance_min = 0.01f, x.shrink = 2; });
  return t.take();
}

std::vector<setting> selected_settings(std::vector<setting> const& all, std::vector<std::string> const& wanted) {
  if (wanted.empty()) return all;
  std::vector<setting> out{all.front()};
  for (std::string const& word : wanted) {
    bool found = false;
    std::string knobs;
    for (setting const& s : all) {
      if (knobs.size() < s.knob.size() || knobs.compare(knobs.size() - s.knob.size(), s.knob.size(), s.knob) != 0)
        knobs += (knobs.empty() ? "" : ", ") + s.knob;
      if (s.knob != word && s.name() != word) continue;
      found = true;
      bool const there = std::any_of(out.begin(), out.end(), [&](setting const& o) { return o.name() == s.name(); });
      if (!there) out.push_back(s);
    }
    if (!found) {
      throw usage_error("--settings " + word + ": no such knob or setting; there are " + knobs +
                        ", and their values as in tradeoff.json, such as transmittance_min=0.01");
    }
  }
  return out;
}

}  // namespace gart_cli
