#pragma once
// The body of a PLY: the values of its vertices by their properties' names, whatever the order, encoding and types.

#include "bytes.hpp"
#include "ply_header.hpp"
#include "unusable.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

namespace gart::io::ply {

// The values of the body one after the other, whatever their encoding.
class body_reader {
 public:
  explicit body_reader(ply_file const& file)
      : file_(file),
        text_(reinterpret_cast<char const*>(file.bytes.data()) + file.head.size, file.bytes.size() - file.head.size) {}

  u64 remaining() const { return text_.size(); }

  double next(scalar type, element const& e, u64 record, property const& p) {
    return file_.head.format == encoding::ascii ? next_ascii(e, record, p) : next_binary(type, e, record, p);
  }

  void skip_list(element const& e, u64 record, property const& p) {
    double const n = next(p.count_type, e, record, p);
    if (!(n >= 0 && n <= std::numeric_limits<u32>::max() && n == std::floor(n)))
      file_.refuse(place(e, record, p) + " is a list whose length is not a count",
                   "the file is damaged: export it again");
    u64 const count = static_cast<u64>(n);
    if (file_.head.format == encoding::ascii) {
      for (u64 i = 0; i < count; ++i) next_ascii(e, record, p);
    } else {
      if (count > remaining() / scalar_size(p.type)) truncated(e, record, p);
      text_.remove_prefix(count * scalar_size(p.type));
    }
  }

  std::string place(element const& e, u64 record, property const& p) const {
    return e.name + " " + std::to_string(file_.owners.global(static_cast<index_t>(record))) + ", property " + p.name;
  }

 private:
  [[noreturn]] void truncated(element const& e, u64 record, property const& p) const {
    file_.refuse("ends at " + place(e, record, p), "the file is truncated: copy or export it again");
  }

  double next_ascii(element const& e, u64 record, property const& p) {
    std::string_view const word = next_word(text_);
    if (word.empty()) truncated(e, record, p);
    double value = 0;
    if (!parse_number(word, value)) {
      file_.refuse(place(e, record, p) + " is '" + std::string(word.substr(0, 40)) + "', not a number in range",
                   "correct the value");
    }
    return value;
  }

  template <class T>
  double take(bool swap) {
    std::array<char, sizeof(T)> raw;
    std::copy_n(text_.data(), sizeof(T), raw.data());
    if (swap) std::reverse(raw.begin(), raw.end());
    text_.remove_prefix(sizeof(T));
    return static_cast<double>(std::bit_cast<T>(raw));
  }

  double next_binary(scalar type, element const& e, u64 record, property const& p) {
    if (remaining() < scalar_size(type)) truncated(e, record, p);
    bool const swap = file_.head.format == encoding::big;
    switch (type) {
      case scalar::i8:
        return take<std::int8_t>(swap);
      case scalar::u8:
        return take<u8>(swap);
      case scalar::i16:
        return take<std::int16_t>(swap);
      case scalar::u16:
        return take<u16>(swap);
      case scalar::i32:
        return take<std::int32_t>(swap);
      case scalar::u32:
        return take<u32>(swap);
      case scalar::f32:
        return take<float>(swap);
      case scalar::f64:
        return take<double>(swap);
    }
    return 0;
  }

  ply_file const& file_;
  std::string_view text_;
};

inline element const& vertices(ply_file const& file) {
  for (element const& e : file.head.elements) {
    if (e.name == "vertex") return e;
  }
  file.refuse("the header has no 'element vertex'", "name a PLY of points or Gaussians");
}

inline property const* find(element const& e, std::string_view name) {
  for (property const& p : e.properties) {
    if (p.name == name && !p.list) return &p;
  }
  return nullptr;
}

// Where a property's value goes: store(column, vertex, value), after store.settled(column, value). A vertex with
// numbers that are still no finite floats goes to `bad`.
template <class Store>
void read_vertices(ply_file const& file, std::vector<std::string> const& columns, Store const& store, unusable& bad) {
  body_reader body(file);
  for (element const& e : file.head.elements) {
    bool const wanted = e.name == "vertex";
    u64 const smallest = e.smallest(file.head.format);
    if (!smallest && !wanted) continue;
    require_room(file, e, body.remaining());
    std::vector<int> column_of(e.properties.size(), -1);
    for (std::size_t i = 0; wanted && i < e.properties.size(); ++i) {
      auto const found = std::find(columns.begin(), columns.end(), e.properties[i].name);
      if (found != columns.end() && !e.properties[i].list) column_of[i] = static_cast<int>(found - columns.begin());
    }
    if (wanted) store.resize(static_cast<std::size_t>(e.count));
    for (u64 record = 0; record < e.count; ++record) {
      for (std::size_t i = 0; i < e.properties.size(); ++i) {
        property const& p = e.properties[i];
        if (p.list) {
          body.skip_list(e, record, p);
          continue;
        }
        double const read = body.next(p.type, e, record, p);
        if (column_of[i] < 0) continue;
        auto const column = static_cast<std::size_t>(column_of[i]), vertex = static_cast<std::size_t>(record);
        double const value = store.settled(column, read);
        if (!std::isfinite(static_cast<float>(value)))
          bad.add(vertex, [&] {
            return body.place(e, record, p) + (std::isnan(value) ? " is NaN" : " is infinite or too large for a float");
          });
        store(column, vertex, value);
      }
    }
    if (wanted) return;
  }
}

inline void require_columns(ply_file const& file, element const& e, std::vector<std::string> const& columns,
                            char const* remedy) {
  for (std::string const& name : columns) {
    if (!find(e, name)) file.refuse("property '" + name + "' is missing", remedy);
  }
}

// Hands the text to the stream now and then, so that it stays small.
inline void drain(std::ostream& out, std::string& text, std::size_t limit) {
  if (text.size() < limit) return;
  out.write(text.data(), static_cast<std::streamsize>(text.size()));
  text.clear();
}

inline constexpr std::size_t chunk = std::size_t{1} << 20;

}  // namespace gart::io::ply
