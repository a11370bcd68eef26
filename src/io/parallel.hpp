#pragma once
// Work in parts, on all processors.

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace gart::io {

// f(i) for i < n on all processors; the first exception stops the rest and is thrown again here.
template <class F>
void for_each_parallel(std::size_t n, F const& f) {
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex guard;
  auto const work = [&] {
    for (std::size_t i; (i = next++) < n;) {
      try {
        f(i);
      } catch (...) {
        std::lock_guard const lock(guard);
        if (!failure) failure = std::current_exception();
        next = n;
      }
    }
  };
  std::vector<std::thread> threads;
  std::size_t const processors = std::max(1u, std::thread::hardware_concurrency());
  try {
    for (std::size_t i = 1; i < std::min(n, processors); ++i) threads.emplace_back(work);
  } catch (std::system_error const&) {
    // Fewer threads than processors do the same work.
  }
  work();
  for (std::thread& thread : threads) thread.join();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace gart::io
