#pragma once
// What readers of glTF 2.0 share (https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html). That is a file's JSON,
// and its buffers within a GLB, in the JSON as base64, or beside it. Also the nodes of its scene, and the numbers of
// accessors. A wrong type in the JSON is an exception of its library. Readers make it an error of the file. The library
// tinygltf 2.8 would not do. It reads a field of a wrong type as its default, and 2^32 as 0. It takes 1 GB for 1 MB of
// materials "{}". It reads past the end of a GLB whose last chunk is cut by up to 8 bytes.

#include <gart/core/error.hpp>
#include <gart/core/types.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace gart::io {

inline constexpr u32 glb_magic = 0x46546c67, glb_json_chunk = 0x4e4f534a, glb_binary_chunk = 0x004e4942;
inline constexpr char const* gltf_shapes[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};  // by width less one
enum gltf_component {
  gltf_i8 = 5120,
  gltf_u8 = 5121,
  gltf_i16 = 5122,
  gltf_u16 = 5123,
  gltf_u32 = 5125,
  gltf_f32 = 5126
};

class gltf_document {
 public:
  explicit gltf_document(std::filesystem::path const& path);

  nlohmann::json const& root() const { return root_; }
  std::string const& name() const { return name_; }
  // Of the file and of its buffers beside it, which are read.
  std::size_t all_bytes();
  [[noreturn]] void refuse(std::string const& what, std::string const& remedy = "export it again") const {
    throw io_error(name_, what, remedy);
  }

  // The bytes of a buffer view; `what` names their content.
  std::pair<u8 const*, std::size_t> view(nlohmann::json const& number, std::string const& what);
  // The data of a "uri", beside the file or within the text; `what` names its owner.
  std::vector<u8> uri_bytes(std::string const& uri, std::string const& what) const;
  // Its path, for errors; the file itself for data within.
  std::string uri_name(std::string const& uri) const;

  // How many elements an accessor has.
  std::size_t count(nlohmann::json const& number) const {
    return root_.at("accessors").at(number.get<std::size_t>()).at("count").get<std::size_t>();
  }
  // store(i, c, value) for the numbers of an accessor of n elements, `width` numbers each.
  void each(nlohmann::json const& number, std::string const& what, std::size_t n, std::size_t width,
            auto const& store) {
    accessor const a = accessor_of(number, what, n, width);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t c = 0; c < width; ++c)
        store(i, c, number_at(a.at + a.stride * i + a.size * c, a.type, a.normalized));
  }

  // here = visit(node, number, above) for each node of the file's scene, or of all where it has none: `above` is that
  // of the node above, at the top the one given.
  template <class Place>
  void each_node(Place const& above, auto const& visit) {
    if (root_.contains("scenes")) {
      auto const& scene = root_["scenes"].at(root_.value("scene", std::size_t{0}));
      if (scene.contains("nodes"))
        for (auto const& node : scene["nodes"]) each_below(node.get<std::size_t>(), above, 0, visit);
    } else if (root_.contains("nodes")) {
      for (std::size_t i = 0; i < root_["nodes"].size(); ++i)
        if (visited_.size() <= i || !visited_[i]) each_below(i, above, 0, visit);
    }
  }

 private:
  template <class Place>
  void each_below(std::size_t number, Place const& above, int depth, auto const& visit) {
    constexpr int deepest = 64;
    if (depth > deepest) refuse("has nodes within each other more than " + std::to_string(deepest) + " deep");
    nlohmann::json const& node = root_.at("nodes").at(number);
    // glTF's nodes are trees; in a graph that is no tree, paths can be as many as names.
    visited_.resize(root_["nodes"].size());
    if (visited_[number]) refuse("node " + std::to_string(number) + " is below two others, or itself");
    visited_[number] = true;
    Place const here = visit(node, number, above);
    if (node.contains("children"))
      for (auto const& child : node["children"]) each_below(child.get<std::size_t>(), here, depth + 1, visit);
  }

  struct accessor {
    u8 const* at;
    u64 stride;
    std::size_t size;
    int type;
    bool normalized;
  };
  accessor accessor_of(nlohmann::json const& number, std::string const& what, std::size_t n, std::size_t width);
  std::pair<u8 const*, std::size_t> buffer(std::size_t number, std::string const& what);

  static double number_at(u8 const* at, int type, bool normalized) {
    auto const as = [&](auto value, double most) {
      std::memcpy(&value, at, sizeof value);
      double const v = static_cast<double>(value);
      return normalized ? std::max(v / most, -1.0) : v;
    };
    switch (type) {
      case gltf_i8:
        return as(std::int8_t{}, 127);
      case gltf_u8:
        return as(u8{}, 255);
      case gltf_i16:
        return as(std::int16_t{}, 32767);
      case gltf_u16:
        return as(u16{}, 65535);
      case gltf_u32:
        return as(u32{}, 4294967295.0);
    }
    float value;
    std::memcpy(&value, at, sizeof value);
    return static_cast<double>(value);
  }

  std::string name_;
  std::filesystem::path folder_;
  std::vector<u8> bytes_;
  u8 const* binary_ = nullptr;  // of a GLB
  std::size_t binary_size_ = 0;
  nlohmann::json root_;
  std::vector<bool> visited_;             // nodes
  std::vector<std::vector<u8>> outside_;  // buffers with a "uri", once read
};

}  // namespace gart::io
