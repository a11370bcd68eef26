#pragma once
// Reads numbers out of bytes that may be anything. Every read is checked, and a count is believed only where its bytes
// are there. Errors: io_error naming the file, the field and the byte.

#include <gart/core/error.hpp>
#include <gart/core/types.hpp>

#include <bit>
#include <charconv>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace gart::io {

static_assert(std::endian::native == std::endian::little, "binary files are read and written as little endian");

// Little-endian records.
class byte_reader {
 public:
  byte_reader(std::vector<u8> const& bytes, std::string file) : bytes_(bytes), file_(std::move(file)) {}

  template <class T>
  T get(char const* field) {
    T value;
    need(sizeof value, field);
    std::memcpy(&value, bytes_.data() + position_, sizeof value);
    position_ += sizeof value;
    return value;
  }
  // A count of records of at least `record` bytes each.
  u64 count(char const* field, u64 record) {
    u64 const n = get<u64>(field);
    if (n > remaining() / record) {
      throw io_error(file_,
                     std::string(field) + " is " + std::to_string(n) + ", but only " + std::to_string(remaining()) +
                         " bytes follow",
                     "the file is truncated or damaged: copy or export it again");
    }
    return n;
  }
  void skip(u64 size, char const* field) { need(size, field), position_ += size; }
  // Up to a NUL, which is consumed.
  std::string text(char const* field) {
    auto const* begin = reinterpret_cast<char const*>(bytes_.data()) + position_;
    void const* end = remaining() ? std::memchr(begin, 0, remaining()) : nullptr;
    if (!end) need(remaining() + 1, field);
    std::string value(begin, static_cast<char const*>(end));
    position_ += value.size() + 1;
    return value;
  }
  u64 remaining() const { return bytes_.size() - position_; }

 private:
  void need(u64 size, char const* field) const {
    if (size > remaining()) {
      throw io_error(file_, "ends at byte " + std::to_string(bytes_.size()) + ", within " + field,
                     "the file is truncated: copy or export it again");
    }
  }
  std::vector<u8> const& bytes_;
  std::string file_;
  std::size_t position_ = 0;
};

// A float of 16 bits (IEEE 754's binary16).
inline float from_half(u16 bits) {
  u32 const sign = static_cast<u32>(bits & 0x8000u) << 16, exponent = (bits >> 10) & 31u, fraction = bits & 1023u;
  if (exponent == 0) {  // zero and what is smaller than a normal number
    float const value = static_cast<float>(fraction) * 0x1p-24f;
    return sign ? -value : value;
  }
  return std::bit_cast<float>(sign | (exponent == 31 ? 255u : exponent + 112u) << 23 | fraction << 13);
}

// The bytes of a number at the end of the text.
template <class T>
void put(std::string& out, T value) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  out.append(raw, sizeof raw);
}

inline bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\v' || c == '\f'; }

// Takes the next word off the front of `text`; empty at the end.
inline std::string_view next_word(std::string_view& text) {
  std::size_t begin = 0;
  while (begin < text.size() && is_space(text[begin])) ++begin;
  std::size_t end = begin;
  while (end < text.size() && !is_space(text[end])) ++end;
  std::string_view const word = text.substr(begin, end - begin);
  text.remove_prefix(end);
  return word;
}

// Takes the next line off the front of `text`, without its end; false at the end.
inline bool next_line(std::string_view& text, std::string_view& line) {
  if (text.empty()) return false;
  std::size_t const end = text.find('\n');
  line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return true;
}

// Whether the whole word is a number of type T. "nan" and "inf" are numbers.
template <class T>
bool parse_number(std::string_view word, T& value) {
  if (word.size() > 1 && word[0] == '+') word.remove_prefix(1);
  auto const [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
  return code == std::errc() && end == word.data() + word.size();
}

}  // namespace gart::io
