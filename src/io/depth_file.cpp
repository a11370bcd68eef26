// Depth maps: 16-bit PNG and NumPy's .npy (https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html).

#include "codec.hpp"

#include <gart/core/error.hpp>
#include <gart/io/depth_file.hpp>
#include <gart/io/file.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>
#include <string_view>

namespace gart {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "floats are copied as they lie in the file");

constexpr std::string_view npy_magic("\x93NUMPY", 6);

// What follows 'key': in the header's dictionary, up to the next comma that no bracket holds.
std::string_view field_of(std::string_view header, std::string_view key, std::string const& where) {
  std::size_t at = header.find("'" + std::string(key) + "'");
  if (at != std::string_view::npos) at = header.find(':', at);
  if (at == std::string_view::npos)
    throw io_error(where, "has no '" + std::string(key) + "' in its header", "save it with numpy.save");
  std::string_view rest = header.substr(at + 1);
  rest.remove_prefix(std::min(rest.find_first_not_of(' '), rest.size()));
  return rest.substr(0, rest.starts_with('(') ? rest.find(')') : rest.find_first_of(",}"));
}

// The sizes of "(480, 640".
std::vector<std::size_t> sizes_of(std::string_view text) {
  std::vector<std::size_t> sizes;
  std::size_t value = 0;
  bool digits = false;
  for (char const c : text) {
    if (c >= '0' && c <= '9' && value < 1'000'000) {
      value = 10 * value + static_cast<std::size_t>(c - '0'), digits = true;
    } else if (digits) {
      sizes.push_back(value), value = 0, digits = false;
    }
  }
  if (digits) sizes.push_back(value);
  return sizes;
}

image_float decode_npy(std::vector<u8> const& bytes, std::string const& where) {
  auto const byte = [&](std::size_t i) { return i < bytes.size() ? std::size_t{bytes[i]} : 0; };
  bool const wide = byte(6) >= 2;
  std::size_t const begin = wide ? 12 : 10;
  std::size_t const length = byte(8) | byte(9) << 8 | (wide ? byte(10) << 16 | byte(11) << 24 : 0);
  if (bytes.size() < begin || length > bytes.size() - begin)
    throw io_error(where, "is truncated: its header is not whole", "save it again");
  std::string_view const header(reinterpret_cast<char const*>(bytes.data()) + begin, length);
  if (field_of(header, "descr", where).substr(0, 5) != "'<f4'")
    throw io_error(where, "'descr' is not '<f4'", "save it as float32: numpy.save(file, map.astype('<f4'))");
  if (!field_of(header, "fortran_order", where).starts_with("False"))
    throw io_error(where, "'fortran_order' is not False", "save it in C order: numpy.ascontiguousarray(map)");
  auto const sizes = sizes_of(field_of(header, "shape", where));
  bool const flat = sizes.size() == 2 || (sizes.size() == 3 && sizes[2] == 1);
  if (!flat || sizes[0] < 1 || sizes[1] < 1)
    throw io_error(where, "'shape' is not (height, width)", "save one map of two dimensions");
  std::size_t const values = sizes[0] * sizes[1];
  if (bytes.size() - begin - length != 4 * values) {
    throw io_error(where,
                   "holds " + std::to_string(bytes.size() - begin - length) + " bytes of values where 'shape' needs " +
                       std::to_string(4 * values),
                   "save it again");
  }
  image_float map(static_cast<int>(sizes[1]), static_cast<int>(sizes[0]), 1);
  std::memcpy(map.data.data(), bytes.data() + begin + length, 4 * values);
  return map;
}

}  // namespace

image_float read_depth(fs::path const& path, double unit) {
  std::vector<u8> const bytes = read_file(path);
  std::string const where = path.string();
  image_float map;
  if (io::is_png(bytes)) {
    auto const steps = io::decode_png16(bytes, where);
    map = image_float(steps.width, steps.height, 1);
    double const step = unit != 0 ? unit : 0.001;
    for (std::size_t i = 0; i < steps.data.size(); ++i) map.data[i] = static_cast<float>(step * steps.data[i]);
  } else if (bytes.size() > npy_magic.size() && std::memcmp(bytes.data(), npy_magic.data(), npy_magic.size()) == 0) {
    map = decode_npy(bytes, where);
    if (unit != 0)
      for (float& d : map.data) d = static_cast<float>(unit * d);
  } else {
    throw io_error(where, "is neither a PNG nor a .npy file", "store depth as 16-bit PNG or as float32 .npy");
  }
  for (std::size_t i = 0; i < map.data.size(); ++i) {
    if (map.data[i] >= 0 && std::isfinite(map.data[i])) continue;
    auto const width = static_cast<std::size_t>(map.width);
    throw io_error(where,
                   "the depth at row " + std::to_string(i / width) + ", column " + std::to_string(i % width) + " is " +
                       (std::isfinite(map.data[i]) ? "negative" : "not finite"),
                   "write 0 where nothing was measured");
  }
  return map;
}

void write_depth_png(fs::path const& path, image_float const& map, double unit) {
  if (map.empty() || map.channels != 1 || !(unit > 0))
    throw invalid_argument("write_depth_png: needs a map of one channel that is not empty, and a positive unit");
  basic_image<u16> steps(map.width, map.height, 1);
  for (std::size_t i = 0; i < map.data.size(); ++i) {
    double const value = map.data[i] / unit;
    steps.data[i] = value > 0 ? static_cast<u16>(std::lround(std::min(value, 65535.0))) : u16{0};
  }
  write_file(path, io::encode_png16(steps));
}

void write_npy(fs::path const& path, image_float const& image) {
  if (image.empty()) throw invalid_argument("write_npy: the image is empty");
  std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (" + std::to_string(image.height) + ", " +
                       std::to_string(image.width) +
                       (image.channels > 1 ? ", " + std::to_string(image.channels) : std::string()) + "), }";
  header.append(63 - (10 + header.size()) % 64, ' ').push_back('\n');  // values begin at a multiple of 64
  std::string bytes(npy_magic);
  bytes += {'\x01', '\x00', static_cast<char>(header.size() & 255), static_cast<char>(header.size() >> 8)};
  bytes += header;
  bytes.append(reinterpret_cast<char const*>(image.data.data()), 4 * image.data.size());
  write_file(path, bytes);
}

}  // namespace gart
