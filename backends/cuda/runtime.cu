// cuda_exec: a stream, its memory pool, its staging ring for uploads, and event pairs for stage times.

#include <gart/exec/cuda.hpp>

#include "check.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace gart {

namespace {

using detail::check_cuda;
using detail::describe;

// Four blocks, so that a batch's camera, image and mask can be under way while the next is being written.
constexpr std::size_t staging_blocks = 4, staging_bytes = std::size_t{4} << 20;

cudaStream_t as_stream(void* stream) { return static_cast<cudaStream_t>(stream); }

}  // namespace

std::vector<cuda_device_info> cuda_devices(std::string* reason) {
  int count = 0;
  cudaError_t const code = cudaGetDeviceCount(&count);
  if (code != cudaSuccess) {
    cudaGetLastError();
    if (reason) *reason = describe(code);
    return {};
  }
  std::vector<cuda_device_info> devices;
  for (int i = 0; i < count; ++i) {
    cudaDeviceProp properties{};
    check_cuda(cudaGetDeviceProperties(&properties, i), "reading a device's properties");
    devices.push_back({properties.name, properties.multiProcessorCount, properties.major, properties.minor,
                       properties.totalGlobalMem});
  }
  if (reason) *reason = devices.empty() ? "the driver reports no device" : "";
  return devices;
}

device_link link_between(int one, int other) {
  auto const has = [&](cudaDeviceP2PAttr what) {
    int value = 0;
    check_cuda(cudaDeviceGetP2PAttribute(&value, what, one, other), "asking how two devices are linked");
    return value != 0;
  };
  if (!has(cudaDevP2PAttrAccessSupported)) return device_link::host;
  return has(cudaDevP2PAttrNativeAtomicSupported) ? device_link::direct_atomic : device_link::direct;
}

struct cuda_exec::resources {
  struct stage {
    std::string label;
    cudaEvent_t start, stop;
  };
  struct block {
    void* bytes = nullptr;
    cudaEvent_t copied = nullptr;
  };

  cudaMemPool_t pool = nullptr;  // null: the device has no pools
  bool wait_for_launches = false;
  std::vector<cudaEvent_t> spare;
  std::vector<stage> open, closed;
  block staging[staging_blocks];
  std::size_t next_block = 0;
  block early;  // what end_copy_out reads
  std::size_t early_bytes = 0;

  // Room for so many bytes on the host, and the event that tells that they are there.
  static void make(block& of, std::size_t bytes) {
    if (!of.copied) check_cuda(cudaEventCreateWithFlags(&of.copied, cudaEventDisableTiming), "creating an event");
    if (!of.bytes) check_cuda(cudaMallocHost(&of.bytes, bytes), "allocating pinned memory");
  }

  static void destroy(block const& of) {
    if (of.bytes) cudaFreeHost(of.bytes);
    if (of.copied) cudaEventDestroy(of.copied);
  }

  cudaEvent_t take_event() {
    if (!spare.empty()) {
      cudaEvent_t const event = spare.back();
      spare.pop_back();
      return event;
    }
    cudaEvent_t event = nullptr;
    check_cuda(cudaEventCreate(&event), "creating an event");
    return event;
  }

  ~resources() {
    for (auto* stages : {&open, &closed})
      for (auto const& stage : *stages) {
        cudaEventDestroy(stage.start);
        cudaEventDestroy(stage.stop);
      }
    for (auto event : spare) cudaEventDestroy(event);
    for (auto const& block : staging) destroy(block);
    destroy(early);
    if (pool) cudaMemPoolDestroy(pool);
  }
};

cuda_exec::cuda_exec(int device_index, void* stream)
    : device_index_(device_index), stream_(stream), owns_stream_(stream == nullptr) {
  std::string reason;
  auto const devices = cuda_devices(&reason);
  if (devices.empty())
    throw unsupported(
        "no CUDA device: " + reason + "; install an NVIDIA driver of CUDA " + std::to_string(CUDART_VERSION / 1000) +
        " or later, make a GPU visible (CUDA_VISIBLE_DEVICES), or use configuration_request.backend = openmp");
  if (device_index < 0 || device_index >= static_cast<int>(devices.size()))
    throw invalid_argument("CUDA device " + std::to_string(device_index) + " does not exist; there are " +
                           std::to_string(devices.size()) + ", counted from 0");
  multiprocessors_ = devices[static_cast<std::size_t>(device_index)].multiprocessors;
  make_current();
  resources_ = std::make_unique<resources>();
  char const* const wait = std::getenv("GART_CUDA_SYNC");
  resources_->wait_for_launches = wait && *wait && std::strcmp(wait, "0") != 0;

  int pools = 0;
  check_cuda(cudaDeviceGetAttribute(&pools, cudaDevAttrMemoryPoolsSupported, device_index_), "asking for memory pools");
  if (pools) {
    cudaMemPoolProps properties{};
    properties.allocType = cudaMemAllocationTypePinned;
    properties.location.type = cudaMemLocationTypeDevice;
    properties.location.id = device_index_;
    check_cuda(cudaMemPoolCreate(&resources_->pool, &properties), "creating a memory pool");
    u64 keep_all = ~u64{0};
    check_cuda(cudaMemPoolSetAttribute(resources_->pool, cudaMemPoolAttrReleaseThreshold, &keep_all),
               "setting up a memory pool");
  }
  if (!owns_stream_) return;
  cudaStream_t own = nullptr;
  check_cuda(cudaStreamCreateWithFlags(&own, cudaStreamNonBlocking), "creating a stream");
  stream_ = own;
}

cuda_exec::~cuda_exec() {
  cudaSetDevice(device_index_);
  cudaStreamSynchronize(as_stream(stream_));
  resources_.reset();
  if (owns_stream_) cudaStreamDestroy(as_stream(stream_));
}

void cuda_exec::make_current() const { check_cuda(cudaSetDevice(device_index_), "choosing the device"); }

std::size_t cuda_exec::free_bytes() const {
  make_current();
  std::size_t free_now = 0, total = 0;
  return cudaMemGetInfo(&free_now, &total) == cudaSuccess ? free_now : 0;
}

void* cuda_exec::allocate(std::size_t bytes) {
  if (bytes == 0) return nullptr;
  make_current();
  void* p = nullptr;
  auto const attempt = [&] {
    return resources_->pool ? cudaMallocFromPoolAsync(&p, bytes, resources_->pool, as_stream(stream_))
                            : cudaMalloc(&p, bytes);
  };
  cudaError_t code = attempt();
  if (code == cudaErrorMemoryAllocation && resources_->pool) {
    // The pool may keep memory in the wrong pieces: give it back to the driver and ask once more.
    cudaGetLastError();
    synchronize();
    check_cuda(cudaMemPoolTrimTo(resources_->pool, 0), "trimming the memory pool");
    code = attempt();
  }
  if (code == cudaErrorMemoryAllocation) {
    cudaGetLastError();
    std::size_t free_bytes = 0, total_bytes = 0;
    cudaMemGetInfo(&free_bytes, &total_bytes);
    throw out_of_memory("CUDA device", bytes, free_bytes,
                        "lower train_options.max_gaussians, raise dataset_options.downscale, or use "
                        "configuration_request.backward = hybrid");
  }
  check_cuda(code, "allocating memory");
  memory.allocated(bytes);
  return p;
}

void cuda_exec::deallocate(void* p, std::size_t bytes) {
  if (!p) return;
  // Runs in destructors: an error here is one of an earlier kernel, and the next checked call throws it.
  if (resources_->pool) {
    cudaFreeAsync(p, as_stream(stream_));
  } else {
    cudaSetDevice(device_index_);
    cudaStreamSynchronize(as_stream(stream_));
    cudaFree(p);
  }
  memory.released(bytes);
}

void cuda_exec::copy_in(void* dst, void const* src, std::size_t bytes) {
  make_current();
  auto* to = static_cast<char*>(dst);
  auto const* from = static_cast<char const*>(src);
  while (bytes > 0) {
    auto& block = resources_->staging[resources_->next_block];
    resources_->next_block = (resources_->next_block + 1) % staging_blocks;
    resources::make(block, staging_bytes);
    check_cuda(cudaEventSynchronize(block.copied), "waiting for an upload");
    std::size_t const part = std::min(bytes, staging_bytes);
    std::memcpy(block.bytes, from, part);
    check_cuda(cudaMemcpyAsync(to, block.bytes, part, cudaMemcpyHostToDevice, as_stream(stream_)), "uploading");
    check_cuda(cudaEventRecord(block.copied, as_stream(stream_)), "uploading");
    to += part;
    from += part;
    bytes -= part;
  }
}

void cuda_exec::copy_out(void* dst, void const* src, std::size_t bytes) {
  if (bytes) check_cuda(cudaMemcpyAsync(dst, src, bytes, cudaMemcpyDeviceToHost, as_stream(stream_)), "downloading");
  synchronize();
}

void cuda_exec::begin_copy_out(void const* src, std::size_t bytes) {
  make_current();
  auto& r = *resources_;
  if (bytes > r.early_bytes) {
    resources::destroy(std::exchange(r.early, {}));
    r.early_bytes = 0;
    resources::make(r.early, bytes);
    r.early_bytes = bytes;
  }
  if (bytes == 0) return;
  check_cuda(cudaMemcpyAsync(r.early.bytes, src, bytes, cudaMemcpyDeviceToHost, as_stream(stream_)), "downloading");
  check_cuda(cudaEventRecord(r.early.copied, as_stream(stream_)), "downloading");
}

void cuda_exec::end_copy_out(void* dst, std::size_t bytes) {
  if (bytes == 0) return;
  check_cuda(cudaEventSynchronize(resources_->early.copied), "waiting for a download");
  std::memcpy(dst, resources_->early.bytes, bytes);
  if (profile.enabled()) synchronize();  // the times of what came after it
}

void cuda_exec::copy(void* dst, void const* src, std::size_t bytes) {
  if (bytes) check_cuda(cudaMemcpyAsync(dst, src, bytes, cudaMemcpyDeviceToDevice, as_stream(stream_)), "copying");
}

void cuda_exec::fill(void* p, unsigned char byte, std::size_t bytes) {
  if (bytes) check_cuda(cudaMemsetAsync(p, byte, bytes, as_stream(stream_)), "clearing memory");
}

void cuda_exec::zero(void* p, std::size_t bytes) { fill(p, 0, bytes); }

void cuda_exec::synchronize() {
  check_cuda(cudaStreamSynchronize(as_stream(stream_)), "waiting for the device");
  fold_stages();
}

void cuda_exec::begin_stage(char const* label) {
  auto& r = *resources_;
  cudaEvent_t const start = r.take_event(), stop = r.take_event();
  check_cuda(cudaEventRecord(start, as_stream(stream_)), "starting a stage's clock");
  r.open.push_back({label, start, stop});
  // Room for every open stage, so that end_stage cannot fail.
  std::size_t const room = r.closed.size() + r.open.size();
  if (r.closed.capacity() < room) r.closed.reserve(2 * room);
}

void cuda_exec::end_stage() noexcept {
  auto& r = *resources_;
  cudaEventRecord(r.open.back().stop, as_stream(stream_));
  r.closed.push_back(std::move(r.open.back()));
  r.open.pop_back();
}

void cuda_exec::fold_stages() {
  auto& r = *resources_;
  for (auto& stage : r.closed) {
    float milliseconds = 0;
    if (cudaEventElapsedTime(&milliseconds, stage.start, stage.stop) == cudaSuccess)
      profile.add(stage.label, milliseconds);
    r.spare.push_back(stage.start);
    r.spare.push_back(stage.stop);
  }
  r.closed.clear();
}

void cuda_exec::check_launch(char const* label) {
  cudaError_t code = cudaGetLastError();
  if (code == cudaSuccess && resources_->wait_for_launches) code = cudaStreamSynchronize(as_stream(stream_));
  if (code == cudaSuccess) return;
  cudaGetLastError();
  std::string message = std::string("CUDA kernel \"") + label + "\" failed: " + describe(code);
  if (code == cudaErrorNoKernelImageForDevice || code == cudaErrorUnsupportedPtxVersion)
    message += "; build gart for this device (-DCMAKE_CUDA_ARCHITECTURES=native)";
  else if (!resources_->wait_for_launches)
    message += "; if a kernel before it failed, GART_CUDA_SYNC=1 in the environment names that kernel";
  throw error(message);
}

}  // namespace gart
