#pragma once
// A capture and a model of the test's own making, and how a number reaches its output: a sum to be read, and a hash of
// all bits to be compared. In a namespace without a name: each object has these as it was compiled itself.
#include <gart/io/dataset.hpp>
#include <gart/scene/gaussians.hpp>
#include <gart/train/options.hpp>

#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

namespace {

struct numbers {
  std::uint32_t state = 12345;
  float next(float from, float to) {
    state = state * 1664525u + 1013904223u;
    return from + (to - from) * static_cast<float>(state >> 8) * 0x1p-24f;
  }
};

// Around the origin, seen by cameras at z = -3.
gart::gaussian_model some_model(int degree) {
  numbers draw;
  gart::gaussian_model m;
  m.resize(150, degree);
  for (float& v : m.mean) v = draw.next(-0.7f, 0.7f);
  for (float& v : m.log_scale) v = draw.next(-3.0f, -1.2f);
  for (float& v : m.quaternion) v = draw.next(-1, 1);
  for (float& v : m.opacity) v = draw.next(-2, 3);
  for (float& v : m.sh) v = draw.next(-0.3f, 0.6f);
  return m;
}

gart::dataset some_capture() {
  gart::dataset data;
  for (int i = 0; i < 4; ++i) {
    gart::dataset_view v;
    v.name = "view" + std::to_string(i);
    v.view.width = 44, v.view.height = 36;
    v.view.fx = v.view.fy = 50, v.view.cx = 21.5f, v.view.cy = 17;
    v.view.lens.k1 = 0.02f;
    v.view.position = {0.2 * i - 0.3, 0.1 * i, -3};
    v.image = gart::image8(44, 36, 3);
    for (std::size_t k = 0; k < v.image.data.size(); ++k) v.image.data[k] = static_cast<gart::u8>(7 * k % 230);
    data.train.push_back(v);
  }
  return data;
}

// All that a step can do, from the second one on.
gart::train_options some_options(int degree) {
  gart::train_options o;
  o.iterations = 4;
  o.max_gaussians = 160;
  o.sh_every = 1;
  o.exposure = o.vignetting = o.check_finite = true;
  o.mcmc.from = 1, o.mcmc.every = 1;
  return o;
}

void tell(std::string const& what, std::vector<float> const& values) {
  double sum = 0;
  std::uint64_t hash = 14695981039346656037u;
  for (float const v : values) {
    std::uint32_t bits;
    std::memcpy(&bits, &v, sizeof bits);
    sum += v > 0 ? v : -v;
    hash = (hash ^ bits) * 1099511628211u;
  }
  std::printf("%s %.6f %016llx\n", what.c_str(), sum, static_cast<unsigned long long>(hash));
}

void tell(std::string const& what, gart::gaussian_model const& m) {
  std::vector<float> all;
  for (auto const* part : {&m.mean, &m.log_scale, &m.quaternion, &m.opacity, &m.sh})
    all.insert(all.end(), part->begin(), part->end());
  tell(what, all);
}

}  // namespace
