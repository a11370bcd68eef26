#pragma once
// What the io tests share: a folder that goes away, the text of an error, and files made by hand.

#include <gart/core/error.hpp>
#include <gart/io/dataset.hpp>
#include <gart/io/file.hpp>
#include <gart/io/image_file.hpp>

#include <doctest/doctest.h>

#include <unistd.h>

#include <atomic>
#include <cstring>
#include <filesystem>
#include <random>
#include <string>
#include <string_view>

#include "support/policies.hpp"

namespace gart_test {

namespace fs = std::filesystem;

struct scratch_folder {
  fs::path path;
  scratch_folder() {
    static std::atomic<int> serial{0};
    path = fs::temp_directory_path() / ("gart_io_" + std::to_string(::getpid()) + "_" + std::to_string(serial++));
    fs::create_directories(path);
  }
  ~scratch_folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  fs::path put(std::string const& name, std::string_view bytes) const {
    fs::create_directories((path / name).parent_path());
    gart::write_file(path / name, bytes);
    return path / name;
  }
  fs::path put_image(std::string const& name, int width, int height, int channels = 3, int value = 90) const {
    fs::create_directories((path / name).parent_path());
    gart::image8 const image(width, height, channels, static_cast<gart::u8>(value));
    if (fs::path(name).extension() == ".png") {
      gart::write_png(path / name, image);
    } else {
      auto const bytes = gart::encode_jpeg(image);
      gart::write_file(path / name, {reinterpret_cast<char const*>(bytes.data()), bytes.size()});
    }
    return path / name;
  }
};

// What f throws, "" where nothing; an exception that is not gart's own fails the test.
template <class F>
std::string error_of(F const& f) {
  try {
    f();
  } catch (gart::error const& e) {
    return e.what();
  } catch (std::exception const& e) {
    FAIL("not an error of gart's: ", e.what());
  }
  return "";
}

inline bool holds(std::string const& text, std::string const& part) { return text.find(part) != std::string::npos; }

inline std::string text_of(fs::path const& path) {
  auto const bytes = gart::read_file(path);
  return {bytes.begin(), bytes.end()};
}

template <class T>
void append(std::string& bytes, T value) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  bytes.append(raw, sizeof value);
}

inline bool any_note(gart::dataset const& data, std::string const& part) {
  for (std::string const& note : data.notes) {
    if (holds(note, part)) return true;
  }
  return false;
}

// Cuts `bytes` at every offset below 64 and at random ones, and flips random bytes: load(file) must succeed or throw
// one of gart's errors. With `strict`, every cut must throw.
template <class Load>
void maltreat(fs::path const& file, std::string const& bytes, bool strict, Load const& load) {
  CAPTURE(seed());
  CAPTURE(file.string());
  std::mt19937_64 random(seed());
  auto const write = [&](std::string const& text) { gart::write_file(file, text); };
  for (int i = 0; i < 120; ++i) {
    std::size_t const cut = i < 64 ? static_cast<std::size_t>(i) : random() % bytes.size();
    if (cut >= bytes.size()) continue;
    CAPTURE(cut);
    write(bytes.substr(0, cut));
    std::string const what = error_of(load);
    if (strict) CHECK_MESSAGE(!what.empty(), "accepted a file cut at ", cut);
    if (!what.empty()) CHECK(holds(what, file.filename().string()));
  }
  for (int i = 0; i < 200; ++i) {
    std::string damaged = bytes;
    int const flips = 1 + static_cast<int>(random() % 8);
    for (int k = 0; k < flips; ++k) damaged[random() % damaged.size()] = static_cast<char>(random());
    write(damaged);
    error_of(load);
  }
  write(bytes);
  CHECK(error_of(load) == "");
}

}  // namespace gart_test
