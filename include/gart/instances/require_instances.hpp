#pragma once
/// \file
/// What is no instance is refused, by name, field and remedy: invalid_argument.

#include <gart/core/error.hpp>
#include <gart/instances/instance.hpp>
#include <gart/scene/similarity.hpp>

#include <cmath>
#include <string>

namespace gart { inline namespace GART_ISA {

/// Of one, of so many models; `name` is how the caller calls it.
inline void require_instance(instance const& one, std::size_t models, std::string const& name) {
  auto const refuse = [&](std::string const& what) { throw invalid_argument(name + what); };
  if (one.model >= models)
    refuse(".model is " + std::to_string(one.model) + ", and there are " + std::to_string(models) +
           " models: numbers begin at 0");
  if (!is_rotation(one.rotation))
    refuse(".rotation is none: its columns must be finite, of length 1 and at right angles, without reflection");
  if (!(one.scale > 0 && std::isfinite(one.scale))) refuse(".scale must be more than 0 and finite");
  for (int k = 0; k < 3; ++k)
    if (!std::isfinite(one.position[k])) refuse(".position is not finite");
}

/// Of a list that makes a scene of an SH degree.
inline void require_instances(span<gaussians_view<float const> const> models, span<instance const> instances,
                              int sh_degree) {
  if (instances.empty()) throw invalid_argument("instances: there are none: a scene needs at least one");
  for (std::size_t m = 0; m < models.size(); ++m)
    if (models[m].sh_degree < 0 || models[m].sh_degree > sh_degree)
      throw invalid_argument("instances: models[" + std::to_string(m) + "] is of SH degree " +
                             std::to_string(models[m].sh_degree) + ", and the scene of " + std::to_string(sh_degree) +
                             ": make the scene's at least that");
  std::size_t count = 0;
  for (std::size_t i = 0; i < instances.size(); ++i) {
    require_instance(instances[i], models.size(), "instances[" + std::to_string(i) + "]");
    count += models[instances[i].model].count;
  }
  require_count(count);
}

}}  // namespace gart::GART_ISA
