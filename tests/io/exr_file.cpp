// EXR files, read back by the format's own description: every number, the names and the order of channels, lines that
// zlib makes no smaller, and what is refused.
#include "support.hpp"

#include <gart/io/exr_file.hpp>
#include <gart/io/file.hpp>

#include <zlib.h>

#include <cstring>
#include <map>
#include <random>

using namespace gart_test;

namespace {

struct exr {
  std::map<std::string, std::string> attributes;
  std::string channels;
  int width = 0, height = 0, stored = 0;  // stored: blocks that are not packed
  std::vector<float> values;              // [y][channel][x]
};

struct reader {
  std::vector<gart::u8> bytes;
  std::size_t at = 0;

  template <class T>
  T take() {
    T out;
    REQUIRE(at + sizeof out <= bytes.size());
    std::memcpy(&out, bytes.data() + at, sizeof out);
    at += sizeof out;
    return out;
  }
  std::string text() {
    std::string out;
    for (char c; (c = take<char>()) != 0;) out.push_back(c);
    return out;
  }
};

exr read(fs::path const& path) {
  reader r{gart::read_file(path)};
  exr out;
  REQUIRE(r.take<std::int32_t>() == 20000630);
  REQUIRE(r.take<std::int32_t>() == 2);
  for (std::string name; !(name = r.text()).empty();) {
    std::string const type = r.text();
    auto const size = static_cast<std::size_t>(r.take<std::int32_t>());
    out.attributes[name] = std::string(reinterpret_cast<char const*>(r.bytes.data() + r.at), size);
    r.at += size;
  }
  REQUIRE(out.attributes["compression"] == std::string("\3"));
  std::string const& list = out.attributes["channels"];
  for (std::size_t k = 0; k + 18 <= list.size(); k += 18) {
    out.channels.push_back(list[k]);
    REQUIRE(list[k + 1] == 0);
    REQUIRE(list[k + 2] == 2);
  }
  std::int32_t window[4];
  std::memcpy(window, out.attributes["dataWindow"].data(), sizeof window);
  out.width = window[2] + 1, out.height = window[3] + 1;
  std::size_t const line = 4 * out.channels.size() * static_cast<std::size_t>(out.width);
  std::vector<std::uint64_t> offsets(static_cast<std::size_t>(out.height + 15) / 16);
  for (auto& o : offsets) o = r.take<std::uint64_t>();
  std::string raw;
  for (std::size_t block = 0; block < offsets.size(); ++block) {
    REQUIRE(r.at == offsets[block]);
    REQUIRE(r.take<std::int32_t>() == static_cast<int>(16 * block));
    auto const size = static_cast<std::size_t>(r.take<std::int32_t>());
    std::size_t const whole = line * std::min<std::size_t>(16, static_cast<std::size_t>(out.height) - 16 * block);
    std::string lines(reinterpret_cast<char const*>(r.bytes.data() + r.at), size);
    r.at += size;
    if (size < whole) {
      std::string packed(whole, '\0');
      uLongf got = whole;
      REQUIRE(uncompress(reinterpret_cast<Bytef*>(packed.data()), &got, reinterpret_cast<Bytef const*>(lines.data()),
                         size) == Z_OK);
      REQUIRE(got == whole);
      for (std::size_t k = 1; k < whole; ++k) packed[k] = static_cast<char>(packed[k - 1] + packed[k] - 128);
      lines.resize(whole);
      for (std::size_t k = 0; k < whole; ++k) lines[k] = packed[k / 2 + (k % 2 ? (whole + 1) / 2 : 0)];
    } else {
      REQUIRE(size == whole);
      ++out.stored;
    }
    raw += lines;
  }
  CHECK(r.at == r.bytes.size());
  out.values.resize(raw.size() / 4);
  std::memcpy(out.values.data(), raw.data(), raw.size());
  return out;
}

}  // namespace

TEST_CASE("an image of floats is what its EXR file holds") {
  scratch_folder const folder;
  fs::path const path = folder.path / "image.exr";
  gart::image_float image(37, 35, 3);  // the last block is short
  for (std::size_t k = 0; k < image.data.size(); ++k) image.data[k] = 0.01f * static_cast<float>(k % 100) - 0.2f;
  image.data[5] = 1e30f, image.data[6] = -0.0f;
  gart::write_exr(path, image, "RGB");
  exr const got = read(path);
  CHECK(got.channels == "BGR");
  CHECK(got.width == 37);
  CHECK(got.height == 35);
  CHECK(got.stored == 0);
  CHECK(got.attributes.count("displayWindow") == 1);
  CHECK(got.attributes.count("screenWindowWidth") == 1);
  long other = 0;
  for (std::size_t y = 0; y < 35; ++y)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t x = 0; x < 37; ++x)
        other += std::memcmp(&got.values[(y * 3 + c) * 37 + x], &image.data[(y * 37 + x) * 3 + 2 - c], 4) != 0;
  CHECK(other == 0);
}

TEST_CASE("lines of an EXR file that zlib makes no smaller are stored as they are") {
  scratch_folder const folder;
  fs::path const path = folder.path / "noise.exr";
  std::mt19937 random(3);
  gart::image_float image(8, 20, 1);
  for (float& v : image.data) {
    auto const bits = static_cast<gart::u32>(random());
    std::memcpy(&v, &bits, 4);
  }
  gart::write_exr(path, image, "Z");
  exr const got = read(path);
  CHECK(got.channels == "Z");
  CHECK(got.stored > 0);
  CHECK(std::memcmp(got.values.data(), image.data.data(), 4 * image.data.size()) == 0);
}

TEST_CASE("an EXR file without a name for each channel is refused") {
  gart::image_float const image(2, 2, 3);
  CHECK_THROWS_WITH_AS(gart::write_exr("x.exr", image, "Z"), doctest::Contains("name each by a letter"),
                       gart::invalid_argument);
  CHECK_THROWS_AS(gart::write_exr("x.exr", {}, ""), gart::invalid_argument);
  CHECK(error_of([&] { gart::write_exr("/nothing/here/x.exr", image, "RGB"); }).find("x.exr") != std::string::npos);
}
