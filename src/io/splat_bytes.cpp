// The .splat files of antimatter15's viewer: 32 bytes a Gaussian. Position and scale are floats; colour, opacity and
// rotation are bytes. There are no spherical harmonics and no header. https://github.com/antimatter15/splat

#include "bytes.hpp"
#include "packing.hpp"

#include <gart/io/file.hpp>
#include <gart/io/splat_file.hpp>

namespace gart {
namespace {

using namespace io;
namespace fs = std::filesystem;

constexpr std::size_t record = 32;

gaussian_model read_splat_bytes(fs::path const& path, splat_traits*, std::vector<std::string>* notes) {
  std::string const name = path.string();
  std::vector<u8> const bytes = read_file(path);
  if (bytes.empty() || bytes.size() % record)
    throw io_error(name, "has " + std::to_string(bytes.size()) + " bytes, no multiple of the 32 of a Gaussian",
                   "the file is truncated, or in another format than its name says");
  gaussian_model m;
  m.resize(bytes.size() / record, 0);
  byte_reader in(bytes, name);
  for (std::size_t i = 0; i < m.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) m.mean[3 * i + c] = in.get<float>("a position");
    for (std::size_t c = 0; c < 3; ++c) {
      float const scale = in.get<float>("a scale");
      m.log_scale[3 * i + c] = std::log(scale);  // not finite for a vector without length
    }
    for (std::size_t c = 0; c < 3; ++c) m.sh[3 * i + c] = base_coefficient(in.get<u8>("a colour") / 255.0);
    m.opacity[i] = opacity_logit(in.get<u8>("an opacity"));
    bool turned = false;
    for (std::size_t c = 0; c < 4; ++c) {
      m.quaternion[4 * i + c] = static_cast<float>(in.get<u8>("a rotation") - 128) / 128;
      turned = turned || m.quaternion[4 * i + c] != 0;
    }
    if (!turned) m.quaternion[4 * i] = 1;  // what writers leave of a rotation that was none
  }
  keep_usable(name, m, notes);
  return m;
}

void write_splat_bytes(fs::path const& path, gaussian_model const& m, splat_traits const&, splat_packing const&) {
  require_packable(path, m);
  if (m.size() == 0) throw io_error(path.string(), ".splat has no way to say that there is no Gaussian", "keep some");
  std::string text;
  text.reserve(record * m.size());
  for (std::size_t i = 0; i < m.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) put(text, m.mean[3 * i + c]);
    for (std::size_t c = 0; c < 3; ++c) put(text, std::exp(std::min(m.log_scale[3 * i + c], 80.0f)));
    for (std::size_t c = 0; c < 3; ++c)
      put(text, static_cast<u8>(unorm(static_cast<double>(base_color(m.sh[3 * i + c])), 8)));
    put(text, opacity_byte(m.opacity[i]));
    for (double const v : unit(&m.quaternion[4 * i]))
      put(text, static_cast<u8>(std::clamp(std::round(v * 128) + 128, 0.0, 255.0)));
  }
  write_file(path, text);
}

}  // namespace

extern splat_format const splat_bytes_format;
splat_format const splat_bytes_format = {"splat", ".splat",         {.sh_degree = 0},
                                         nullptr, read_splat_bytes, write_splat_bytes};

}  // namespace gart
