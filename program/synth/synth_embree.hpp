#pragma once
// Embree behind four calls: the only file of `gart synth` that knows it, and whether it is version 3 or 4. Without
// GART_SYNTH_EMBREE_MAJOR the same class stands here and throws `unsupported` when constructed.

#include "synth_scene.hpp"

#include <gart/core/error.hpp>

#if defined(GART_SYNTH_EMBREE_MAJOR)
#if GART_SYNTH_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#endif

#include <limits>
#include <memory>
#include <string>
#include <type_traits>

namespace gart_cli {

struct synth_hit {
  float t;
  u32 mesh, triangle;
  float u, v;   // barycentric weights of the triangle's second and third vertex
  vec3 normal;  // of the triangle, not normalised
};

#if defined(GART_SYNTH_EMBREE_MAJOR)

class embree_scene {
 public:
  explicit embree_scene(synth_scene const& meshes) {
    // One thread builds. So equal inputs give equal trees, and a ray along a shared edge always the same triangle.
    device_.reset(rtcNewDevice("threads=1"));
    if (!device_) throw gart::error("Embree did not start: error " + std::to_string(rtcGetDeviceError(nullptr)));
    scene_.reset(rtcNewScene(device_.get()));
    rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_HIGH);
    for (synth_mesh const& mesh : meshes) add(mesh);
    rtcCommitScene(scene_.get());
    if (RTCError const status = rtcGetDeviceError(device_.get()); status != RTC_ERROR_NONE)
      throw gart::error("Embree did not build the scene: error " + std::to_string(status));
  }

  bool intersect(vec3 origin, vec3 direction, float near, synth_hit& hit) const {
    RTCRayHit query{};
    set(query.ray, origin, direction, near, std::numeric_limits<float>::infinity());
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
#if GART_SYNTH_EMBREE_MAJOR >= 4
    rtcIntersect1(scene_.get(), &query);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene_.get(), &context, &query);
#endif
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
    hit = {query.ray.tfar, query.hit.geomID, query.hit.primID,
           query.hit.u,    query.hit.v,      vec3(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z)};
    return true;
  }

  bool occluded(vec3 origin, vec3 direction, float near, float far) const {
    RTCRay query{};
    set(query, origin, direction, near, far);
#if GART_SYNTH_EMBREE_MAJOR >= 4
    rtcOccluded1(scene_.get(), &query);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene_.get(), &context, &query);
#endif
    return query.tfar < 0;  // Embree's mark
  }

 private:
  void add(synth_mesh const& mesh) {
    RTCGeometry const geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    std::size_t const triangles = mesh.index.size() / 3;
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                 3 * sizeof(float), mesh.position.size()));
    auto* indices = static_cast<u32*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(u32), triangles));
    if (!vertices || !indices) throw gart::error("Embree has no memory for the scene's meshes");
    for (std::size_t i = 0; i < mesh.position.size(); ++i)
      for (int k = 0; k < 3; ++k) vertices[3 * i + k] = mesh.position[i][k];
    std::copy(mesh.index.begin(), mesh.index.end(), indices);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_.get(), geometry);
    rtcReleaseGeometry(geometry);
  }

  static void set(RTCRay& ray, vec3 o, vec3 d, float near, float far) {
    ray.org_x = o.x, ray.org_y = o.y, ray.org_z = o.z;
    ray.dir_x = d.x, ray.dir_y = d.y, ray.dir_z = d.z;
    ray.tnear = near, ray.tfar = far, ray.mask = ~0u;
  }

  struct release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };
  std::unique_ptr<std::remove_pointer_t<RTCDevice>, release> device_;
  std::unique_ptr<std::remove_pointer_t<RTCScene>, release> scene_;
};

#else

class embree_scene {
 public:
  explicit embree_scene(synth_scene const&) {
    throw gart::unsupported(
        "gart synth traces its meshes with Embree, which this build of gart was made without: install it "
        "(Debian, Ubuntu: apt install libembree-dev), then configure and build gart again");
  }
  bool intersect(vec3, vec3, float, synth_hit&) const { return false; }
  bool occluded(vec3, vec3, float, float) const { return false; }
};

#endif

}  // namespace gart_cli
