// PLY of Gaussians, read by property name (ply_body.hpp) and written in the INRIA layout.
// http://paulbourke.net/dataformats/ply/

#include "packing.hpp"
#include "ply_body.hpp"

#include <gart/core/error.hpp>
#include <gart/io/file.hpp>
#include <gart/io/origin.hpp>
#include <gart/io/ply.hpp>
#include <gart/math/logit.hpp>
#include <gart/scene/features.hpp>

namespace gart {
namespace {

using namespace io::ply;
using io::put;

// INRIA's order, and features behind it; who reads leaves the normals out, since nothing uses them.
std::vector<std::string> splat_columns(int degree, bool normals, int features = 0) {
  std::vector<std::string> names{"x", "y", "z"};
  if (normals) names.insert(names.end(), {"nx", "ny", "nz"});
  auto const numbered = [&](char const* stem, int n) {
    for (int i = 0; i < n; ++i) names.push_back(stem + std::to_string(i));
  };
  numbered("f_dc_", 3);
  numbered("f_rest_", 3 * (sh_coefficients(degree) - 1));
  names.push_back("opacity");
  numbered("scale_", 3);
  numbered("rot_", 4);
  numbered("feature_", features);
  return names;
}

// Puts column c of vertex i, in the order of splat_columns(degree, false, features), into its array.
struct splat_store {
  gaussian_model& model;
  std::vector<double>* exact = nullptr;   // where means go in double
  std::vector<double>* filter = nullptr;  // and mip-splatting's filter_3D, behind all columns

  // By the reader of every format (packing.hpp).
  double settled(std::size_t c, double value) const {
    std::size_t const opacity = 3 + 3 * static_cast<std::size_t>(sh_coefficients(model.sh_degree));
    if (!std::isinf(value) || c < opacity) return value;
    float const v = static_cast<float>(value);
    return static_cast<double>(c == opacity ? io::settled_opacity(v) : c < opacity + 4 ? io::settled_scale(v) : v);
  }
  void resize(std::size_t n) const {
    model.resize(n, model.sh_degree);
    if (exact) exact->resize(3 * n);
    if (filter) filter->resize(n);
  }
  void operator()(std::size_t c, std::size_t i, double value) const {
    float const v = static_cast<float>(value);
    std::size_t const k = static_cast<std::size_t>(sh_coefficients(model.sh_degree)), rest = k - 1;
    if (c < 3) {
      if (exact) (*exact)[3 * i + c] = value;
      model.mean[3 * i + c] = v;
      return;
    }
    c -= 3;
    if (c < 3) {
      model.sh[3 * k * i + c] = v;
      return;
    }
    c -= 3;
    if (c < 3 * rest) {
      model.sh[3 * (k * i + 1 + c % rest) + c / rest] = v;
      return;
    }
    c -= 3 * rest;
    if (c == 0) {
      model.opacity[i] = v;
      return;
    }
    c -= 1;
    if (c < 3) {
      model.log_scale[3 * i + c] = v;
      return;
    }
    c -= 3;
    if (c < 4) {
      model.quaternion[4 * i + c] = v;
      return;
    }
    c -= 4;
    std::size_t const features = static_cast<std::size_t>(model.feature_count);
    if (c < features)
      model.features[features * i + c] = v;
    else
      (*filter)[i] = value;
  }
};

// Means in double have an origin of their own, where floats would lose digits.
vec3d set_exact_means(gaussian_model& model, std::vector<double> const& exact) {
  std::vector<vec3d> places;
  for (std::size_t i = 0; i < model.size(); ++i) {
    vec3d const p(exact[3 * i], exact[3 * i + 1], exact[3 * i + 2]);
    if (std::abs(p.x) <= 1e18 && std::abs(p.y) <= 1e18 && std::abs(p.z) <= 1e18) places.push_back(p);
  }
  vec3d const origin = origin_for(places);
  for (std::size_t i = 0; i < exact.size(); ++i)
    model.mean[i] = static_cast<float>(exact[i] - origin[static_cast<int>(i % 3)]);
  return origin;
}

// Mip-splatting's Gaussians the way it draws them. Along each axis s^2 becomes s^2 + f^2, and the opacity falls with
// the density. https://github.com/autonomousvision/mip-splatting
void fuse_filter(gaussian_model& model, std::vector<double> const& filter) {
  for (std::size_t i = 0; i < model.size(); ++i) {
    if (!(filter[i] > 0) || !std::isfinite(filter[i])) continue;
    double logit = static_cast<double>(model.opacity[i]), log_density = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      float& log_scale = model.log_scale[3 * i + c];
      double const ratio = filter[i] / std::exp(static_cast<double>(log_scale));
      double const wider = ratio < 1e150 ? 0.5 * std::log1p(ratio * ratio) : std::log(ratio);
      log_scale = static_cast<float>(static_cast<double>(log_scale) + wider), log_density -= wider;
    }
    model.opacity[i] = io::opacity_logit(sigmoid_in_double(logit) * std::exp(log_density));
  }
}

// `origin`: added to that of the traits.
gaussian_model splats_of(ply_file const& file, std::vector<std::string>* notes, vec3d& origin) {
  element const& e = vertices(file);
  if (!find(e, "f_dc_0") && (find(e, "red") || !find(e, "opacity"))) {
    file.refuse("property 'f_dc_0' is missing: these are points, not Gaussians", "name the model.ply of a training");
  }
  if (find(e, "scale_0") && find(e, "scale_1") && !find(e, "scale_2")) {
    file.refuse("property 'scale_2' is missing: these are 2D Gaussians",
                "gart renders 3D Gaussians: train or convert a 3D model");
  }
  auto const rest = std::count_if(e.properties.begin(), e.properties.end(),
                                  [](property const& p) { return p.name.rfind("f_rest_", 0) == 0; });
  gaussian_model model;
  while (model.sh_degree < 4 && 3 * (sh_coefficients(model.sh_degree) - 1) != rest) ++model.sh_degree;
  if (model.sh_degree > 3) {
    file.refuse("there are " + std::to_string(rest) + " properties f_rest_*, not 0, 9, 24 or 45",
                "gart reads spherical harmonics of degree 0 to 3: export the model with one of them");
  }
  while (model.feature_count <= most_features && find(e, "feature_" + std::to_string(model.feature_count)))
    ++model.feature_count;
  if (model.feature_count > most_features)
    file.refuse("there are more properties feature_* than " + std::to_string(most_features),
                "export the model with fewer");
  std::vector<std::string> const columns = splat_columns(model.sh_degree, false, model.feature_count);
  require_columns(file, e, columns, "export the model with every property of the INRIA layout");
  io::unusable bad;
  std::vector<double> exact;
  std::vector<double> filter;
  bool const in_double = find(e, "x")->type == scalar::f64, filtered = find(e, "filter_3D") != nullptr;
  std::vector<std::string> read = columns;
  if (filtered) read.push_back("filter_3D");
  read_vertices(file, read, splat_store{model, in_double ? &exact : nullptr, filtered ? &filter : nullptr}, bad);
  if (in_double) origin = set_exact_means(model, exact);
  if (filtered) {
    fuse_filter(model, filter);
    if (notes)
      notes->push_back(file.name +
                       " is of mip-splatting: its filter_3D is taken into scales and opacities, its filter "
                       "of pixels is antialias");
  }
  for (std::size_t i = 0; i < model.size(); ++i) io::settle_rotation(&model.quaternion[4 * i]);
  for (std::size_t i = 0; i < model.size(); ++i)
    if (io::no_rotation(&model.quaternion[4 * i]))
      bad.add(i, [&] {
        return "vertex " + std::to_string(file.owners.global(static_cast<index_t>(i))) +
               ", properties rot_0 to rot_3 are all zero, which is no rotation";
      });
  if (bad.records().empty()) return model;
  // A Gaussian's owner follows from its number in the file.
  if (file.owners.ranks > 1) file.refuse(bad.first(), "gart convert leaves it out: start with what that writes");
  return selected(model, bad.others(model.size(), "Gaussian", file.name, notes));
}

std::string header_of(std::filesystem::path const& path, gaussian_model const& model, u64 count,
                      splat_traits const& traits, bool world = false) {
  std::string text = header_start(path, world ? with_origin(traits, vec3d(0.0)) : traits);
  text += "element vertex " + std::to_string(count) + "\n";
  std::string const type = world ? "property double " : "property float ";
  for (std::string const& name : splat_columns(model.sh_degree, true, model.feature_count))
    text += (name.size() == 1 ? type : "property float ") + name + "\n";
  return text + "end_header\n";
}

// Gaussian i, as a vertex; from zero where there is an origin.
void put_vertex(std::string& text, gaussian_model const& model, std::size_t i, vec3d const* origin = nullptr) {
  std::size_t const k = static_cast<std::size_t>(sh_coefficients(model.sh_degree));
  for (std::size_t c = 0; c < 3; ++c) {
    float const mean = model.mean[3 * i + c];
    origin ? put(text, static_cast<double>(mean) + (*origin)[static_cast<int>(c)]) : put(text, mean);
  }
  for (int c = 0; c < 3; ++c) put(text, 0.0f);
  float const* sh = model.sh.data() + 3 * k * i;
  for (std::size_t c = 0; c < 3; ++c) put(text, sh[c]);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t j = 1; j < k; ++j) put(text, sh[3 * j + c]);
  }
  put(text, model.opacity[i]);
  for (std::size_t c = 0; c < 3; ++c) put(text, model.log_scale[3 * i + c]);
  for (std::size_t c = 0; c < 4; ++c) put(text, model.quaternion[4 * i + c]);
  std::size_t const features = static_cast<std::size_t>(model.feature_count);
  for (std::size_t c = 0; c < features; ++c) put(text, model.features[features * i + c]);
}

void require_agreement(std::filesystem::path const& path, gaussian_model const& model) {
  if (model.sh_degree < 0 || model.sh_degree > 3 || !model.arrays_agree())
    throw invalid_argument("the arrays of the model to write to " + path.string() + " do not agree in size");
}

void write_ply(std::filesystem::path const& path, gaussian_model const& model, splat_traits const& traits, bool world) {
  require_agreement(path, model);
  vec3d const origin = origin_of(traits, path.string());
  std::string text = header_of(path, model, model.size(), traits, world);
  write_file(path, [&](std::ostream& out) {
    for (std::size_t i = 0; i < model.size(); ++i) {
      put_vertex(text, model, i, world ? &origin : nullptr);
      drain(out, text, chunk);
    }
    drain(out, text, 0);
  });
}

splat_traits traits_of(ply_file const& file, vec3d const& origin) {
  splat_traits traits = file.head.traits;
  if (find(vertices(file), "filter_3D")) traits.try_emplace("antialias", "");
  if (origin != vec3d(0.0)) traits = with_origin(traits, origin + origin_of(traits, file.name));
  return traits;
}

}  // namespace

gaussian_model read_splat_ply(std::filesystem::path const& path, splat_traits* traits,
                              std::vector<std::string>* notes) {
  ply_file const file = open(path);
  vec3d origin(0.0);
  gaussian_model model = splats_of(file, notes, origin);
  if (traits) *traits = traits_of(file, origin);
  return model;
}

gaussian_model read_splat_ply_rows(std::filesystem::path const& path, row_owners const& owners, u64& total,
                                   splat_traits* traits) {
  ply_file const file = open_rows(path, owners, total);
  vec3d origin(0.0);
  gaussian_model model = splats_of(file, nullptr, origin);
  if (traits) *traits = traits_of(file, origin);
  if (file.owners.ranks == owners.ranks) return model;
  total = model.size();
  return rows_of(model, owners);
}

void write_splat_ply(std::filesystem::path const& path, gaussian_model const& model, splat_traits const& traits) {
  write_ply(path, model, traits, false);
}

void write_splat_ply_rows(shared_file& file, std::filesystem::path const& path, gaussian_model const& mine,
                          row_owners const& owners, u64 total, splat_traits const& traits) {
  require_agreement(path, mine);
  std::string const head = header_of(path, mine, total, traits);
  u64 const record = sizeof(float) * splat_columns(mine.sh_degree, true, mine.feature_count).size();
  if (owners.rank == 0) file.write(0, head.data(), head.size());
  std::string text;
  owners.for_each_run(total, [&](u64 first, u64 count, u64 row) {
    u64 at = head.size() + first * record;
    for (u64 i = 0; i < count; ++i) {
      put_vertex(text, mine, row + i);
      if (text.size() < chunk && i + 1 < count) continue;
      file.write(at, text.data(), text.size());
      at += text.size();
      text.clear();
    }
  });
}

extern splat_format const ply_format;
splat_format const ply_format = {
    "PLY",
    ".ply",
    {.traits = true, .kernel = true, .world = true, .features = true},
    [](std::string_view first) { return first.starts_with("ply\n") || first.starts_with("ply\r"); },
    read_splat_ply,
    [](std::filesystem::path const& path, gaussian_model const& model, splat_traits const& traits,
       splat_packing const& packing) { write_ply(path, model, traits, packing.world); }};

}  // namespace gart
