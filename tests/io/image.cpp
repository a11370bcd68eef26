#include "support.hpp"

#include <png.h>

#include <cmath>
#include <cstdio>

using namespace gart_test;
using gart::image8;
using gart::u8;

namespace {

image8 random_image(int w, int h, int channels, std::mt19937_64& random) {
  image8 image(w, h, channels);
  for (u8& v : image.data) v = static_cast<u8>(random());
  return image;
}

// A PNG of any kind, by libpng itself.
void write_kind(fs::path const& path, int w, int h, int kind, int depth, bool interlaced, std::string const& rows,
                bool trns) {
  FILE* file = std::fopen(path.c_str(), "wb");
  REQUIRE(file);
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file);
  png_set_IHDR(png, info, static_cast<png_uint_32>(w), static_cast<png_uint_32>(h), depth, kind,
               interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_color palette[2] = {{10, 20, 30}, {200, 150, 100}};
  png_byte alpha[1] = {77};
  if (kind == PNG_COLOR_TYPE_PALETTE) png_set_PLTE(png, info, palette, 2);
  if (trns) png_set_tRNS(png, info, alpha, 1, nullptr);
  png_write_info(png, info);
  std::vector<png_byte*> pointers;
  std::size_t const row = rows.size() / static_cast<std::size_t>(h);
  std::string copy = rows;
  for (int y = 0; y < h; ++y)
    pointers.push_back(reinterpret_cast<png_byte*>(copy.data()) + row * static_cast<std::size_t>(y));
  png_write_image(png, pointers.data());
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  std::fclose(file);
}

}  // namespace

TEST_CASE("PNG returns what was written, for 1, 3 and 4 channels") {
  CAPTURE(seed());
  std::mt19937_64 random(seed());
  scratch_folder const folder;
  for (int channels : {1, 3, 4}) {
    image8 const image = random_image(37, 21, channels, random);
    gart::write_png(folder.path / "a.jpg", image);  // the first bytes decide, not the name
    image8 const back = gart::read_image(folder.path / "a.jpg");
    CHECK(back.width == 37);
    CHECK(back.height == 21);
    CHECK(back.channels == channels);
    CHECK(back.data == image.data);
  }
  CHECK_THROWS_AS(gart::encode_png(image8(3, 3, 2)), gart::invalid_argument);
  CHECK_THROWS_AS(gart::encode_png(image8()), gart::invalid_argument);
}

TEST_CASE("PNG of 16 bits, palette, gray with alpha, interlaced") {
  scratch_folder const folder;
  fs::path const path = folder.path / "a.png";
  write_kind(path, 2, 1, PNG_COLOR_TYPE_GRAY, 16, false, std::string("\xff\xff\x80\x00", 4), false);
  image8 image = gart::read_image(path);
  CHECK(image.channels == 1);
  CHECK(image.data == std::vector<u8>{255, 128});  // 0x8000 / 257 = 127.5
  write_kind(path, 2, 1, PNG_COLOR_TYPE_PALETTE, 8, false, std::string("\0\1", 2), false);
  CHECK(gart::read_image(path).data == std::vector<u8>{10, 20, 30, 200, 150, 100});
  write_kind(path, 2, 1, PNG_COLOR_TYPE_PALETTE, 8, false, std::string("\0\1", 2), true);
  CHECK(gart::read_image(path).data == std::vector<u8>{10, 20, 30, 77, 200, 150, 100, 255});
  write_kind(path, 1, 1, PNG_COLOR_TYPE_GRAY_ALPHA, 8, false, "\x40\x20", false);
  CHECK(gart::read_image(path).data == std::vector<u8>{0x40, 0x40, 0x40, 0x20});
  std::string rows;
  for (int i = 0; i < 9 * 7 * 3; ++i) rows += static_cast<char>(i);
  write_kind(path, 9, 7, PNG_COLOR_TYPE_RGB, 8, true, rows, false);
  image = gart::read_image(path);
  CHECK(std::string(image.data.begin(), image.data.end()) == rows);
  write_kind(path, 4000, 4000, PNG_COLOR_TYPE_GRAY, 1, false, std::string(500 * 4000, '\0'), false);
  CHECK(gart::read_image(path).data.size() == 16000000);  // the best compression there is
}

TEST_CASE("JPEG keeps a smooth image, and gray stays gray") {
  scratch_folder const folder;
  for (int channels : {1, 3}) {
    image8 image(64, 48, channels);
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 64; ++x) {
        for (int c = 0; c < channels; ++c) image.at(x, y, c) = static_cast<u8>(40 + 2 * x + y + 20 * c);
      }
    }
    auto const bytes = gart::encode_jpeg(image, 95);
    fs::path const path = folder.put("a.png", {reinterpret_cast<char const*>(bytes.data()), bytes.size()});
    image8 const back = gart::read_image(path);
    REQUIRE(back.channels == channels);
    REQUIRE(back.data.size() == image.data.size());
    int worst = 0;
    for (std::size_t i = 0; i < image.data.size(); ++i)
      worst = std::max(worst, std::abs(int{image.data[i]} - int{back.data[i]}));
    CHECK(worst <= 4);
  }
  CHECK_THROWS_AS(gart::encode_jpeg(image8(3, 3, 4)), gart::invalid_argument);
}

TEST_CASE("damaged images are refused and never crash") {
  std::mt19937_64 random(seed());
  scratch_folder const folder;
  image8 const image = random_image(31, 17, 3, random);
  auto const png = gart::encode_png(image), jpeg = gart::encode_jpeg(image);
  for (auto const* bytes : {&png, &jpeg}) {
    fs::path const path = folder.path / "photo.img";
    maltreat(path, {bytes->begin(), bytes->end()}, true, [&] { gart::read_image(path); });
  }
  CHECK(holds(error_of([&] { gart::read_image(folder.put("text.png", "hello")); }), "neither PNG, JPEG nor WebP"));
}

TEST_CASE("a size that the data cannot hold is refused first") {
  scratch_folder const folder;
  auto bytes = gart::encode_png(image8(4, 4, 3));
  // IHDR's width and height, and its checksum.
  for (std::size_t i : {18u, 22u}) bytes[i] = 0x0f;
  png_byte const* header = bytes.data() + 12;
  gart::u32 crc = 0xffffffffu;
  for (int i = 0; i < 17; ++i) {
    crc ^= header[i];
    for (int k = 0; k < 8; ++k) crc = (crc >> 1) ^ ((crc & 1) ? 0xedb88320u : 0);
  }
  crc = ~crc;
  for (int i = 0; i < 4; ++i) bytes[static_cast<std::size_t>(29 + i)] = static_cast<u8>(crc >> (24 - 8 * i));
  fs::path const path = folder.put("huge.png", {reinterpret_cast<char const*>(bytes.data()), bytes.size()});
  CHECK(holds(error_of([&] { gart::read_image(path); }), "larger than its data"));
}

TEST_CASE("box_downscale is the mean of blocks, weighted by alpha") {
  image8 image(5, 3, 1);
  for (int i = 0; i < 15; ++i) image.data[static_cast<std::size_t>(i)] = static_cast<u8>(10 * i);
  image8 const half = gart::box_downscale(image, 2);
  CHECK(half.width == 2);
  CHECK(half.height == 1);
  CHECK(half.data == std::vector<u8>{30, 50});  // (0 + 10 + 50 + 60) / 4, (20 + 30 + 70 + 80) / 4
  image8 rgba(2, 2, 4);
  rgba.data = {200, 100, 0, 255, 7, 7, 7, 0, 100, 200, 0, 255, 9, 9, 9, 0};
  CHECK(gart::box_downscale(rgba, 2).data == std::vector<u8>{150, 150, 0, 128});
  CHECK(gart::box_downscale(rgba, 1).data == rgba.data);
  CHECK_THROWS_AS(gart::box_downscale(rgba, 3), gart::invalid_argument);
}

TEST_CASE("8 bits and float convert both ways") {
  image8 image(256, 1, 1);
  for (int i = 0; i < 256; ++i) image.data[static_cast<std::size_t>(i)] = static_cast<u8>(i);
  CHECK(gart::to_8bit(gart::to_float(image)).data == image.data);
  gart::image_float odd(4, 1, 1);
  odd.data = {-1.0f, 2.0f, std::nanf(""), 0.502f};
  CHECK(gart::to_8bit(odd).data == std::vector<u8>{0, 255, 0, 128});
}
