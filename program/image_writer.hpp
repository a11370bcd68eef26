#pragma once
/// \file
/// Writes PNG files in threads of its own: compressing an image takes longer than rendering it. As many at a time as
/// there are processors, and no more images than that wait. The first error is thrown by the next png() or by finish(),
/// which must be called last.

#include <gart/io/image_file.hpp>

#include <algorithm>
#include <deque>
#include <filesystem>
#include <future>
#include <thread>
#include <utility>

namespace gart_cli {

class image_writer {
 public:
  void png(std::filesystem::path const& file, gart::image8 image) {
    while (writing_.size() >= std::max(1u, std::thread::hardware_concurrency())) take();
    writing_.push_back(
        std::async(std::launch::async, [file, image = std::move(image)] { gart::write_png(file, image); }));
  }
  void finish() {
    while (!writing_.empty()) take();
  }

 private:
  void take() {
    std::future<void> first = std::move(writing_.front());
    writing_.pop_front();
    first.get();
  }
  std::deque<std::future<void>> writing_;
};

}  // namespace gart_cli
