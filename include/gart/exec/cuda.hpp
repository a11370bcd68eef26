#pragma once
/// \file
/// One CUDA stream of one device. This header is safe without nvcc: memory and queue are compiled into gart::cuda.
/// Kernel launches are templates in cuda_launch.cuh and need nvcc.
///
/// Memory comes from the policy's own pool, which keeps freed blocks. After the first steps an allocation is a list
/// operation on the host and never waits for the device. copy_in goes through a ring of pinned blocks. It does not wait
/// for the kernels before it, and its source may be reused on return, pageable or pinned.
///
/// Errors: unsupported where no device or driver is found; out_of_memory with the bytes asked and free. gart::error for
/// any failed launch, with its label. A later call notices a kernel that fails while it runs, and cannot know its
/// label. With GART_CUDA_SYNC=1 in the environment every launch is waited for and the label is exact.

#include <gart/core/error.hpp>
#include <gart/core/macros.hpp>
#include <gart/exec/concepts.hpp>

#include <memory>
#include <string>
#include <type_traits>
#include <vector>

namespace gart {

/// A device, as the driver describes it.
struct cuda_device_info {
  std::string name;                          ///< of the vendor
  int multiprocessors = 0;                   ///< that it has
  int compute_major = 0, compute_minor = 0;  ///< compute capability
  std::size_t total_bytes = 0;               ///< of its memory
};

/// The devices there are; empty without a driver. `reason` then says why.
std::vector<cuda_device_info> cuda_devices(std::string* reason = nullptr);

/// How two devices of a host reach each other's memory. `host`: through the host's; `direct_atomic`: atomic operations
/// work there too (NVLink).
enum class device_link { host, direct, direct_atomic };
/// Of two devices, by index. Errors: gart::error, with the driver's words, for a device that does not exist.
device_link link_between(int one, int other);

/// A policy: a stream and its pool of memory.
class cuda_exec {
 public:
  static constexpr char const* name = "cuda";             ///< of the policy
  static constexpr bool device = true;                    ///< memory is not the host's
  static constexpr kernel_form form = kernel_form::warp;  ///< kernels step as warps
  profiler profile;                                       ///< times of stages
  memory_use memory;                                      ///< bytes of buffers

  /// `stream`, a cudaStream_t of that device, stays its owner's and must outlive this; null: one of the policy's own.
  explicit cuda_exec(int device_index = 0, void* stream = nullptr);
  ~cuda_exec();
  cuda_exec(cuda_exec const&) = delete;
  cuda_exec& operator=(cuda_exec const&) = delete;

  /// Bytes of the device's memory, from the pool; out_of_memory.
  void* allocate(std::size_t bytes);
  /// Back to the pool, after queued work.
  void deallocate(void* p, std::size_t bytes);
  /// From the host.
  void copy_in(void* dst, void const* src, std::size_t bytes);
  /// To the host; waits for the data.
  void copy_out(void* dst, void const* src, std::size_t bytes);
  ///@{
  /// The two halves of an early_copy (exec/early_copy.hpp).
  void begin_copy_out(void const* src, std::size_t bytes);
  void end_copy_out(void* dst, std::size_t bytes);
  ///@}
  /// From device to device.
  void copy(void* dst, void const* src, std::size_t bytes);
  /// Sets every byte to 0.
  void zero(void* p, std::size_t bytes);
  /// Sets every byte to one value.
  void fill(void* p, unsigned char byte, std::size_t bytes);
  /// Waits for all that is queued.
  void synchronize();

  void* stream() const { return stream_; }  ///< a cudaStream_t
  /// Of the device.
  int multiprocessors() const { return multiprocessors_; }
  /// Bytes that can still be had.
  std::size_t free_bytes() const;
  void make_current() const;  ///< launches go to the calling thread's current device, which must be the stream's

  /// Brackets of a timed stage; stage_scope calls them. The times, by events, reach `profile` at the next synchronize()
  /// or copy_out().
  void begin_stage(char const* label);
  /// The end of the innermost stage.
  void end_stage() noexcept;
  /// Throws gart::error where the launch before it failed; `label` is named.
  void check_launch(char const* label);

  /// In kernels: adds v, returns the old value.
  template <class T>
  GART_HD static T atomic_add(T* p, T v) {
#if defined(__CUDA_ARCH__)
    if constexpr (std::is_same_v<T, u64>)
      return atomicAdd(reinterpret_cast<unsigned long long*>(p), static_cast<unsigned long long>(v));
    else
      return atomicAdd(p, v);
#else
    T const old = *p;
    *p = old + v;
    return old;
#endif
  }
  /// In kernels: row[0..n) += values.
  template <int N>
  GART_HD static void atomic_add_row(float* row, float const (&values)[N], int n) {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
    if constexpr (N % 4 == 0) {
      GART_UNROLL
      for (int i = 0; i < N; i += 4)
        if (i < n)
          atomicAdd(reinterpret_cast<float4*>(row + i),
                    make_float4(values[i], i + 1 < n ? values[i + 1] : 0, i + 2 < n ? values[i + 2] : 0,
                                i + 3 < n ? values[i + 3] : 0));
    } else
#endif
    {
      GART_UNROLL
      for (int i = 0; i < N; ++i)
        if (i < n) atomic_add(row + i, values[i]);
    }
  }
  /// In kernels: a thread that sees a later write sees all earlier ones.
  GART_HD static void fence() {
#if defined(__CUDA_ARCH__)
    __threadfence();
#endif
  }

 private:
  struct resources;
  void fold_stages();
  void* stream_ = nullptr;
  bool owns_stream_ = true;
  int device_index_ = 0;
  int multiprocessors_ = 0;
  std::unique_ptr<resources> resources_;
};
static_assert(device_execution<cuda_exec>);

}  // namespace gart
