#include "host_images.hpp"

#include <gart/core/error.hpp>

#include <algorithm>
#include <exception>
#include <memory>
#include <string>

namespace gart::io {

namespace {

// The images of a view, as all ranks need to know them.
struct shape {
  int width = 0, height = 0, channels = 0;
};
struct view_shapes {
  shape image, mask, depth;
};

template <class T>
shape shape_of(basic_image<T> const& image) {
  return image.empty() ? shape{} : shape{image.width, image.height, image.channels};
}
std::size_t values_in(shape const& s) {
  return static_cast<std::size_t>(s.width) * static_cast<std::size_t>(s.height) * static_cast<std::size_t>(s.channels);
}

constexpr std::size_t line = 64;  // bytes: where an image begins

std::size_t up_to_line(std::size_t bytes) { return (bytes + line - 1) / line * line; }

// The image at that place of the memory, which goes on behind it.
template <class T>
void place(basic_image<T>& image, shape const& s, bool mine, std::shared_ptr<void> const& memory, std::size_t& at) {
  std::size_t const n = values_in(s);
  if (n == 0) return;
  T* const there = reinterpret_cast<T*>(static_cast<char*>(memory.get()) + at);
  if (mine) std::copy_n(image.data.data(), n, there);
  image.width = s.width, image.height = s.height, image.channels = s.channels;
  image.data = pixels<T>(std::shared_ptr<T>(memory, there), n);
  at += up_to_line(n * sizeof(T));
}

}  // namespace

void agreed_on_host(host_group& host, std::function<void()> const& f) {
  constexpr std::size_t longest = 1024;
  std::string what(longest, '\0');
  std::exception_ptr mine;
  try {
    f();
  } catch (std::exception const& e) {
    mine = std::current_exception();
    what = std::string(e.what()).substr(0, longest - 1);
    if (what.empty()) what = "failed";
    what.resize(longest);
  }
  std::string all(longest * static_cast<std::size_t>(host.size()), '\0');
  host.all_gather(what.data(), all.data(), longest);
  if (mine) std::rethrow_exception(mine);
  for (std::size_t at = 0; at < all.size(); at += longest)
    if (all[at] != '\0') throw error("another rank of this host: " + std::string(all.c_str() + at));
}

bool share_on_host(host_group& host, std::vector<dataset_view>& views) {
  auto const ranks = static_cast<std::size_t>(host.size()), rank = static_cast<std::size_t>(host.rank());
  std::vector<view_shapes> shapes(views.size()), all(views.size() * ranks);
  for (std::size_t i = 0; i < views.size(); ++i)
    shapes[i] = {shape_of(views[i].image), shape_of(views[i].mask), shape_of(views[i].depth)};
  host.all_gather(shapes.data(), all.data(), shapes.size() * sizeof(view_shapes));
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    view_shapes const& s = shapes[i] = all[i % ranks * views.size() + i];
    bytes +=
        up_to_line(values_in(s.image)) + up_to_line(values_in(s.mask)) + up_to_line(values_in(s.depth) * sizeof(float));
  }
  if (bytes == 0) return true;
  std::shared_ptr<void> const memory = host.allocate(bytes);
  if (!memory) return false;
  std::size_t at = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    bool const mine = i % ranks == rank;
    place(views[i].image, shapes[i].image, mine, memory, at);
    place(views[i].mask, shapes[i].mask, mine, memory, at);
    place(views[i].depth, shapes[i].depth, mine, memory, at);
  }
  host.barrier();
  return true;
}

}  // namespace gart::io
