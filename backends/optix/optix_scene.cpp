// The only file that calls OptiX: a context and a pipeline a device, and the tree over a scene's boxes.

#include <gart/trace/optix_tracer.hpp>

#include "candidates.hpp"

#include <cuda_runtime.h>
#include <optix_function_table_definition.h>
#include <optix_stack_size.h>
#include <optix_stubs.h>

#include <candidates.ptx.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>

namespace gart {

namespace {

static_assert(sizeof(box) == sizeof(OptixAabb) && sizeof(box) % OPTIX_AABB_BUFFER_BYTE_ALIGNMENT == 0);
static_assert(sizeof(optix_ray) == 2 * sizeof(float4));
static_assert(sizeof(u64) == sizeof(unsigned long long) && sizeof(u32) == sizeof(unsigned));

// What OptiX said last; GART_OPTIX_VALIDATE=1 in the environment has it check all it is given, and prints all it says.
thread_local std::string last_message;

bool validates() {
  char const* const wanted = std::getenv("GART_OPTIX_VALIDATE");
  return wanted && *wanted && std::strcmp(wanted, "0") != 0;
}

void log(unsigned level, char const* tag, char const* message, void*) {
  if (level <= 2) last_message = message;
  if (validates()) std::fprintf(stderr, "OptiX [%u] %s: %s\n", level, tag, message);
}

std::string describe(OptixResult code) {
  return std::string(optixGetErrorString(code)) + " (" + optixGetErrorName(code) + ")";
}

// `what` says what was being done.
void check(OptixResult code, char const* what) {
  if (code == OPTIX_SUCCESS) return;
  std::string message = std::string("OptiX failed while ") + what + ": " + describe(code);
  if (!last_message.empty()) message += ": " + last_message;
  last_message.clear();
  throw error(message + (validates() ? "" : "; GART_OPTIX_VALIDATE=1 in the environment has OptiX say more"));
}

void check(cudaError_t code, char const* what) {
  if (code == cudaSuccess) return;
  cudaGetLastError();
  throw error(std::string("CUDA failed while ") + what + ": " + cudaGetErrorString(code) + " (" +
              cudaGetErrorName(code) + ")");
}

CUdeviceptr as_address(void const* p) { return reinterpret_cast<CUdeviceptr>(p); }

// The driver's library, loaded once.
OptixResult driver_result() {
  static OptixResult const result = optixInit();
  return result;
}

std::string why_not(OptixResult code) {
  std::string const built = std::string("OptiX ") + optix_scene::version();
  if (code == OPTIX_ERROR_LIBRARY_NOT_FOUND)
    return "the driver has no libnvoptix.so.1: install the NVIDIA driver with its graphics libraries";
  if (code == OPTIX_ERROR_UNSUPPORTED_ABI_VERSION)
    return "the driver is older than " + built + ": update it, or build gart with older headers (OptiX_ROOT)";
  return built + " does not start: " + describe(code);
}

// One a device, for the whole run: OptiX compiles it in a part of a second.
struct pipeline {
  OptixDeviceContext context = nullptr;
  OptixPipeline launched = nullptr;
  OptixShaderBindingTable table = {};
  unsigned most_boxes = 0;

  pipeline() {
    check(cudaFree(nullptr), "starting the device");
    OptixDeviceContextOptions options = {};
    options.logCallbackFunction = log;
    options.logCallbackLevel = validates() ? 4 : 2;
    options.validationMode =
        validates() ? OPTIX_DEVICE_CONTEXT_VALIDATION_MODE_ALL : OPTIX_DEVICE_CONTEXT_VALIDATION_MODE_OFF;
    check(optixDeviceContextCreate(nullptr, &options, &context), "making a context");
    check(optixDeviceContextGetProperty(context, OPTIX_DEVICE_PROPERTY_LIMIT_MAX_PRIMITIVES_PER_GAS, &most_boxes,
                                        sizeof most_boxes),
          "asking for the most boxes of a tree");

    OptixPipelineCompileOptions all = {};
    all.traversableGraphFlags = OPTIX_TRAVERSABLE_GRAPH_FLAG_ALLOW_SINGLE_GAS;
    all.numPayloadValues = 4;
    all.numAttributeValues = 2;
    all.pipelineLaunchParamsVariableName = "launch";
    all.usesPrimitiveTypeFlags = OPTIX_PRIMITIVE_TYPE_FLAGS_CUSTOM;
    OptixModuleCompileOptions const as_usual = {};
    OptixModule module = nullptr;
    check(optixModuleCreate(context, &as_usual, &all, reinterpret_cast<char const*>(candidates_ptx),
                            sizeof candidates_ptx, nullptr, nullptr, &module),
          "compiling its program");

    OptixProgramGroupDesc parts[3] = {};
    parts[0].kind = OPTIX_PROGRAM_GROUP_KIND_RAYGEN;
    parts[0].raygen = {module, "__raygen__candidates"};
    parts[1].kind = OPTIX_PROGRAM_GROUP_KIND_MISS;  // no program
    parts[2].kind = OPTIX_PROGRAM_GROUP_KIND_HITGROUP;
    parts[2].hitgroup.moduleIS = parts[2].hitgroup.moduleAH = module;
    parts[2].hitgroup.entryFunctionNameIS = "__intersection__candidates";
    parts[2].hitgroup.entryFunctionNameAH = "__anyhit__candidates";
    OptixProgramGroupOptions const no_options = {};
    OptixProgramGroup groups[3] = {};
    check(optixProgramGroupCreate(context, parts, 3, &no_options, nullptr, nullptr, groups), "making its programs");
    OptixPipelineLinkOptions link = {};
    link.maxTraceDepth = 1;
    check(optixPipelineCreate(context, &all, &link, groups, 3, nullptr, nullptr, &launched), "linking its programs");
    set_stack(groups);
    make_table(groups);
  }

 private:
  void set_stack(OptixProgramGroup const (&groups)[3]) {
    OptixStackSizes sizes = {};
    for (OptixProgramGroup const group : groups)
      check(optixUtilAccumulateStackSizes(group, &sizes, launched), "sizing its stack");
    unsigned from_traversal = 0, from_state = 0, continuation = 0;
    check(optixUtilComputeStackSizes(&sizes, 1, 0, 0, &from_traversal, &from_state, &continuation), "sizing its stack");
    check(optixPipelineSetStackSize(launched, from_traversal, from_state, continuation, 1), "sizing its stack");
  }

  void make_table(OptixProgramGroup const (&groups)[3]) {
    struct alignas(OPTIX_SBT_RECORD_ALIGNMENT) record {
      char header[OPTIX_SBT_RECORD_HEADER_SIZE];
    } records[3];
    for (int i = 0; i < 3; ++i)
      check(optixSbtRecordPackHeader(groups[i], &records[i]), "writing its table of programs");
    void* on_device = nullptr;
    check(cudaMalloc(&on_device, sizeof records), "allocating OptiX's table of programs");
    check(cudaMemcpy(on_device, records, sizeof records, cudaMemcpyHostToDevice), "copying OptiX's table of programs");
    CUdeviceptr const first = as_address(on_device);
    table.raygenRecord = first;
    table.missRecordBase = first + sizeof(record);
    table.missRecordStrideInBytes = sizeof(record), table.missRecordCount = 1;
    table.hitgroupRecordBase = first + 2 * sizeof(record);
    table.hitgroupRecordStrideInBytes = sizeof(record), table.hitgroupRecordCount = 1;
  }
};

// Of the current device. Never destroyed: at the end of a process the driver may be gone first.
pipeline const& pipeline_here() {
  static std::mutex guard;
  static auto& of_devices = *new std::map<int, std::unique_ptr<pipeline>>;
  if (OptixResult const code = driver_result(); code != OPTIX_SUCCESS)
    throw unsupported("tracer optix: " + why_not(code) +
                      "; or take another tracer, configuration_request.tracer = bvh");
  int device = 0;
  check(cudaGetDevice(&device), "asking for the device");
  std::lock_guard const lock(guard);
  auto& one = of_devices[device];
  if (!one) one = std::make_unique<pipeline>();
  return *one;
}

}  // namespace

struct optix_scene::handles {
  cuda_exec* exec;
  pipeline const& program;
  buffer<unsigned char, cuda_exec> tree, scratch;
  buffer<candidates_launch, cuda_exec> launch;
  buffer<u32, cuda_exec> different;
  OptixTraversableHandle root = 0;
  std::size_t boxes = 0;
  bool refittable = false;

  explicit handles(cuda_exec& e)
      : exec(&e), program((e.make_current(), pipeline_here())), tree(e), scratch(e), launch(e, 1), different(e, 1) {
    different.zero();
  }

  cudaStream_t stream() const { return static_cast<cudaStream_t>(exec->stream()); }

  void fit(span<box const> of, OptixBuildOperation operation) {
    exec->make_current();
    CUdeviceptr const address = as_address(of.data());
    unsigned const flags = OPTIX_GEOMETRY_FLAG_REQUIRE_SINGLE_ANYHIT_CALL;
    OptixBuildInput input = {};
    input.type = OPTIX_BUILD_INPUT_TYPE_CUSTOM_PRIMITIVES;
    input.customPrimitiveArray.aabbBuffers = &address;
    input.customPrimitiveArray.numPrimitives = static_cast<unsigned>(of.size());
    input.customPrimitiveArray.flags = &flags;
    input.customPrimitiveArray.numSbtRecords = 1;
    OptixAccelBuildOptions options = {};
    options.buildFlags = OPTIX_BUILD_FLAG_PREFER_FAST_TRACE;
    if (refittable) options.buildFlags |= OPTIX_BUILD_FLAG_ALLOW_UPDATE;
    options.operation = operation;
    bool const update = operation == OPTIX_BUILD_OPERATION_UPDATE;
    OptixAccelBufferSizes sizes = {};
    check(optixAccelComputeMemoryUsage(program.context, &options, &input, 1, &sizes), "sizing a tree");
    if (!update) tree.resize(sizes.outputSizeInBytes);
    scratch.resize(update ? sizes.tempUpdateSizeInBytes : sizes.tempSizeInBytes);
    check(optixAccelBuild(program.context, stream(), &options, &input, 1, as_address(scratch.data()), scratch.size(),
                          as_address(tree.data()), tree.size(), &root, nullptr, 0),
          update ? "refitting a tree" : "building a tree");
  }

  void run(candidates_launch const& what, std::size_t rays, char const* label) {
    if (rays == 0) return;
    exec->make_current();
    stage_scope stage(*exec, label);
    exec->copy_in(launch.data(), &what, sizeof what);
    check(optixLaunch(program.launched, stream(), as_address(launch.data()), sizeof what, &program.table,
                      static_cast<unsigned>(rays), 1, 1),
          "launching its program");
    exec->check_launch(label);
  }
};

optix_scene::optix_scene(cuda_exec& exec) : handles_(std::make_unique<handles>(exec)) {}
optix_scene::~optix_scene() = default;
optix_scene::optix_scene(optix_scene&&) noexcept = default;
optix_scene& optix_scene::operator=(optix_scene&&) noexcept = default;

void optix_scene::build(span<box const> boxes, bool refittable) {
  handles& h = *handles_;
  if (boxes.size() > h.program.most_boxes)
    throw unsupported("tracer optix: a tree of OptiX has at most " + std::to_string(h.program.most_boxes) +
                      " boxes, not " + std::to_string(boxes.size()) +
                      "; take another tracer, configuration_request.tracer = bvh");
  h.root = 0, h.boxes = 0, h.refittable = refittable;
  if (boxes.empty()) return;
  h.fit(boxes, OPTIX_BUILD_OPERATION_BUILD);
  h.boxes = boxes.size();
}

bool optix_scene::can_refit(std::size_t boxes) const {
  return handles_->refittable && boxes > 0 && boxes == handles_->boxes;
}

void optix_scene::refit(span<box const> boxes) {
  if (!can_refit(boxes.size()))
    throw invalid_argument("optix_scene::refit: as many boxes as the last build had, and a refittable one, are needed");
  handles_->fit(boxes, OPTIX_BUILD_OPERATION_UPDATE);
}

void optix_scene::count(span<optix_ray const> rays, span<u32> counts) {
  if (counts.size() != rays.size()) throw invalid_argument("optix_scene::count: a count for each ray is needed");
  handles_->run({handles_->root, reinterpret_cast<float4 const*>(rays.data()), counts.data(), nullptr, nullptr,
                 handles_->different.data()},
                rays.size(), "optix/count");
}

void optix_scene::list(span<optix_ray const> rays, span<u32> counts, span<u64 const> offsets, span<u32> ids) {
  if (counts.size() != rays.size() || offsets.size() < rays.size())
    throw invalid_argument("optix_scene::list: a count and an offset for each ray are needed");
  handles_->run({handles_->root, reinterpret_cast<float4 const*>(rays.data()), counts.data(),
                 reinterpret_cast<unsigned long long const*>(offsets.data()), ids.data(), handles_->different.data()},
                rays.size(), "optix/list");
}

void optix_scene::require_same() const {
  u32 const different = handles_->different.front();
  if (different == 0) return;
  handles_->different.zero();
  throw error("OptiX met other boxes when it listed them than when it counted them, of " + std::to_string(different) +
              " rays: take another tracer, configuration_request.tracer = bvh");
}

char const* optix_scene::version() {
  static std::string const text = std::to_string(OPTIX_VERSION / 10000) + "." +
                                  std::to_string(OPTIX_VERSION % 10000 / 100) + "." +
                                  std::to_string(OPTIX_VERSION % 100);
  return text.c_str();
}

bool optix_available(std::string* reason) {
  std::string why;
  bool available = !cuda_devices(&why).empty();
  if (available && driver_result() != OPTIX_SUCCESS)
    available = false, why = "tracer optix: " + why_not(driver_result());
  if (reason) *reason = available ? "" : why;
  return available;
}

}  // namespace gart
