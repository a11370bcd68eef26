// SPZ, versions 1 to 4 read, 4 written, and 2 for GLB. Streams of fixed-point numbers. The first three versions have
// them one after the other in a gzip file. The fourth has each in a frame of zstd. Axes: x right, y up, z back.
// https://github.com/nianticlabs/spz

#include "spz.hpp"
#include "bulk.hpp"
#include "bytes.hpp"
#include "compression.hpp"
#include "packing.hpp"

#include <gart/io/file.hpp>
#include <gart/io/origin.hpp>
#include <gart/io/splat_file.hpp>

#include <ostream>

namespace gart {
namespace {

using namespace io;
namespace fs = std::filesystem;

constexpr u32 magic = 0x5053474e;  // "NGSP"
constexpr u8 flag_antialiased = 1, flag_extensions = 2;
constexpr u32 coordinates_extension = 0xadbe0003;
constexpr u32 origin_extension = 0x67610001;  // gart's own: three doubles, in a splat file's axes
constexpr u32 right_up_back = 4;
constexpr double color_scale = 0.15;
constexpr double half_root = 0.70710678118654752440;

struct header {
  u32 version = 4, count = 0;
  u8 degree = 0, fraction = 0, flags = 0;
};

enum stream { positions, opacities, colors, scales, rotations, harmonics, streams };

// Bytes a Gaussian.
std::array<std::size_t, streams> widths(header const& h) {
  std::size_t const rest = 3 * static_cast<std::size_t>(sh_coefficients(h.degree) - 1);
  return {h.version == 1 ? 6u : 9u, 1, 3, 3, h.version < 3 ? 3u : 4u, rest};
}

// Three of a unit quaternion's components in 10 bits each, a sign and a magnitude. The top two bits say which is the
// fourth. The order is x, y, z, w.
u32 pack_rotation(float const* wxyz) {
  std::array<double, 4> q = unit(wxyz);
  q = {q[1], q[2], q[3], q[0]};
  int const largest = largest_positive(q);
  u32 packed = static_cast<u32>(largest);
  for (int k = 0; k < 4; ++k) {
    if (k == largest) continue;
    double const v = q[static_cast<std::size_t>(k)];
    packed = packed << 10 | (v < 0 ? 512u : 0u) | unorm(std::abs(v) / half_root, 9);
  }
  return packed;
}

void unpack_rotation(u32 packed, float* wxyz) {
  std::array<double, 4> q{};
  std::size_t const largest = packed >> 30;
  double rest = 1;
  for (std::size_t k = 4; k-- > 0;) {
    if (k == largest) continue;
    double const size = half_root * static_cast<double>(packed & 511) / 511;
    q[k] = packed & 512 ? -size : size;
    rest -= size * size;
    packed >>= 10;
  }
  q[largest] = std::sqrt(std::max(0.0, rest));
  for (std::size_t k = 0; k < 4; ++k) wxyz[k] = static_cast<float>(q[(k + 3) % 4]);
}

void unpack_first_three(u8 const* bytes, float* wxyz) {
  double rest = 1;
  for (std::size_t k = 0; k < 3; ++k) {
    double const v = bytes[k] / 127.5 - 1;
    wxyz[k + 1] = static_cast<float>(v), rest -= v * v;
  }
  wxyz[0] = static_cast<float>(std::sqrt(std::max(0.0, rest)));
}

// x, y and z of a unit quaternion whose w is not negative.
void pack_first_three(float const* wxyz, u8* bytes) {
  std::array<double, 4> const q = unit(wxyz);
  for (std::size_t k = 0; k < 3; ++k)
    bytes[k] = static_cast<u8>(std::clamp(std::round((q[0] < 0 ? -q[k + 1] : q[k + 1]) * 127.5 + 127.5), 0.0, 255.0));
}

// The nearest multiple of the step that `bits` bits leave of 8; 0 is one of them.
u8 pack_coefficient(float x, int bits) {
  int const step = 1 << (8 - bits);
  double const level = std::round(static_cast<double>(x) * 128 / step) * step + 128;
  return static_cast<u8>(std::clamp(level, 0.0, 255.0));
}

gaussian_model unpacked(header const& h, std::array<u8 const*, streams> const& s) {
  gaussian_model m;
  m.resize(h.count, h.degree);
  auto const width = widths(h);
  std::size_t const k = static_cast<std::size_t>(sh_coefficients(h.degree)), rest = 3 * (k - 1);
  in_parts(h.count, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        u8 const* p = s[positions] + width[positions] * i + width[positions] / 3 * c;
        if (h.version == 1) {
          m.mean[3 * i + c] = from_half(static_cast<u16>(p[0] | p[1] << 8));
        } else {
          u32 const fixed = u32{p[0]} << 8 | u32{p[1]} << 16 | u32{p[2]} << 24;  // the sign at the top
          m.mean[3 * i + c] =
              static_cast<float>(std::ldexp(static_cast<double>(static_cast<std::int32_t>(fixed) >> 8), -h.fraction));
        }
        m.log_scale[3 * i + c] = static_cast<float>(s[scales][3 * i + c] / 16.0 - 10);
        m.sh[3 * k * i + c] = static_cast<float>((s[colors][3 * i + c] / 255.0 - 0.5) / color_scale);
      }
      u8 const* r = s[rotations] + width[rotations] * i;
      if (h.version < 3)
        unpack_first_three(r, &m.quaternion[4 * i]);
      else
        unpack_rotation(u32{r[0]} | u32{r[1]} << 8 | u32{r[2]} << 16 | u32{r[3]} << 24, &m.quaternion[4 * i]);
      m.opacity[i] = opacity_logit(s[opacities][i]);
      for (std::size_t j = 0; j < rest; ++j)
        m.sh[3 * k * i + 3 + j] = static_cast<float>(s[harmonics][rest * i + j] - 128) / 128;
    }
  });
  return m;
}

class spz_reader {
 public:
  spz_reader(std::vector<u8> bytes, std::string name) : name_(std::move(name)), bytes_(std::move(bytes)) {}

  gaussian_model read(splat_traits* traits, std::vector<std::string>* notes) {
    bool const gzip = bytes_.size() >= 2 && bytes_[0] == 0x1f && bytes_[1] == 0x8b;
    gaussian_model m = gzip ? from_gzip() : from_zstd();
    keep_usable(name_, m, notes);
    half_turn(m, 0);
    if (traits && head_.flags & flag_antialiased) (*traits)["antialias"] = "";
    if (traits) *traits = with_origin(std::move(*traits), origin_);
    return m;
  }

 private:
  [[noreturn]] void refuse(std::string const& what, std::string const& remedy) const {
    throw io_error(name_, what, remedy);
  }

  void read_header(byte_reader& in) {
    if (in.get<u32>("the magic number") != magic) refuse("does not begin as SPZ does", "name an SPZ file");
    head_.version = in.get<u32>("version");
    head_.count = in.get<u32>("the number of Gaussians");
    head_.degree = in.get<u8>("the SH degree");
    head_.fraction = in.get<u8>("the bits of a fraction");
    head_.flags = in.get<u8>("flags");
    if (head_.version < 1 || head_.version > 4)
      refuse("is of version " + std::to_string(head_.version), "gart reads versions 1 to 4: export it as one of them");
    if (head_.degree > 3)
      refuse("has spherical harmonics of degree " + std::to_string(head_.degree),
             "gart reads degrees 0 to 3: export the model with one of them");
    if (head_.fraction > 63) refuse("the bits of a fraction are " + std::to_string(head_.fraction), "export it again");
    require_plausible(name_, head_.count, head_.degree, bytes_.size());
  }

  gaussian_model from_gzip() {
    std::vector<u8> const start = inflated(bytes_.data(), bytes_.size(), gzip_window, 16, name_);
    byte_reader in(start, name_);
    read_header(in);
    if (head_.version == 4) refuse("is of version 4 within gzip", "export it again");
    auto const width = widths(head_);
    std::size_t a_gaussian = 0;
    for (std::size_t const w : width) a_gaussian += w;
    std::size_t const size = 16 + a_gaussian * head_.count;
    std::vector<u8> const all = inflated(bytes_.data(), bytes_.size(), gzip_window, size, name_);
    if (all.size() < size)
      refuse("ends within its " + std::to_string(head_.count) + " Gaussians",
             "the file is truncated: copy or export it again");
    if (head_.flags & flag_extensions) {
      std::vector<u8> const whole = inflated(bytes_.data(), bytes_.size(), gzip_window, size + 4096, name_);
      read_extensions({whole.begin() + static_cast<std::ptrdiff_t>(size), whole.end()});
    }
    std::array<u8 const*, streams> at;
    u8 const* p = all.data() + 16;
    for (std::size_t i = 0; i < streams; p += width[i] * head_.count, ++i) at[i] = p;
    return unpacked(head_, at);
  }

  gaussian_model from_zstd() {
    byte_reader in(bytes_, name_);
    read_header(in);
    if (head_.version != 4)
      refuse("is of version " + std::to_string(head_.version) + " without gzip", "export it again");
    u8 const number = in.get<u8>("the number of streams");
    u32 const contents = in.get<u32>("the place of the table of contents");
    auto const width = widths(head_);
    if (contents < 32 || contents > bytes_.size() || bytes_.size() - contents < 16u * number)
      refuse("the table of contents is not within the file", "the file is truncated: copy or export it again");
    if (head_.flags & flag_extensions) read_extensions({bytes_.begin() + 32, bytes_.begin() + contents});
    in.skip(contents - 20, "the table of contents");
    std::array<std::vector<u8>, streams> unpacked_streams;
    u64 at = contents + 16u * number;
    unsigned seen = 0;
    for (std::size_t i = 0; i < streams; ++i) {
      std::size_t const size = width[i] * head_.count;
      if (!size) continue;
      if (seen++ == number) refuse("has " + std::to_string(number) + " streams, too few", "export it again");
      u64 const packed = in.get<u64>("the size of a stream"), whole = in.get<u64>("the size of a stream");
      if (whole != size)
        refuse("stream " + std::to_string(i) + " is of another size than its Gaussians", "export it again");
      if (packed > bytes_.size() - at)
        refuse("ends within stream " + std::to_string(i), "the file is truncated: copy or export it again");
      unpacked_streams[i] = zstd_decompressed(bytes_.data() + at, packed, size, name_);
      at += packed;
    }
    std::array<u8 const*, streams> from;
    for (std::size_t i = 0; i < streams; ++i) from[i] = unpacked_streams[i].data();
    return unpacked(head_, from);
  }

  // Records of a type, a length and as many bytes. One that says that the axes are others is refused, the rest is not
  // about the Gaussians.
  void read_extensions(std::vector<u8> const& records) {
    byte_reader in(records, name_);
    while (in.remaining() >= 8) {
      u32 const type = in.get<u32>("an extension"), size = in.get<u32>("an extension");
      if (type == coordinates_extension && size >= 4 && in.remaining() >= 4) {
        u32 const axes = in.get<u32>("the axes");
        if (axes != 0 && axes != right_up_back)
          refuse("keeps other axes than right, up, back (extension SPZ_ADOBE_coordinate_system says " +
                     std::to_string(axes) + ")",
                 "export it without that extension");
        in.skip(size - 4, "an extension");
      } else if (type == origin_extension && size == 24 && in.remaining() >= 24) {
        for (int k = 0; k < 3; ++k) origin_[k] = in.get<double>("the origin");
        if (!(glm::length(origin_) <= 1e18)) refuse("has an origin that is not finite", "export it again");
      } else {
        in.skip(std::min<u64>(size, in.remaining()), "an extension");
      }
    }
  }

  std::string name_;
  std::vector<u8> bytes_;
  header head_;
  vec3d origin_{0.0};
};

// The most bits of fraction, up to 20, with which every position is in the 24 there are.
int fraction_bits(fs::path const& path, gaussian_model const& m) {
  double extent = 0;
  for (float const v : m.mean) extent = std::max(extent, std::abs(static_cast<double>(v)));
  int bits = 20;
  while (bits >= 0 && std::ldexp(extent, bits) > 8388607.0) --bits;
  if (bits < 0)
    throw io_error(path.string(), "SPZ has no room for positions of " + std::to_string(extent) + ", past 8,388,607",
                   "scale the model down");
  return bits;
}

struct packed_model {
  header h;
  std::array<std::vector<u8>, streams> s;
};

packed_model packed(u32 version, fs::path const& path, gaussian_model const& given, splat_traits const& traits,
                    splat_packing const& packing) {
  require_packable(path, given);
  gaussian_model m = selected(given, along_a_curve(given));
  draw_in_strays(m, far_reach);
  packed_model out;
  header& h = out.h;
  h.version = version;
  h.count = static_cast<u32>(m.size()), h.degree = static_cast<u8>(m.sh_degree);
  h.fraction = static_cast<u8>(fraction_bits(path, m));
  h.flags = traits.count("antialias") ? flag_antialiased : u8{0};
  auto const width = widths(h);
  auto& s = out.s;
  for (std::size_t i = 0; i < streams; ++i) s[i].resize(width[i] * m.size());
  std::size_t const k = static_cast<std::size_t>(sh_coefficients(m.sh_degree)), rest = 3 * (k - 1);
  // Applies half a turn about x (half_turn) on the way.
  gaussian_model one;
  one.resize(1, m.sh_degree);
  std::fill(one.mean.begin(), one.mean.end(), 1.0f);
  std::fill(one.quaternion.begin(), one.quaternion.end(), 1.0f);
  std::fill(one.sh.begin(), one.sh.end(), 1.0f);
  half_turn(one, 0);
  in_parts(m.size(), [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        auto const fixed =
            static_cast<u32>(std::lround(std::ldexp(static_cast<double>(m.mean[3 * i + c] * one.mean[c]), h.fraction)));
        for (std::size_t b = 0; b < 3; ++b) s[positions][9 * i + 3 * c + b] = static_cast<u8>(fixed >> 8 * b);
        s[scales][3 * i + c] = static_cast<u8>(
            std::clamp(std::round((static_cast<double>(m.log_scale[3 * i + c]) + 10) * 16), 0.0, 255.0));
        s[colors][3 * i + c] = static_cast<u8>(unorm(static_cast<double>(m.sh[3 * k * i + c]) * color_scale + 0.5, 8));
      }
      float q[4];
      for (std::size_t c = 0; c < 4; ++c) q[c] = m.quaternion[4 * i + c] * one.quaternion[c];
      if (version < 3) {
        pack_first_three(q, &s[rotations][3 * i]);
      } else {
        u32 const r = pack_rotation(q);
        for (std::size_t b = 0; b < 4; ++b) s[rotations][4 * i + b] = static_cast<u8>(r >> 8 * b);
      }
      s[opacities][i] = opacity_byte(m.opacity[i]);
      for (std::size_t j = 0; j < rest; ++j)
        s[harmonics][rest * i + j] =
            pack_coefficient(m.sh[3 * k * i + 3 + j] * one.sh[3 + j], j < 9 ? packing.sh1_bits : packing.sh_bits);
    }
  });
  return out;
}

// What begins all versions' headers.
std::string head_of(header const& h, std::size_t last) {
  std::string head;
  put(head, magic);
  put(head, h.version);
  put(head, h.count);
  for (u8 const byte : {h.degree, h.fraction, h.flags, static_cast<u8>(last)}) put(head, byte);
  return head;
}

void write_spz(fs::path const& path, gaussian_model const& given, splat_traits const& traits,
               splat_packing const& packing) {
  auto [h, s] = packed(4, path, given, traits, packing);
  std::vector<std::vector<u8>> frames;
  std::string contents, extensions;
  if (vec3d const origin = origin_of(traits, path.string()); origin != vec3d(0.0)) {
    h.flags |= flag_extensions;
    put(extensions, origin_extension);
    put(extensions, u32{24});
    for (int k = 0; k < 3; ++k) put(extensions, origin[k]);
  }
  for (auto const& stream : s) {
    if (stream.empty()) continue;
    frames.push_back(zstd_compressed(stream, path.string()));
    put(contents, u64{frames.back().size()});
    put(contents, u64{stream.size()});
  }
  std::string head = head_of(h, frames.size());
  put(head, static_cast<u32>(32 + extensions.size()));
  head.resize(32, '\0');
  head += extensions;
  write_file(path, [&](std::ostream& out) {
    out << head << contents;
    for (auto const& frame : frames)
      out.write(reinterpret_cast<char const*>(frame.data()), static_cast<std::streamsize>(frame.size()));
  });
}

}  // namespace

std::vector<u8> io::spz_2(fs::path const& path, gaussian_model const& model, splat_traits const& traits,
                          splat_packing const& packing) {
  auto const [h, s] = packed(2, path, model, traits, packing);
  std::string const head = head_of(h, 0);
  std::vector<u8> all(head.begin(), head.end());
  for (auto const& stream : s) all.insert(all.end(), stream.begin(), stream.end());
  return gzipped(all, path.string());
}

gaussian_model io::read_spz(std::vector<u8> bytes, std::string const& name, splat_traits* traits,
                            std::vector<std::string>* notes) {
  return spz_reader(std::move(bytes), name).read(traits, notes);
}

extern splat_format const spz_format;
splat_format const spz_format = {
    "SPZ",
    ".spz",
    {.strays = false, .antialias = true, .origin = true},
    [](std::string_view first) { return first.starts_with("NGSP") || first.starts_with("\x1f\x8b\x08"); },
    [](fs::path const& path, splat_traits* traits, std::vector<std::string>* notes) {
      return read_spz(read_file(path), path.string(), traits, notes);
    },
    write_spz};

}  // namespace gart
