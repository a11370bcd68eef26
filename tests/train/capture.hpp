#pragma once
// A capture so small that a training on it takes a moment: views of one cloud, to be learned from another.

#include <support/policies.hpp>
#include <support/scene_by_kind.hpp>

#include <gart/io/dataset.hpp>
#include <gart/train/state.hpp>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>

namespace gart_test {

// An array of what is learned besides the Gaussians.
inline std::vector<float> floats(gart::training_state const& s, char const* name) { return s.parts.get<float>(name); }
inline std::vector<double> doubles(gart::training_state const& s, char const* name) {
  return s.parts.get<double>(name);
}
inline std::vector<gart::u32> words(gart::training_state const& s, char const* name) {
  return s.parts.get<gart::u32>(name);
}

template <class E>
std::vector<float> on_host(E& exec, gart::span<float const> values) {
  std::vector<float> all(values.size());
  exec.copy_out(all.data(), values.data(), all.size() * sizeof(float));
  return all;
}

// The rows of an adam_table (exposure/adam_table.hpp).
struct table_state {
  std::vector<float> value, first, second;
  std::vector<gart::u32> visits;
  template <class Table>
  void put_into(Table& table) const {
    gart::named_arrays all;
    all.set("", value), all.set("/first", first), all.set("/second", second), all.set("/visits", visits);
    table.load(all, "");
  }
};
template <class Table>
table_state state_of(Table const& table) {
  gart::named_arrays all;
  table.save(all, "");
  return {all.get<float>(""), all.get<float>("/first"), all.get<float>("/second"), all.get<gart::u32>("/visits")};
}

inline gart::gaussian_model cloud(std::uint64_t seed, float spread) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<float> normal;
  gart::gaussian_model m;
  m.resize(150, 1);
  for (auto& x : m.mean) x = spread * normal(engine);
  for (auto& x : m.log_scale) x = -1.8f + 0.3f * normal(engine);
  for (auto& x : m.quaternion) x = normal(engine);
  for (auto& x : m.opacity) x = normal(engine);
  for (auto& x : m.sh) x = 0.5f * normal(engine);
  return m;
}

// A view of a cloud. Its body is in runs.cpp (gart_test's BODIES train_runs).
template <class E>
traced<E> pictured(E& exec, gart::gaussian_model const& model, gart::camera const& view);

template <class E>
gart::dataset capture(E& exec, std::uint64_t seed) {
  gart::gaussian_model const truth = cloud(seed, 0.6f);
  gart::dataset data;
  for (int v = 0; v < 4; ++v) {
    gart::dataset_view view;
    view.name = std::to_string(v);
    view.view.width = 29, view.view.height = 22;
    view.view.fx = view.view.fy = 30, view.view.cx = 14.5f, view.view.cy = 11;
    float const angle = 0.4f * static_cast<float>(v), c = std::cos(angle), s = std::sin(angle);
    view.view.rotation = gart::mat3(gart::vec3(c, 0, -s), gart::vec3(0, 1, 0), gart::vec3(s, 0, c));
    view.view.position = gart::vec3d(-4.0 * s, 0, -4.0 * c);
    auto const picture = pictured(exec, truth, view.view);
    view.image = gart::image8(view.view.width, view.view.height, 3);
    for (std::size_t i = 0; i < picture.color.size(); ++i)
      view.image.data[i] = static_cast<gart::u8>(std::lround(255 * std::clamp(picture.color[i], 0.0f, 1.0f)));
    data.train.push_back(std::move(view));
  }
  return data;
}

// With maps of the distances that its views see.
template <class E>
gart::dataset mapped_capture(E& exec, std::uint64_t seed) {
  gart::dataset data = capture(exec, seed);
  gart::gaussian_model const truth = cloud(seed, 0.6f);
  for (gart::dataset_view& v : data.train) {
    auto const seen = pictured(exec, truth, v.view);
    v.depth = gart::image_float(v.view.width, v.view.height, 1);
    for (std::size_t i = 0; i < seen.depth.size(); ++i) {
      float const alpha = 1 - seen.transmittance[i];
      v.depth.data[i] = alpha > 0.5f ? seen.depth[i] / alpha : 0;
    }
  }
  return data;
}

}  // namespace gart_test
