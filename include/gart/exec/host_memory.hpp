#pragma once
/// \file
/// The parts that the two host policies share: memory is the host's, copies are memcpy, stage times are wall times. One
/// thread at a time uses a policy; its work may use many.

#include <gart/core/error.hpp>
#include <gart/core/isa.hpp>
#include <gart/exec/concepts.hpp>

#include <chrono>
#include <cstring>
#include <fstream>
#include <new>
#include <string>
#include <utility>
#include <vector>

#if __has_include(<sys/mman.h>)
#include <sys/mman.h>
#endif
#if __has_include(<unistd.h>)
#include <unistd.h>
#endif

namespace gart { inline namespace GART_ISA {

/// The base of a host's policy: all but its threads and atomics.
class host_memory {
 public:
  static constexpr bool device = false;                     ///< memory is the host's
  static constexpr kernel_form form = kernel_form::packet;  ///< lanes are vector registers
  profiler profile;                                         ///< times of stages
  memory_use memory;                                        ///< bytes of buffers

  ///@{
  /// A policy is not copied: buffers hold its address.
  host_memory() = default;
  host_memory(host_memory const&) = delete;
  host_memory& operator=(host_memory const&) = delete;
  ///@}
  ~host_memory() { deallocate(workspace_, workspace_bytes_); }

  /// Bytes, aligned to 64, or to a huge page from 8 MiB on; out_of_memory.
  void* allocate(std::size_t bytes) {
    void* p = ::operator new(bytes, alignment_of(bytes), std::nothrow);
    if (!p)
      throw out_of_memory("host", bytes, free_bytes(),
                          "lower train_options.max_gaussians or raise dataset_options.downscale");
#if defined(MADV_HUGEPAGE)
    // A hint: without it what reads slots all over a buffer waits for the addresses of its pages too.
    if (bytes >= large) madvise(p, bytes, MADV_HUGEPAGE);
#endif
    memory.allocated(bytes);
    return p;
  }
  /// Of as many bytes as were allocated.
  void deallocate(void* p, std::size_t bytes) {
    if (!p) return;
    ::operator delete(p, alignment_of(bytes));
    memory.released(bytes);
  }
  ///@{
  /// A memcpy.
  void copy_in(void* dst, void const* src, std::size_t bytes) { copy(dst, src, bytes); }
  void copy_out(void* dst, void const* src, std::size_t bytes) { copy(dst, src, bytes); }
  void copy(void* dst, void const* src, std::size_t bytes) {
    if (bytes) std::memcpy(dst, src, bytes);
  }
  ///@}
  /// Sets every byte to 0.
  void zero(void* p, std::size_t bytes) {
    if (bytes) std::memset(p, 0, bytes);
  }
  /// Sets every byte to one value.
  void fill(void* p, unsigned char byte, std::size_t bytes) {
    if (bytes) std::memset(p, byte, bytes);
  }
  /// Nothing is queued.
  void synchronize() {}

  /// A block that the policy keeps and lends to the running algorithm. So a sort at every step does not allocate at
  /// every step. The next call lends the same block again; it grows only, and counts in `memory`.
  void* workspace(std::size_t bytes) {
    if (bytes > workspace_bytes_) {
      deallocate(std::exchange(workspace_, nullptr), std::exchange(workspace_bytes_, 0));
      std::size_t const wanted = bytes + bytes / 4;
      workspace_ = allocate(wanted);
      workspace_bytes_ = wanted;
    }
    return workspace_;
  }

  /// A stage begins, in the one that is open.
  void begin_stage(char const* label) { open_.push_back({label, std::chrono::steady_clock::now()}); }
  /// The innermost stage ends.
  void end_stage() {
    std::chrono::duration<double, std::milli> const elapsed = std::chrono::steady_clock::now() - open_.back().start;
    profile.add(open_.back().label, elapsed.count());
    open_.pop_back();
  }

  /// Bytes that the system can still give, with those of files' caches, which it drops when asked; 0: not known.
  static std::size_t free_bytes() {
    std::ifstream info("/proc/meminfo");
    std::string key;
    for (std::size_t kilobytes = 0; info >> key >> kilobytes; info.ignore(256, '\n'))
      if (key == "MemAvailable:") return 1024 * kilobytes;
#if defined(_SC_AVPHYS_PAGES)
    long const pages = sysconf(_SC_AVPHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    if (pages > 0 && page > 0) return static_cast<std::size_t>(pages) * static_cast<std::size_t>(page);
#endif
    return 0;
  }

 private:
  static constexpr std::size_t huge_page = std::size_t{1} << 21, large = 4 * huge_page;
  static std::align_val_t alignment_of(std::size_t bytes) {
    return std::align_val_t{bytes >= large ? huge_page : std::size_t{64}};
  }
  struct open_stage {
    char const* label;
    std::chrono::steady_clock::time_point start;
  };
  std::vector<open_stage> open_;
  void* workspace_ = nullptr;
  std::size_t workspace_bytes_ = 0;
};

}}  // namespace gart::GART_ISA
