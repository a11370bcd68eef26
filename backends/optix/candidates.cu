// The device program: which boxes a ray meets, in no particular order. It knows no Gaussian and decides no hit.

#include "candidates.hpp"

extern "C" {
__constant__ gart::candidates_launch launch;
}

// The payload of a ray: its boxes so far, and the room for their ids. Two words hold the address of these.
extern "C" __global__ void __raygen__candidates() {
  unsigned const i = optixGetLaunchIndex().x;
  float4 const a = launch.rays[2 * i], b = launch.rays[2 * i + 1];
  unsigned met = 0, room = 0;
  unsigned long long ids = 0;
  if (launch.ids) {
    room = launch.counts[i];
    ids = reinterpret_cast<unsigned long long>(launch.ids + launch.offsets[i]);
  }
  unsigned low = static_cast<unsigned>(ids), high = static_cast<unsigned>(ids >> 32);
  if (launch.tree && b.w >= a.w)
    optixTrace(launch.tree, make_float3(a.x, a.y, a.z), make_float3(b.x, b.y, b.z), a.w, b.w, 0.0f,
               OptixVisibilityMask(255), OPTIX_RAY_FLAG_NONE, 0, 1, 0, met, room, low, high);
  if (!launch.ids)
    launch.counts[i] = met;
  else if (met != room)
    atomicAdd(launch.different, 1u);
}

extern "C" __global__ void __intersection__candidates() { optixReportIntersection(optixGetRayTmin(), 0); }

// Once a box: the geometry asks for it.
extern "C" __global__ void __anyhit__candidates() {
  unsigned const met = optixGetPayload_0();
  if (met < optixGetPayload_1()) {
    unsigned long long const ids = static_cast<unsigned long long>(optixGetPayload_3()) << 32 | optixGetPayload_2();
    reinterpret_cast<unsigned*>(ids)[met] = optixGetPrimitiveIndex();
  }
  optixSetPayload_0(met + 1);
  optixIgnoreIntersection();
}
