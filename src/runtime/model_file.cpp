#include <gart/core/error.hpp>
#include <gart/runtime/kinds.hpp>
#include <gart/runtime/model_file.hpp>
#include <gart/scene/select.hpp>
#include <gart/scene/similarity.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <string>

namespace gart {

model_file load_model(std::filesystem::path const& path) { return load_model(path, row_owners()); }

model_file load_model(std::filesystem::path const& path, row_owners const& owners) {
  splat_traits traits;
  model_file file;
  file.model = read_splat_rows(path, owners, file.total, &traits, &file.notes);
  if (auto const kernel = traits.find("kernel_degree"); kernel != traits.end()) {
    bool const known = std::any_of(std::begin(kernel_degrees), std::end(kernel_degrees),
                                   [&](int degree) { return std::to_string(degree) == kernel->second; });
    if (!known) {
      throw io_error(path.string(), "comment gart kernel_degree is '" + kernel->second + "'",
                     "1, 2, 3, 4, 5 or 8 belongs there; remove the comment for Gaussians (2)");
    }
    file.kernel_degree = std::atoi(kernel->second.c_str());
  }
  file.origin = origin_of(traits, path.string());
  auto const number = [&](char const* key, float& value, float most = 1) {
    auto const found = traits.find(key);
    if (found == traits.end()) return;
    char* end = nullptr;
    float const parsed = std::strtof(found->second.c_str(), &end);
    if (end == found->second.c_str() || !(parsed >= 0 && parsed < most)) {
      throw io_error(path.string(), std::string("comment gart ") + key + " is '" + found->second + "'",
                     "a number from 0" + (most < 1e9f ? " to " + std::to_string(static_cast<int>(most)) : "") +
                         " belongs there; remove the comment for the default");
    }
    value = parsed;
  };
  number("alpha_min", file.render.alpha_min);
  number("t_min", file.render.transmittance_min);  // its name in older files
  number("transmittance_min", file.render.transmittance_min);
  number("near", file.render.near, 3e38f);
  if (auto const found = traits.find("antialias"); found != traits.end() && found->second.empty())
    file.render.antialias = default_antialias;  // another program's, which does not say how wide
  else
    number("antialias", file.render.antialias, 100);
  if (auto const found = traits.find("max_hits"); found != traits.end()) {
    char* end = nullptr;
    unsigned long const parsed = std::strtoul(found->second.c_str(), &end, 10);
    if (end == found->second.c_str() || *end != '\0' || found->second[0] == '-' || parsed > max_hits_most) {
      throw io_error(path.string(), "comment gart max_hits is '" + found->second + "'",
                     "a whole number belongs there, 0 for no cap; remove the comment for none");
    }
    file.render.max_hits = static_cast<u32>(parsed);
  }
  return file;
}

model_file load_models(std::vector<placed_splats> const& splats) {
  model_file all;
  for (placed_splats const& one : splats) {
    model_file part = load_model(one.file);
    similarity where{rotation_of(one.rotation), one.scale, one.translation};
    vec3d const at = where(part.origin);
    if (&one == &splats.front() && part.origin != vec3d(0.0)) all.origin = at;
    where.translation = at - all.origin;
    if (where.rotation != mat3d(1.0) || where.scale != 1 || where.translation != vec3d(0.0))  // else it keeps its bits
      apply(where, part.model);
    for (std::string& note : part.notes) all.notes.push_back(std::move(note));
    if (&one == &splats.front()) {
      all.render = part.render, all.kernel_degree = part.kernel_degree, all.model = std::move(part.model);
    } else {
      if (part.kernel_degree != all.kernel_degree)
        throw unsupported(one.file.string() + ": its kernel degree is " + std::to_string(part.kernel_degree) +
                          ", and that of the scene's first model " + std::to_string(all.kernel_degree) +
                          " (models of one scene have one)");
      append(all.model, std::move(part.model));
    }
    all.total += part.total;
  }
  require_count(all.model.size());
  return all;
}

splat_traits traits_of(render_options const& render, int kernel_degree) {
  render_options const defaults;
  splat_traits traits;
  auto const put = [&](char const* key, float value, float otherwise) {
    if (value == otherwise) return;
    char text[32];
    std::snprintf(text, sizeof text, "%.9g", static_cast<double>(value));
    traits[key] = text;
  };
  put("alpha_min", render.alpha_min, defaults.alpha_min);
  put("transmittance_min", render.transmittance_min, defaults.transmittance_min);
  put("near", render.near, defaults.near);
  put("antialias", render.antialias, defaults.antialias);
  if (kernel_degree != 2) traits["kernel_degree"] = std::to_string(kernel_degree);
  if (render.max_hits != 0) traits["max_hits"] = std::to_string(render.max_hits);
  return traits;
}

void save_model(std::filesystem::path const& path, model_file const& file) {
  write_splats(path, file.model, with_origin(traits_of(file.render, file.kernel_degree), file.origin));
}

}  // namespace gart
