// PlayCanvas' compressed PLY: Gaussians in chunks of 256. Each number is a share of a 32-bit word between the chunk's
// least and greatest. Spherical harmonics take a byte each, from -4 to 4. https://github.com/playcanvas/splat-transform

#include "bulk.hpp"
#include "bytes.hpp"
#include "packing.hpp"
#include "ply_header.hpp"

#include <gart/io/file.hpp>
#include <gart/io/ply.hpp>

#include <ostream>

namespace gart {

extern splat_format const ply_format;

namespace {

using namespace io;
using namespace io::ply;
namespace fs = std::filesystem;

constexpr std::size_t chunk_size = 256;
constexpr double chunk_reach = 2;  // of strays, as 255 others share their chunk's 11 bits
constexpr float scale_limit = 20;  // logarithms beyond are none of a Gaussian that anyone sees
constexpr double half_root = 0.70710678118654752440;

// A chunk's least and greatest: x y z, scales, colours, in the file's order.
constexpr char const* chunk_columns[] = {
    "min_x",       "min_y",       "min_z",       "max_x", "max_y", "max_z", "min_scale_x", "min_scale_y", "min_scale_z",
    "max_scale_x", "max_scale_y", "max_scale_z", "min_r", "min_g", "min_b", "max_r",       "max_g",       "max_b"};
constexpr char const* vertex_columns[] = {"packed_position", "packed_rotation", "packed_scale", "packed_color"};
using chunk_bounds = std::array<float, 18>;

constexpr int xyz_bits[] = {11, 10, 11};

u32 pack_3(float const* v, float const* low, float const* high) {
  u32 packed = 0;
  for (int c = 0; c < 3; ++c) packed = packed << xyz_bits[c] | between(v[c], low[c], high[c], xyz_bits[c]);
  return packed;
}

void unpack_3(u32 packed, float const* low, float const* high, float* v) {
  for (int c = 3; c-- > 0;) {
    v[c] = from_between(packed & ((1u << xyz_bits[c]) - 1), low[c], high[c], xyz_bits[c]);
    packed >>= xyz_bits[c];
  }
}

// Three of w, x, y, z from -sqrt(1/2) to sqrt(1/2) in 10 bits each, and which is the fourth.
u32 pack_rotation(float const* wxyz) {
  std::array<double, 4> q = unit(wxyz);
  int const largest = largest_positive(q);
  u32 packed = static_cast<u32>(largest);
  for (int k = 0; k < 4; ++k)
    if (k != largest) packed = packed << 10 | unorm(q[static_cast<std::size_t>(k)] * half_root + 0.5, 10);
  return packed;
}

void unpack_rotation(u32 packed, float* wxyz) {
  std::size_t const largest = packed >> 30;
  double rest = 1;
  for (std::size_t k = 4; k-- > 0;) {
    if (k == largest) continue;
    double const v = (static_cast<double>(packed & 1023) / 1023 - 0.5) / half_root;
    wxyz[k] = static_cast<float>(v), rest -= v * v;
    packed >>= 10;
  }
  wxyz[largest] = static_cast<float>(std::sqrt(std::max(0.0, rest)));
}

u8 pack_coefficient(float x) {
  return static_cast<u8>(std::clamp((static_cast<double>(x) / 8 + 0.5) * 256, 0.0, 255.0));
}
float unpack_coefficient(u8 b) {
  double const level = b == 0 ? 0 : b == 255 ? 1 : (b + 0.5) / 256;
  return static_cast<float>((level - 0.5) * 8);
}

// The records of one element of fixed size, and the place of each property.
struct records {
  element const& of;
  u8 const* bytes;
  std::size_t width;

  template <class T>
  T get(std::size_t record, std::size_t offset) const {
    T value;
    std::memcpy(&value, bytes + record * width + offset, sizeof value);
    return value;
  }
};

class compressed_reader {
 public:
  explicit compressed_reader(fs::path const& path) : file_(open(path)) {}

  gaussian_model read(splat_traits* traits, std::vector<std::string>* notes) {
    if (file_.head.format != encoding::little)
      file_.refuse("is a compressed PLY that is not little-endian", "export it again");
    records const chunks = find("chunk"), vertices = find("vertex");
    std::size_t const n = vertices.of.count;
    require_plausible(file_.name, n, degree(), file_.bytes.size());
    if (chunks.of.count != (n + chunk_size - 1) / chunk_size)
      file_.refuse("has " + std::to_string(chunks.of.count) + " chunks for " + std::to_string(n) + " Gaussians",
                   "a chunk has 256 of them: export it again");
    gaussian_model m;
    bool const colored = has(chunks.of, "min_r");
    std::vector<std::size_t> bounds, packed;
    for (char const* name : chunk_columns)
      if (colored || bounds.size() < 12) bounds.push_back(offset(chunks.of, name, scalar::f32));
    for (char const* name : vertex_columns) packed.push_back(offset(vertices.of, name, scalar::u32));
    m.resize(n, degree());
    std::size_t const k = static_cast<std::size_t>(sh_coefficients(m.sh_degree)), rest = k - 1;
    for (std::size_t i = 0; i < n; ++i) {
      chunk_bounds b{};
      std::fill(b.begin() + 15, b.end(), 1.0f);
      for (std::size_t c = 0; c < bounds.size(); ++c) b[c] = chunks.get<float>(i / chunk_size, bounds[c]);
      unpack_3(vertices.get<u32>(i, packed[0]), &b[0], &b[3], &m.mean[3 * i]);
      unpack_rotation(vertices.get<u32>(i, packed[1]), &m.quaternion[4 * i]);
      unpack_3(vertices.get<u32>(i, packed[2]), &b[6], &b[9], &m.log_scale[3 * i]);
      u32 const color = vertices.get<u32>(i, packed[3]);
      for (std::size_t c = 0; c < 3; ++c)
        m.sh[3 * k * i + c] =
            base_coefficient(static_cast<double>(from_between(color >> (24 - 8 * c) & 255, b[12 + c], b[15 + c], 8)));
      m.opacity[i] = opacity_logit(static_cast<u8>(color));
    }
    if (rest) {
      records const harmonics = find("sh");
      if (harmonics.of.count != n) file_.refuse("element sh is of another number of Gaussians", "export it again");
      std::vector<std::size_t> at;
      for (std::size_t j = 0; j < 3 * rest; ++j)
        at.push_back(offset(harmonics.of, "f_rest_" + std::to_string(j), scalar::u8));
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = 0; j < 3 * rest; ++j)
          m.sh[3 * (k * i + 1 + j % rest) + j / rest] = unpack_coefficient(harmonics.get<u8>(i, at[j]));
    }
    keep_usable(file_.name, m, notes);
    if (traits) *traits = file_.head.traits;
    return m;
  }

 private:
  static bool has(element const& e, std::string const& name) {
    return std::any_of(e.properties.begin(), e.properties.end(), [&](property const& p) { return p.name == name; });
  }

  int degree() const {
    for (element const& e : file_.head.elements) {
      if (e.name != "sh") continue;
      for (int d = 1; d <= 3; ++d)
        if (e.properties.size() == 3 * static_cast<std::size_t>(sh_coefficients(d) - 1)) return d;
      file_.refuse("element sh has " + std::to_string(e.properties.size()) + " properties, not 9, 24 or 45",
                   "export the model with spherical harmonics of degree 0 to 3");
    }
    return 0;
  }

  records find(std::string const& name) const {
    u64 at = file_.head.size;
    for (element const& e : file_.head.elements) {
      for (property const& p : e.properties)
        if (p.list) file_.refuse("element " + e.name + " has a list, property " + p.name, "export it again");
      u64 const width = e.smallest(encoding::little);
      require_room(file_, e, file_.bytes.size() - at);
      if (e.name == name) return {e, file_.bytes.data() + at, static_cast<std::size_t>(width)};
      at += width * e.count;
    }
    file_.refuse("the header has no 'element " + name + "'", "export it again");
  }

  std::size_t offset(element const& e, std::string const& name, scalar type) const {
    std::size_t at = 0;
    for (property const& p : e.properties) {
      if (p.name == name && p.type == type) return at;
      at += scalar_size(p.type);
    }
    file_.refuse("element " + e.name + " has no property " + name + " of the type that belongs there",
                 "export it again");
  }

  ply_file file_;
};

void widen(float const* v, float* low, float* high, bool first) {
  for (int c = 0; c < 3; ++c) {
    low[c] = first ? v[c] : std::min(low[c], v[c]);
    high[c] = first ? v[c] : std::max(high[c], v[c]);
  }
}

void write_compressed(fs::path const& path, gaussian_model const& given, splat_traits const& traits,
                      splat_packing const&) {
  require_packable(path, given);
  gaussian_model m = selected(given, along_a_curve(given));
  draw_in_strays(m, chunk_reach);
  for (float& s : m.log_scale) s = std::clamp(s, -scale_limit, scale_limit);
  std::size_t const n = m.size(), chunks = (n + chunk_size - 1) / chunk_size;
  std::size_t const k = static_cast<std::size_t>(sh_coefficients(m.sh_degree)), rest = k - 1;
  std::string text = header_start(path, traits);
  text += "element chunk " + std::to_string(chunks) + "\n";
  for (char const* name : chunk_columns) text += std::string("property float ") + name + "\n";
  text += "element vertex " + std::to_string(n) + "\n";
  for (char const* name : vertex_columns) text += std::string("property uint ") + name + "\n";
  if (rest) text += "element sh " + std::to_string(n) + "\n";
  for (std::size_t j = 0; j < 3 * rest; ++j) text += "property uchar f_rest_" + std::to_string(j) + "\n";
  text += "end_header\n";

  std::vector<chunk_bounds> bounds(chunks);
  std::vector<u32> words(4 * n);
  std::vector<u8> bytes(3 * rest * n);
  in_parts(chunks, [&](std::size_t first, std::size_t last) {
    for (std::size_t chunk = first; chunk < last; ++chunk) {
      chunk_bounds& b = bounds[chunk];
      std::size_t const begin = chunk * chunk_size, end = std::min(n, begin + chunk_size);
      std::array<float, 3> color{};
      auto const color_of = [&](std::size_t i) {
        for (std::size_t c = 0; c < 3; ++c) color[c] = base_color(m.sh[3 * k * i + c]);
        return color.data();
      };
      for (std::size_t i = begin; i < end; ++i) {
        widen(&m.mean[3 * i], &b[0], &b[3], i == begin);
        widen(&m.log_scale[3 * i], &b[6], &b[9], i == begin);
        widen(color_of(i), &b[12], &b[15], i == begin);
      }
      for (std::size_t i = begin; i < end; ++i) {
        words[4 * i] = pack_3(&m.mean[3 * i], &b[0], &b[3]);
        words[4 * i + 1] = pack_rotation(&m.quaternion[4 * i]);
        words[4 * i + 2] = pack_3(&m.log_scale[3 * i], &b[6], &b[9]);
        u32 packed = 0;
        color_of(i);
        for (std::size_t c = 0; c < 3; ++c) packed = packed << 8 | between(color[c], b[12 + c], b[15 + c], 8);
        words[4 * i + 3] = packed << 8 | opacity_byte(m.opacity[i]);
        for (std::size_t j = 0; j < 3 * rest; ++j)
          bytes[3 * rest * i + j] = pack_coefficient(m.sh[3 * (k * i + 1 + j % rest) + j / rest]);
      }
    }
  });
  write_file(path, [&](std::ostream& out) {
    auto const put_all = [&](auto const& values) {
      out.write(reinterpret_cast<char const*>(values.data()),
                static_cast<std::streamsize>(values.size() * sizeof values[0]));
    };
    out << text;
    put_all(bounds), put_all(words), put_all(bytes);
  });
}

}  // namespace

extern splat_format const compressed_ply_format;
splat_format const compressed_ply_format = {
    "compressed PLY",
    ".compressed.ply",
    {.strays = false, .traits = true, .kernel = true},
    [](std::string_view first) {
      return ply_format.begins(first) && first.find("\nelement chunk ") != std::string_view::npos;
    },
    [](fs::path const& path, splat_traits* traits, std::vector<std::string>* notes) {
      return compressed_reader(path).read(traits, notes);
    },
    write_compressed};

}  // namespace gart
