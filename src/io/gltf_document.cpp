#include "gltf_document.hpp"

#include "bytes.hpp"

#include <gart/io/file.hpp>
#include <gart/io/json_fault.hpp>

#include <string_view>

namespace gart::io {
namespace {

using nlohmann::json;

constexpr char const* cut = "the file is truncated: copy or export it again";

int digit_of(char c, std::string_view digits) {
  auto const at = digits.find(c);
  return at == std::string_view::npos ? -1 : static_cast<int>(at);
}

// Up to the first character outside base64.
std::vector<u8> from_base64(std::string_view text) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<u8> out;
  out.reserve(text.size() / 4 * 3);
  u32 bits = 0, count = 0;
  for (char const c : text) {
    int const digit = digit_of(c, digits);
    if (digit < 0) break;
    bits = bits << 6 | static_cast<u32>(digit), count += 6;
    if (count >= 8) count -= 8, out.push_back(static_cast<u8>(bits >> count));
  }
  return out;
}

// "%20" is a space.
std::string decoded(std::string const& uri) {
  constexpr std::string_view digits = "0123456789abcdef", capitals = "0123456789ABCDEF";
  std::string out;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    auto const hex = [&](std::size_t at) {
      return at < uri.size() ? std::max(digit_of(uri[at], digits), digit_of(uri[at], capitals)) : -1;
    };
    if (uri[i] == '%' && hex(i + 1) >= 0 && hex(i + 2) >= 0)
      out.push_back(static_cast<char>(16 * hex(i + 1) + hex(i + 2))), i += 2;
    else
      out.push_back(uri[i]);
  }
  return out;
}

}  // namespace

gltf_document::gltf_document(std::filesystem::path const& path)
    : name_(path.string()), folder_(path.parent_path()), bytes_(read_file(path)) {
  byte_reader in(bytes_, name_);
  if (bytes_.empty()) refuse("is empty", cut);
  try {
    if (bytes_.size() < 4 || in.get<u32>("the magic number") != glb_magic) {
      root_ = json::parse(bytes_.begin(), bytes_.end());
      if (!root_.is_object()) refuse("is no JSON object", "name a glTF file");
      return;
    }
    u32 const version = in.get<u32>("version");
    if (version != 2) refuse("is GLB of version " + std::to_string(version), "gart reads version 2: export it as that");
    in.skip(4, "the length");
    bool known = false;
    while (in.remaining() >= 8) {
      u32 const size = in.get<u32>("a chunk"), type = in.get<u32>("a chunk");
      u8 const* const at = bytes_.data() + (bytes_.size() - in.remaining());
      in.skip(size, "a chunk");
      if (type == glb_json_chunk && !known) root_ = json::parse(at, at + size), known = true;
      if (type == glb_binary_chunk && !binary_) binary_ = at, binary_size_ = size;
    }
    if (!known || !root_.is_object()) refuse("has no JSON chunk");
  } catch (json::exception const& e) {
    throw io_error(name_ + ": glTF", json_fault_of(e.what()).what, "export it again");
  }
}

std::string gltf_document::uri_name(std::string const& uri) const {
  return uri.starts_with("data:") ? name_ : (folder_ / decoded(uri)).string();
}

std::vector<u8> gltf_document::uri_bytes(std::string const& uri, std::string const& what) const {
  if (uri.starts_with("data:")) {
    auto const comma = uri.find(',');
    if (comma == std::string::npos || std::string_view(uri).substr(0, comma).find(";base64") == std::string_view::npos)
      refuse(what + " has a data URI that is not base64");
    return from_base64(std::string_view(uri).substr(comma + 1));
  }
  std::string const file = decoded(uri);
  if (file.find("://") != std::string::npos || file.find('\0') != std::string::npos || file.starts_with('/'))
    refuse(what + " is at '" + file.substr(0, 60) + "'", "download it, and name it by a path beside the glTF file");
  if (!std::filesystem::is_regular_file(folder_ / file))
    refuse(what + " is in '" + file.substr(0, 200) + "', which is not there", "put it beside the glTF file");
  return read_file(folder_ / file);
}

std::size_t gltf_document::all_bytes() {
  std::size_t all = bytes_.size();
  if (root_.contains("buffers"))
    for (std::size_t i = 0; i < root_["buffers"].size(); ++i)
      if (root_["buffers"][i].contains("uri")) all += buffer(i, "a buffer").second;
  return all;
}

std::pair<u8 const*, std::size_t> gltf_document::buffer(std::size_t number, std::string const& what) {
  json const& all = root_.at("buffers");
  json const& one = all.at(number);
  if (!one.contains("uri")) {
    if (number != 0 || !binary_) refuse(what + " is in buffer " + std::to_string(number) + ", which is nowhere");
    return {binary_, binary_size_};
  }
  outside_.resize(all.size());
  if (outside_[number].empty())
    outside_[number] = uri_bytes(one["uri"].get<std::string>(), "buffer " + std::to_string(number));
  return {outside_[number].data(), outside_[number].size()};
}

std::pair<u8 const*, std::size_t> gltf_document::view(json const& number, std::string const& what) {
  json const& view = root_.at("bufferViews").at(number.get<std::size_t>());
  auto const [bytes, size] = buffer(view.value("buffer", std::size_t{0}), what);
  u64 const start = view.value("byteOffset", u64{0}), length = view.at("byteLength").get<u64>();
  if (start > size || length > size - start) refuse(what + " reaches past the end of the file's buffer", cut);
  return {bytes + start, length};
}

gltf_document::accessor gltf_document::accessor_of(json const& number, std::string const& what, std::size_t n,
                                                   std::size_t width) {
  json const& a = root_.at("accessors").at(number.get<std::size_t>());
  accessor out{nullptr, 0, 0, a.at("componentType").get<int>(), a.value("normalized", false)};
  if (a.at("type") != gltf_shapes[width - 1] || a.at("count").get<std::size_t>() != n || a.contains("sparse") ||
      !a.contains("bufferView"))
    refuse(what + " is not " + std::to_string(n) + " " + gltf_shapes[width - 1] + " of a buffer");
  switch (out.type) {
    case gltf_i8:
    case gltf_u8:
      out.size = 1;
      break;
    case gltf_i16:
    case gltf_u16:
      out.size = 2;
      break;
    case gltf_u32:
    case gltf_f32:
      out.size = 4;
      break;
    default:
      refuse(what + " is of the component type " + std::to_string(out.type));
  }
  json const& view = root_.at("bufferViews").at(a["bufferView"].get<std::size_t>());
  auto const [bytes, size] = buffer(view.value("buffer", std::size_t{0}), what);
  u64 const in_view = a.value("byteOffset", u64{0}), start = view.value("byteOffset", u64{0}), whole = out.size * width;
  out.stride = view.value("byteStride", whole);
  if (out.stride < whole || out.stride > 255 || start > size || in_view > size - start ||
      (n > 0 && (size - start - in_view < whole || (n - 1) > (size - start - in_view - whole) / out.stride)))
    refuse(what + " reaches past the end of the file's buffer", cut);
  out.at = bytes + start + in_view;
  return out;
}

}  // namespace gart::io
