// The main kernels of a training step by row, instantiated for bench/registers.py to read what the compiler gave them.
#include <gart/backward/backward.hpp>
#include <gart/exec/cuda_launch.cuh>
#include <gart/trace/tile_tracer.hpp>

using namespace gart;

namespace {

template <int ShDegree, class Response, class Entry>
using forward_kernel = walk_tile_warps<Response, 8, composite<ShDegree, record_slots<Entry, 8>>>;

template <int ShDegree, class Response, class Entry>
using forward_depth_kernel =
    walk_tile_warps<Response, 8, composite<ShDegree, record_with_depth<record_slots<Entry, 8>>>>;

template <int ShDegree, class Response, class Entry, gather_sums Sums, class Terms>
struct gather_row {
  using policy = cuda_exec;
  using response = Response;
  using terms = Terms;
  using entry = Entry;
  using rays = pixel_rays;
  static constexpr int sh_degree = ShDegree, tile_size = 8;
  static constexpr gather_sums sums = Sums;
  static constexpr slot_validity validity = slot_validity::recomputed;
  static constexpr kernel_form form = kernel_form::warp;
};

template <int ShDegree, class Response, class Entry, gather_sums Sums = gather_sums::atomic,
          class Terms = terms<term::color, term::geometry>>
using backward_kernel = gather_of<gather_row<ShDegree, Response, Entry, Sums, Terms>>;

template <int ShDegree, class Response, class Entry>
using backward_depth_kernel =
    backward_kernel<ShDegree, Response, Entry, gather_sums::atomic, terms<term::color, term::geometry>::with_depth>;

}  // namespace

#define FORWARD(...) \
  template __global__ void detail::run_tile_kernel<forward_kernel<__VA_ARGS__>>(forward_kernel<__VA_ARGS__> const);
#define BACKWARD(...) \
  template __global__ void detail::run_tile_kernel<backward_kernel<__VA_ARGS__>>(backward_kernel<__VA_ARGS__> const);
#define DEPTH(...)                                                                      \
  template __global__ void detail::run_tile_kernel<forward_depth_kernel<__VA_ARGS__>>(  \
      forward_depth_kernel<__VA_ARGS__> const);                                         \
  template __global__ void detail::run_tile_kernel<backward_depth_kernel<__VA_ARGS__>>( \
      backward_depth_kernel<__VA_ARGS__> const);
#define ROW(degree, response, entry) \
  FORWARD(degree, response, entry)   \
  BACKWARD(degree, response, entry)

using plain = generalized_gaussian<>;

ROW(0, plain, hit_entry)
ROW(3, plain, hit_entry)
ROW(3, generalized_gaussian<4>, hit_entry)
ROW(3, plain, half_hit_entry)
BACKWARD(3, plain, hit_entry, gather_sums::ordered)
DEPTH(0, plain, hit_entry)
DEPTH(3, plain, hit_entry)
