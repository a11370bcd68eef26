#pragma once
/// \file
/// The rays of a batch as kernels read them, and what refuses those that are none.

#include <gart/algorithm/reduce.hpp>
#include <gart/bvh/box.hpp>
#include <gart/camera/model.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/exec/parallel.hpp>
#include <gart/rays/ray_batch.hpp>

namespace gart { inline namespace GART_ISA {

/// Trivially copyable: kernels hold one by value.
struct batch_rays {
  float const* origins = nullptr;     ///< [R][3]; null: the frame
  float const* directions = nullptr;  ///< [R][3]
  float const* t_max = nullptr;       ///< [R]; null: none

  batch_rays() = default;
  /// Of a batch in memory of the policy.
  explicit batch_rays(ray_batch const& rays)
      : origins(rays.origins.empty() ? nullptr : rays.origins.data()),
        directions(rays.directions.data()),
        t_max(rays.t_max.empty() ? nullptr : rays.t_max.data()) {}

  /// The direction as it was given.
  GART_HD GART_INLINE vec3 given(index_t i) const {
    float const* const d = directions + std::size_t{3} * i;
    return {d[0], d[1], d[2]};
  }
  /// Its squared length.
  GART_HD GART_INLINE static float length2(vec3 const& d) {
    return gart::fma(d.x, d.x, gart::fma(d.y, d.y, mul(d.z, d.z)));
  }
  /// Whether a direction is taken as it stands.
  GART_HD GART_INLINE static bool is_unit(float length2) { return length2 >= 1 - 2e-5f && length2 <= 1 + 2e-5f; }
  /// Ray i, in the batch's frame.
  GART_HD GART_INLINE ray of(index_t i) const {
    vec3 const d = given(i);
    ray out{vec3(0.0f), is_unit(length2(d)) ? d : unit_ray<float>(d).direction};
    if (origins) {
      float const* const o = origins + std::size_t{3} * i;
      out.origin = {o[0], o[1], o[2]};
    }
    return out;
  }
  /// From dL/d the unit direction d of ray i to dL/d the direction as it was given. What stands along it changes its
  /// length alone.
  GART_HD GART_INLINE vec3 gradient_of_given(index_t i, vec3 const& d, vec3 by) const {
    by -= d * glm::dot(by, d);
    float const given2 = length2(given(i));
    return is_unit(given2) ? by : by * (1.0f / square_root(given2));
  }
  /// Where ray i ends.
  GART_HD GART_INLINE float far(index_t i) const { return t_max ? t_max[i] : infinity; }
};

namespace ray_kernels {

enum ray_fault : u32 { sound, bad_origin, bad_direction, no_direction, bad_end, early_end };

struct find_faults {
  batch_rays rays;
  float near;
  u32* faulty;  // [R]: its number, or ~0
  GART_HD static ray_fault fault_of(batch_rays const& rays, index_t i, float near) {
    vec3 const d = rays.given(i);
    if (!(is_finite(d.x) && is_finite(d.y) && is_finite(d.z))) return bad_direction;
    float const length2 = batch_rays::length2(d);
    if (!(length2 >= 1e-30f && length2 <= 1e30f)) return no_direction;
    if (rays.origins)
      for (int k = 0; k < 3; ++k)
        if (!is_finite(rays.origins[std::size_t{3} * i + static_cast<std::size_t>(k)])) return bad_origin;
    if (rays.t_max) {
      float const end = rays.t_max[i];
      if (end != end) return bad_end;
      if (!(end > near)) return early_end;
    }
    return sound;
  }
  GART_KERNEL void operator()(index_t i) const { faulty[i] = fault_of(rays, i, near) == sound ? ~u32{0} : i; }
};

}  // namespace ray_kernels

/// Throws invalid_argument for the first ray of a batch that is none. Waits for the policy.
template <execution E>
void require_rays(E& exec, ray_batch const& rays, float near) {
  index_t const n = rays.count();
  if (n == 0) return;
  buffer<u32, E> faulty(exec, n), first(exec, 1);
  batch_rays const there(rays);
  parallel_for(exec, "rays/check", n, ray_kernels::find_faults{there, near, faulty.data()});
  reduce(exec, span<u32 const>(faulty), first.view(), reduction::min);
  u32 const number = first.front();
  if (number == ~u32{0}) return;

  // That ray alone, on the host.
  float o[3] = {}, d[3], end = infinity;
  exec.copy_out(d, there.directions + std::size_t{3} * number, sizeof d);
  if (there.origins) exec.copy_out(o, there.origins + std::size_t{3} * number, sizeof o);
  if (there.t_max) exec.copy_out(&end, there.t_max + number, sizeof end);
  batch_rays one;
  one.origins = o, one.directions = d, one.t_max = &end;
  std::string const at = "[" + std::to_string(number) + "] is ";
  auto const three = [](float const(&v)[3]) {
    return "(" + std::to_string(v[0]) + ", " + std::to_string(v[1]) + ", " + std::to_string(v[2]) + ")";
  };
  std::string const leave = ": correct it, or leave the ray out";
  switch (ray_kernels::find_faults::fault_of(one, 0, near)) {
    case ray_kernels::bad_direction:
      throw invalid_argument("ray_batch.directions" + at + three(d) + ", which is not finite" + leave);
    case ray_kernels::no_direction:
      throw invalid_argument("ray_batch.directions" + at + three(d) + ", which has no length of 1e-15 to 1e15" + leave);
    case ray_kernels::bad_origin:
      throw invalid_argument("ray_batch.origins" + at + three(o) + ", which is not finite" + leave);
    case ray_kernels::bad_end:
      throw invalid_argument("ray_batch.t_max" + at + std::to_string(end) + ", which is no number" + leave);
    default:
      throw invalid_argument("ray_batch.t_max" + at + std::to_string(end) +
                             ", before render_options.near = " + std::to_string(near) + leave);
  }
}

}}  // namespace gart::GART_ISA
