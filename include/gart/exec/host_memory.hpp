#pragma once
// What the two host policies share: memory is the host's, copies are memcpy.

#include <gart/core/error.hpp>
#include <gart/exec/concepts.hpp>

#include <chrono>
#include <cstring>
#include <new>
#include <vector>

namespace gart {

class host_memory {
 public:
  static constexpr bool device = false;
  profiler profile;
  memory_use memory;

  host_memory() = default;
  host_memory(host_memory const&) = delete;
  host_memory& operator=(host_memory const&) = delete;

  void* allocate(std::size_t bytes) {
    void* p = ::operator new(bytes, std::align_val_t{64}, std::nothrow);
    if (!p) throw out_of_memory("host", bytes, 0, "lower --max-gaussians or raise --downscale");
    memory.allocated(bytes);
    return p;
  }
  void deallocate(void* p, std::size_t bytes) {
    if (!p) return;
    ::operator delete(p, std::align_val_t{64});
    memory.released(bytes);
  }
  void copy_in(void* dst, void const* src, std::size_t bytes) { copy(dst, src, bytes); }
  void copy_out(void* dst, void const* src, std::size_t bytes) { copy(dst, src, bytes); }
  void copy(void* dst, void const* src, std::size_t bytes) {
    if (bytes) std::memcpy(dst, src, bytes);
  }
  void zero(void* p, std::size_t bytes) {
    if (bytes) std::memset(p, 0, bytes);
  }
  void synchronize() {}

  void begin_stage(char const* label) { open_.push_back({label, std::chrono::steady_clock::now()}); }
  void end_stage() {
    std::chrono::duration<double, std::milli> const elapsed = std::chrono::steady_clock::now() - open_.back().start;
    profile.add(open_.back().label, elapsed.count());
    open_.pop_back();
  }

 private:
  struct open_stage {
    char const* label;
    std::chrono::steady_clock::time_point start;
  };
  std::vector<open_stage> open_;
};

}  // namespace gart
