// The only file that includes Embree; versions 3 and 4 differ in the names used here.

#include <gart/trace/embree_tracer.hpp>

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <atomic>
#include <string>

namespace gart {

namespace {

#if RTC_VERSION_MAJOR >= 4
using context_base = RTCRayQueryContext;
void init_context(context_base* c) { rtcInitRayQueryContext(c); }
#else
using context_base = RTCIntersectContext;
void init_context(context_base* c) { rtcInitIntersectContext(c); }
#endif

struct query : context_base {
  embree_scene::leaf_function leaf;
  void* visitor;
};

// Embree leaves out, without a word, what reaches beyond its own largest coordinate.
constexpr float largest_coordinate = 1.8e18f;

struct source_boxes {
  box const* boxes = nullptr;
  std::atomic<bool> beyond = false;
};

void bounds_callback(RTCBoundsFunctionArguments const* args) {
  auto* const source = static_cast<source_boxes*>(args->geometryUserPtr);
  box const& b = source->boxes[args->primID];
  for (int k = 0; k < 3; ++k)
    if (b.lo.x <= b.hi.x && !(b.lo[k] > -largest_coordinate && b.hi[k] < largest_coordinate)) source->beyond = true;
  RTCBounds& out = *args->bounds_o;
  out.lower_x = b.lo.x, out.lower_y = b.lo.y, out.lower_z = b.lo.z;
  out.upper_x = b.hi.x, out.upper_y = b.hi.y, out.upper_z = b.hi.z;
}

void intersect_callback(RTCIntersectFunctionNArguments const* args) {
  if (!args->valid[0]) return;
  auto const* q = static_cast<query const*>(args->context);
  RTCRayHit* const ray = reinterpret_cast<RTCRayHit*>(args->rayhit);
  q->leaf(q->visitor, args->primID, &ray->ray.tfar);
}

}  // namespace

struct embree_scene::handles {
  RTCDevice device = rtcNewDevice(nullptr);
  RTCScene scene = rtcNewScene(device);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  source_boxes source;

  handles() {
    // Robust: a box is entered wherever the exact ray would, so no candidate is lost to rounding. Dynamic, low quality:
    // it is built every step.
    rtcSetSceneFlags(scene, static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_DYNAMIC));
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_LOW);
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_LOW);
    rtcSetGeometryBoundsFunction(geometry, bounds_callback, nullptr);
    rtcSetGeometryIntersectFunction(geometry, intersect_callback);
    rtcAttachGeometry(scene, geometry);
  }
  ~handles() {
    rtcReleaseGeometry(geometry);
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
};

embree_scene::embree_scene() : handles_(std::make_unique<handles>()) {
  if (!handles_->device) throw unsupported("Embree could not start a device");
}
embree_scene::~embree_scene() = default;
embree_scene::embree_scene(embree_scene&&) noexcept = default;
embree_scene& embree_scene::operator=(embree_scene&&) noexcept = default;

char const* embree_scene::version() { return RTC_VERSION_STRING; }

void embree_scene::build(span<box const> boxes) {
  rtcSetGeometryUserPrimitiveCount(handles_->geometry, static_cast<unsigned>(boxes.size()));
  handles_->source.boxes = boxes.data();
  handles_->source.beyond = false;
  rtcSetGeometryUserData(handles_->geometry, &handles_->source);
  rtcCommitGeometry(handles_->geometry);
  rtcCommitScene(handles_->scene);
  if (RTCError const code = rtcGetDeviceError(handles_->device); code != RTC_ERROR_NONE)
    throw error("Embree failed to build over " + std::to_string(boxes.size()) + " boxes (error " +
                std::to_string(static_cast<int>(code)) + ")");
  if (handles_->source.beyond)
    throw unsupported(
        "a Gaussian reaches 1.8e18 units from the camera, where Embree's coordinates end: take another "
        "tracer (configuration_request.tracer = tiles or bvh), or remove it");
}

void embree_scene::intersect(vec3 origin, vec3 direction, float near, float far, leaf_function leaf,
                             void* visitor) const {
  query q;
  init_context(&q);
  q.leaf = leaf;
  q.visitor = visitor;
  RTCRayHit r;
  r.ray.org_x = origin.x, r.ray.org_y = origin.y, r.ray.org_z = origin.z;
  r.ray.dir_x = direction.x, r.ray.dir_y = direction.y, r.ray.dir_z = direction.z;
  r.ray.tnear = near > 0 ? near : 0;
  r.ray.tfar = far;
  r.ray.time = 0;
  r.ray.mask = 0xffffffffu;
  r.ray.id = 0;
  r.ray.flags = 0;
  r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR >= 4
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.context = &q;
  rtcIntersect1(handles_->scene, &r, &arguments);
#else
  rtcIntersect1(handles_->scene, &q, &r);
#endif
}

}  // namespace gart
