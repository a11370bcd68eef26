// The formats that pack Gaussians: there and back within a quantum, axes, what has no room, files made by hand.

#include <gart/io/ply.hpp>
#include <gart/io/splat_file.hpp>

#include "support.hpp"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace {

using namespace gart_test;

gart::gaussian_model random_model(std::size_t n, int degree) {
  std::mt19937_64 random(seed());
  std::normal_distribution<float> normal;
  gart::gaussian_model m;
  m.resize(n, degree);
  for (float& v : m.mean) v = 2 * normal(random);
  for (float& v : m.log_scale) v = -4 + normal(random);
  for (float& v : m.quaternion) v = normal(random);
  for (float& v : m.opacity) v = 2 * normal(random);
  for (float& v : m.sh) v = 0.2f * std::clamp(normal(random), -3.0f, 3.0f);
  return m;
}

// Formats order the Gaussians as they like: those nearest to each other are the same. Means are far apart compared with
// a quantum.
std::vector<std::size_t> matched(gart::gaussian_model const& a, gart::gaussian_model const& b) {
  std::vector<std::size_t> of(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    float least = 1e30f;
    for (std::size_t j = 0; j < b.size(); ++j) {
      float d = 0;
      for (std::size_t c = 0; c < 3; ++c) d += std::abs(a.mean[3 * i + c] - b.mean[3 * j + c]);
      if (d < least) least = d, of[i] = j;
    }
  }
  return of;
}

double sigmoid(float x) { return 1 / (1 + std::exp(-static_cast<double>(x))); }

struct error_of_format {
  double mean = 0, log_scale = 0, rotation = 0, opacity = 0, base = 0, rest = 0;
};

// The largest difference of each array; rotations as matrices would have it, by the angle between unit quaternions.
error_of_format difference(gart::gaussian_model const& a, gart::gaussian_model const& b) {
  error_of_format e;
  auto const of = matched(a, b);
  std::size_t const width = a.sh.size() / a.size();
  auto const grow = [](double& most, double d) { most = std::max(most, std::abs(d)); };
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t const j = of[i];
    double dot = 0, na = 0, nb = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      grow(e.mean, static_cast<double>(a.mean[3 * i + c] - b.mean[3 * j + c]));
      grow(e.log_scale, static_cast<double>(a.log_scale[3 * i + c] - b.log_scale[3 * j + c]));
    }
    for (std::size_t c = 0; c < 4; ++c) {
      double const p = static_cast<double>(a.quaternion[4 * i + c]), q = static_cast<double>(b.quaternion[4 * j + c]);
      dot += p * q, na += p * p, nb += q * q;
    }
    grow(e.rotation, std::sqrt(std::max(0.0, 2 - 2 * std::abs(dot) / std::sqrt(na * nb))));
    grow(e.opacity, sigmoid(a.opacity[i]) - sigmoid(b.opacity[j]));
    for (std::size_t c = 0; c < width && c < b.sh.size() / b.size(); ++c)
      grow(c < 3 ? e.base : e.rest, static_cast<double>(a.sh[width * i + c] - b.sh[b.sh.size() / b.size() * j + c]));
  }
  return e;
}

bool without(std::string const& name) {
#if !defined(GART_WITH_ZSTD)
  if (name == "SPZ") return true;
#endif
#if !defined(GART_WITH_WEBP)
  if (name == "SOG") return true;
#endif
  return name.empty();
}

TEST_CASE("each format returns what it was given within its quantum") {
  CAPTURE(seed());
  // Half a step of each number, and a rounding; codebooks and palettes have no such bound, theirs is of these numbers.
  std::map<std::string, error_of_format> const quantum = {
      {"PLY", {0, 0, 1e-6, 0, 0, 0}},
      {"GLB", {0, 1e-6, 1e-6, 1e-6, 0, 0}},
      {"SPZ", {0.51 / 1048576, 0.51 / 16, 0.003, 0.51 / 255, 0.51 / 255 / 0.15, 0.51 / 16}},
      {"compressed PLY", {0.02, 0.01, 0.003, 0.51 / 255, 0.02, 0.51 / 32}},
      {"SOG", {3e-4, 0.51 / 16, 0.012, 0.51 / 255, 0.51 * 0.03, 1.2}},
      {"splat", {0, 1e-6, 0.02, 0.51 / 255, 0.51 / 255 / 0.28209, 0}}};
  scratch_folder const folder;
  for (int degree = 0; degree <= 3; ++degree) {
    auto const model = random_model(700, degree);
    for (gart::splat_format const* format : gart::splat_formats()) {
      if (without(format->name)) continue;
      CAPTURE(format->name);
      CAPTURE(degree);
      auto const path = folder.path / (std::string("model") + format->extension);
      gart::write_splats(path, model);
      auto const back = gart::read_splats(path);
      REQUIRE(back.size() == model.size());
      CHECK(back.sh_degree == std::min(degree, format->capabilities.sh_degree));
      auto const e = difference(model, back);
      auto most = quantum.at(format->name);
      // Its means have 24 bits in all, of which at most 20 are behind the point.
      if (std::string(format->name) == "SPZ")
        for (float const x : model.mean)
          most.mean = std::max(most.mean, 0.51 * std::exp2(std::ceil(std::log2(std::abs(double{x}))) - 23));
      CHECK(e.mean <= most.mean);
      CHECK(e.log_scale <= most.log_scale);
      CHECK(e.rotation <= most.rotation);
      CHECK(e.opacity <= most.opacity);
      CHECK(e.base <= most.base);
      CHECK(e.rest <= most.rest);
    }
  }
}

TEST_CASE("SPZ's coefficients have the bits that are asked for") {
  if (without("SPZ")) return;
  scratch_folder const folder;
  auto const model = random_model(300, 3);
  double last = 1;
  for (int bits : {3, 5, 8}) {
    gart::write_splats(folder.path / "m.spz", model, {}, {.sh1_bits = bits, .sh_bits = bits});
    double const rest = difference(model, gart::read_splats(folder.path / "m.spz")).rest;
    CHECK(rest <= 1.02 / (1 << bits));
    CHECK(rest < last);
    last = rest;
  }
  CHECK(holds(error_of([&] { gart::write_splats(folder.path / "m.spz", model, {}, {.sh_bits = 9}); }), "1 to 8"));
}

TEST_CASE("SPZ's positions have the bits that their extent leaves") {
  if (without("SPZ")) return;
  scratch_folder const folder;
  // 24 bits with their sign, of which 20 are a fraction at most: the farthest decides, on both sides of each power
  // of 2.
  for (int power = 1; power < 22; ++power) {
    for (float const part : {0.51f, 0.99f}) {
      gart::gaussian_model m = random_model(4, 0);
      float const most = std::ldexp(part, power);
      m.mean = {most, 0, -most, most / 3, most, 0, 0, -most, most / 7, -most, most, most};
      CAPTURE(most);
      gart::write_splats(folder.path / "m.spz", m);
      double const step = std::ldexp(1.0, -std::min(20, 23 - power));
      CHECK(difference(m, gart::read_splats(folder.path / "m.spz")).mean <= 0.51 * step + 1e-7 * double{most});
    }
  }
}

TEST_CASE("SOG's palette has all rows and gains by more") {
  if (without("SOG")) return;
  scratch_folder const folder;
  std::mt19937_64 random(seed());
  CAPTURE(seed());
  std::normal_distribution<float> normal;
  std::vector<float> kinds(40 * 45);
  for (float& v : kinds) v = 0.3f * normal(random);
  auto const error = [&](gart::gaussian_model const& model, int rows) {
    gart::write_splats(folder.path / "m.sog", model, {}, {.palette = rows});
    auto const back = gart::read_splats(folder.path / "m.sog");
    auto const of = matched(model, back);
    double squares = 0;
    for (std::size_t i = 0; i < model.size(); ++i) {
      for (std::size_t c = 3; c < 48; ++c) {
        double const d = static_cast<double>(model.sh[48 * i + c] - back.sh[48 * of[i] + c]);
        squares += d * d;
      }
    }
    return std::sqrt(squares / static_cast<double>(45 * model.size()));
  };
  // Forty kinds of Gaussians, a thousandth apart within each.
  auto model = random_model(900, 3);
  for (std::size_t i = 0; i < model.size(); ++i)
    for (std::size_t c = 3; c < 48; ++c)
      model.sh[48 * i + c] = kinds[45 * (i % 40) + c - 3] + 1e-3f * std::clamp(normal(random), -3.0f, 3.0f);
  CHECK(error(model, 128) < 0.01);

  model = random_model(900, 3);
  double const few = error(model, 64), more = error(model, 256), all = error(model, 900);
  CHECK(more < few);
  CHECK(all < 0.01);
}

TEST_CASE("what a format has no room for is refused or listed") {
  scratch_folder const folder;
  auto const model = random_model(50, 2);
  gart::splat_traits const traits = {{"near", "0.01"}, {"antialias", "0.3"}};
  for (char const* name : {"m.ply", "m.compressed.ply", "m.glb"}) {
    CHECK(gart::left_out(folder.path / name, model, traits).empty());
    gart::write_splats(folder.path / name, model, traits);
    gart::splat_traits back;
    gart::read_splats(folder.path / name, &back);
    CHECK(back == traits);
  }
  auto const spz = gart::left_out(folder.path / "m.spz", model, traits);
  REQUIRE(spz.size() == 2);
  CHECK(holds(spz[0], "width of antialias"));
  CHECK(spz[1] == "near 0.01");
  if (!without("SPZ")) {
    gart::write_splats(folder.path / "m.spz", model, traits);
    gart::splat_traits back;
    gart::read_splats(folder.path / "m.spz", &back);
    CHECK(back == gart::splat_traits{{"antialias", ""}});
  }
  auto const splat = gart::left_out(folder.path / "m.splat", model, {});
  REQUIRE(splat.size() == 1);
  CHECK(holds(splat[0], "above degree 0"));
  for (char const* name : {"k.spz", "k.sog", "k.splat", "k.glb"}) {
    std::string const said = error_of([&] { gart::write_splats(folder.path / name, model, {{"kernel_degree", "4"}}); });
    CHECK(holds(said, "no word for the kernel degree 4"));
    CHECK_FALSE(fs::exists(folder.path / name));
  }
  gart::gaussian_model broken = model;
  broken.mean[7] = std::nanf("");
  CHECK(holds(error_of([&] { gart::write_splats(folder.path / "k.glb", broken); }), "Gaussian 2, mean"));
}

std::string gzipped(std::string const& text) {
  z_stream stream{};
  REQUIRE(deflateInit2(&stream, 6, Z_DEFLATED, 16 + 15, 8, Z_DEFAULT_STRATEGY) == Z_OK);
  std::string out(text.size() + 1000, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data()), stream.avail_out = static_cast<uInt>(out.size());
  REQUIRE(deflate(&stream, Z_FINISH) == Z_STREAM_END);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

// One Gaussian at (1, -2, 0.5) in SPZ's axes, which are y up and z back.
std::string old_spz(gart::u32 version) {
  std::string raw;
  for (gart::u32 v : {0x5053474eu, version, 1u}) append(raw, v);
  raw += std::string("\0\x0c\x01\0", 4);  // degree 0, 12 bits, antialiased
  if (version == 1)
    for (gart::u16 half : {0x3c00, 0xc000, 0x3800}) append(raw, half);
  else
    for (int fixed : {4096, -8192, 2048})
      for (int b = 0; b < 3; ++b) raw += static_cast<char>(fixed >> 8 * b);
  raw += static_cast<char>(51);  // opacity 0.2
  raw += std::string("\x80\x80\xff", 3);
  raw += std::string("\x80\x90\xa0", 3);  // scales -2, -1, 0
  if (version < 3)
    raw += std::string("\xff\x80\x7f", 3);  // x is 1
  else
    append(raw, gart::u32{0u << 30 | 0u << 20});  // x is the largest, the others 0
  return gzipped(raw);
}

TEST_CASE("SPZ of versions 1 to 3 is read, in its own axes") {
  scratch_folder const folder;
  for (gart::u32 version : {1u, 2u, 3u}) {
    CAPTURE(version);
    gart::splat_traits traits;
    auto const m = gart::read_splats(folder.put("old.bin", old_spz(version)), &traits);
    REQUIRE(m.size() == 1);
    CHECK(m.mean == std::vector<float>{1, 2, -0.5f});
    CHECK(m.log_scale == std::vector<float>{-2, -1, 0});
    CHECK(std::abs(m.quaternion[1]) == doctest::Approx(1).epsilon(0.01));
    CHECK(sigmoid(m.opacity[0]) == doctest::Approx(0.2));
    CHECK(static_cast<double>(m.sh[2]) == doctest::Approx(0.5 / 0.15));
    CHECK(traits.count("antialias") == 1);
  }
  CHECK(holds(error_of([&] { gart::read_splats(folder.put("new.spz", old_spz(9))); }), "version 9"));
  std::string cut = old_spz(3);
  cut.resize(cut.size() - 14);
  CHECK(holds(error_of([&] { gart::read_splats(folder.put("cut.spz", cut)); }), "cut.spz"));
}

TEST_CASE("every cut of a file is refused by an error that names it") {
  scratch_folder const folder;
  auto const model = random_model(40, 1);
  for (gart::splat_format const* format : gart::splat_formats()) {
    if (without(format->name)) continue;
    CAPTURE(format->name);
    auto const path = folder.path / (std::string("whole") + format->extension);
    gart::write_splats(path, model);
    std::string const whole = text_of(path);
    for (std::size_t size = 0; size < whole.size(); size += 1 + whole.size() / 60) {
      std::string const name = std::string("cut") + format->extension;
      std::string const said = error_of([&] { gart::read_splats(folder.put(name, whole.substr(0, size))); });
      // What is cut at a record's end is whole in a format without a count.
      if (!(std::string(format->name) == "splat" && size > 0 && size % 32 == 0)) CHECK(holds(said, name));
    }
  }
}

TEST_CASE("a GLB is read where its nodes place it, or refused") {
  scratch_folder const folder;
  auto const model = random_model(20, 1);
  gart::write_splats(folder.path / "a.glb", model);
  auto const placed = [&](std::string const& node) {
    std::string text = text_of(folder.path / "a.glb");
    std::string const from = "{\"mesh\":0}";
    auto const at = text.find(from);
    REQUIRE(at != std::string::npos);
    std::string const to = "{\"mesh\":0," + node + "}";
    gart::u32 json = 0, whole = 0;
    std::memcpy(&whole, text.data() + 8, 4), std::memcpy(&json, text.data() + 12, 4);
    text.replace(at, from.size(), to);
    std::size_t const more = to.size() - from.size(), fill = (4 - more % 4) % 4;
    text.insert(20 + json + more, std::string(fill, ' '));
    json += static_cast<gart::u32>(more + fill), whole += static_cast<gart::u32>(more + fill);
    std::memcpy(text.data() + 8, &whole, 4), std::memcpy(text.data() + 12, &json, 4);
    return folder.put("b.glb", text);
  };
  // Up is -y of a splat file.
  auto const moved = gart::read_splats(placed("\"translation\":[0,3,0],\"scale\":[2,2,2]"));
  CHECK(moved.mean[1] == doctest::Approx(2 * model.mean[1] - 3));
  CHECK(moved.log_scale[0] == doctest::Approx(model.log_scale[0] + std::log(2.0f)));
  CHECK(moved.sh[5] == doctest::Approx(model.sh[5]));
  CHECK(holds(error_of([&] { gart::read_splats(placed("\"scale\":[2,1,1]")); }), "node 0"));
}

TEST_CASE("counts that a small file cannot hold are refused") {
  scratch_folder const folder;
  gart::write_splats(folder.path / "a.glb", random_model(4000, 0));
  std::string const whole = text_of(folder.path / "a.glb");
  auto const with_nodes = [&](std::string const& nodes, std::string const& first) {
    std::string text = whole;
    gart::u32 json = 0;
    std::memcpy(&json, text.data() + 12, 4);
    std::string part = text.substr(20, json);
    part.replace(part.find("\"nodes\":[{\"mesh\":0}]"), 20, "\"nodes\":[" + nodes + "]");
    part.replace(part.find("{\"nodes\":[0]}"), 13, "{\"nodes\":[" + first + "]}");
    part.resize((part.size() + 3) / 4 * 4, ' ');
    text = text.substr(0, 20) + part + text.substr(20 + json);
    gart::u32 const sizes[] = {static_cast<gart::u32>(text.size()), static_cast<gart::u32>(part.size())};
    std::memcpy(text.data() + 8, sizes, 8);
    return folder.put("b.glb", text);
  };
  // Each node names the next twice: 2^40 ways.
  std::string chain, many, all;
  for (int i = 0; i < 40; ++i) {
    std::string const next = std::to_string(i + 1);
    chain += "{\"children\":[" + next + "," + next + "]},";
  }
  auto const refused = [&](fs::path const& file) { return error_of([&] { gart::read_splats(file); }); };
  CHECK(holds(refused(with_nodes(chain + "{\"mesh\":0}", "0")), "is below two others, or itself"));
  CHECK(holds(refused(with_nodes("{\"children\":[0]}", "0")), "is below two others, or itself"));
  // One mesh, shown by many nodes.
  for (int i = 0; i < 3; ++i)
    many += std::string(i ? "," : "") + "{\"mesh\":0}", all += (i ? "," : "") + std::to_string(i);
  CHECK(gart::read_splats(with_nodes(many, all)).size() == 12000);
  for (int i = 3; i < 200; ++i) many += ",{\"mesh\":0}", all += "," + std::to_string(i);
  CHECK(holds(refused(with_nodes(many, all)), "more than its"));
}

}  // namespace
