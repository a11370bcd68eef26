#pragma once
// One CUDA stream of one device. This header is safe without nvcc: memory and queue are compiled into gart::cuda;
// kernel launches are templates in cuda_launch.cuh and need nvcc.
//
// Errors: unsupported where no device or driver is found; out_of_memory with the bytes asked and free; gart::error for
// any failed launch, with the label of the launch where it is known.

#include <gart/core/error.hpp>
#include <gart/core/macros.hpp>
#include <gart/exec/concepts.hpp>

#include <memory>
#include <string>
#include <vector>

namespace gart {

struct cuda_device_info {
  std::string name;
  int multiprocessors = 0;
  int compute_major = 0, compute_minor = 0;
  std::size_t total_bytes = 0;
};

// The devices there are; empty without a driver. `reason` then says why.
std::vector<cuda_device_info> cuda_devices(std::string* reason = nullptr);

class cuda_exec {
 public:
  static constexpr char const* name = "cuda";
  static constexpr bool device = true;
  profiler profile;
  memory_use memory;

  explicit cuda_exec(int device = 0);
  ~cuda_exec();
  cuda_exec(cuda_exec const&) = delete;
  cuda_exec& operator=(cuda_exec const&) = delete;

  void* allocate(std::size_t bytes);
  void deallocate(void* p, std::size_t bytes);
  void copy_in(void* dst, void const* src, std::size_t bytes);
  void copy_out(void* dst, void const* src, std::size_t bytes);
  void copy(void* dst, void const* src, std::size_t bytes);
  void zero(void* p, std::size_t bytes);
  void synchronize();  // also folds pending event times into `profile`

  void* stream() const { return stream_; }  // a cudaStream_t
  int multiprocessors() const { return multiprocessors_; }

  // Brackets of a timed stage; stage_scope calls them.
  void begin_stage(char const* label);
  void end_stage();
  void check_launch(char const* label);

  template <class T>
  GART_HD static T atomic_add(T* p, T v) {
#if defined(__CUDA_ARCH__)
    return atomicAdd(p, v);
#else
    T const old = *p;
    *p = old + v;
    return old;
#endif
  }

 private:
  struct events;
  void* stream_ = nullptr;
  int device_ = 0;
  int multiprocessors_ = 0;
  std::unique_ptr<events> events_;
};

}  // namespace gart
