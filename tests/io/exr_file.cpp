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

TEST_CASE("EXR lines that zlib cannot shrink are stored plain") {
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

TEST_CASE("an EXR file that is written is read, channel by channel") {
  scratch_folder const folder;
  fs::path const path = folder.path / "image.exr";
  gart::image_float image(37, 35, 3);
  for (std::size_t k = 0; k < image.data.size(); ++k) image.data[k] = 0.01f * static_cast<float>(k % 100) - 0.2f;
  gart::write_exr(path, image, "RGB");
  CHECK(gart::read_exr(path).data == image.data);
  auto const blue = gart::read_exr(path, "B");
  CHECK(blue.at(5, 6, 0) == image.at(5, 6, 2));
  CHECK(gart::read_radiance(path).data[0] == 0);  // it was below
  CHECK(holds(error_of([&] { gart::read_exr(path, "Z"); }), "has no channel Z, only B, G, R"));
  gart::image_float const grey(2, 2, 1, 0.5f);
  gart::write_exr(folder.path / "grey.exr", grey, "Y");
  CHECK(gart::read_exr(folder.path / "grey.exr").at(1, 1, 2) == 0.5f);
  std::string const bytes = text_of(path);
  maltreat(path, bytes, true, [&] { gart::read_exr(path); });
  auto const with_byte = [&](char const* after, std::size_t skip, char value) {
    std::string text = bytes;
    text[text.find(after) + skip] = value;
    return error_of([&] { gart::read_exr(folder.put("other.exr", text)); });
  };
  CHECK(holds(with_byte("compression\0compression", 28, 4), "'compression' is PIZ"));
  CHECK(holds(with_byte("\x76\x2f\x31\x01", 5, 2), "is tiled"));
}

TEST_CASE("halfs, runs and single lines of EXR files are read") {
  scratch_folder const folder;
  auto const file = [&](char compression, std::string const& block, int size) {
    std::string text;
    append(text, 20000630), append(text, 2);
    auto const attribute = [&](char const* name, char const* type, std::string const& value) {
      text.append(name).push_back('\0'), text.append(type).push_back('\0');
      append(text, static_cast<int>(value.size())), text += value;
    };
    std::string channels("Y"), window;
    channels.push_back('\0');
    for (int const v : {1, 0, 1, 1}) append(channels, v);
    channels.push_back('\0');
    for (int const v : {0, 7, 3, 7}) append(window, v);  // 4 pixels, the line 7
    attribute("channels", "chlist", channels), attribute("compression", "compression", std::string(1, compression));
    attribute("dataWindow", "box2i", window);
    text.push_back('\0');
    append(text, static_cast<gart::u64>(text.size() + 8));
    append(text, 7), append(text, size);
    return folder.put("half.exr", text + block);
  };
  std::string halfs;
  for (gart::u16 const v : {0x3c00, 0xc000, 0x0001, 0x7c00}) append(halfs, v);  // 1, -2, the least, infinity
  auto const plain = gart::read_exr(file(0, halfs, 8), "Y");
  CHECK(plain.data[0] == 1);
  CHECK(plain.data[1] == -2);
  CHECK(plain.data[2] == 0x1p-24f);
  CHECK(std::isinf(plain.data[3]));
  CHECK(gart::read_radiance(folder.path / "half.exr").at(3, 0, 1) == 65504);
  // Four times 0x3c00: low bytes 0, then high bytes 0x3c; as differences plus 128: 0, 128 128 128, 0xbc, 128 128 128.
  std::string const runs("\0\0\2\x80\0\xbc\2\x80", 8);
  CHECK(gart::read_exr(file(1, runs.substr(0, 8), 8), "Y").data[0] != 1);  // of a block's own size: as it is
  std::string const shorter("\0\0\2\x80\xff\xbc\2\x80", 8);
  auto const packed = [&](std::string const& b) { return gart::read_exr(file(1, b, static_cast<int>(b.size())), "Y"); };
  CHECK(holds(error_of([&] { packed(shorter.substr(0, 6)); }), "unpacks to another size"));
  // One run of 0, then seven equal steps: bytes 0, 1, 2 ... as differences of 1.
  auto const steps = packed(std::string("\0\0\6\x81", 4));
  gart::u16 const first = 0x0400;  // low byte 0, high byte 4
  CHECK(steps.data[0] == std::ldexp(1.0f, ((first >> 10) & 31) - 15));
}

TEST_CASE("Radiance files are read, in runs and plain") {
  scratch_folder const folder;
  std::string const head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X ";
  auto const plain =
      gart::read_radiance(folder.put("a.hdr", head + "2\n" + std::string("\x80\x40\x20\x82\0\0\0\0", 8)));
  CHECK(plain.data[0] == 2);
  CHECK(plain.data[1] == 1);
  CHECK(plain.data[2] == 0.5f);
  CHECK(plain.data[3] == 0);
  // Eight pixels: runs of red and exponent, green and blue spelled out.
  std::string line("\2\2\0\x08\x88\x80\x08", 7);
  line += "\1\2\3\4\5\6\7\x08";
  line += std::string("\x08\0\0\0\0\0\0\0\0\x88\x88", 11);
  auto const runs = gart::read_radiance(folder.put("b.hdr", head + "8\n" + line));
  CHECK(runs.at(7, 0, 0) == 128);
  CHECK(runs.at(7, 0, 1) == 8);
  CHECK(runs.at(7, 0, 2) == 0);
  CHECK(holds(error_of([&] { gart::read_radiance(folder.put("b.hdr", head + "8\n" + line.substr(0, 12))); }), "b.hdr"));
  CHECK(holds(error_of([&] { gart::read_radiance(folder.put("c.hdr", head + "60000\n")); }), "truncated"));
  CHECK(holds(error_of([&] { gart::read_radiance(folder.put("d.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n")); }),
              "FORMAT"));
}
