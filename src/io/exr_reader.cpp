// OpenEXR files, read: one part of scan lines (https://openexr.com/en/latest/OpenEXRFileLayout.html).

#include "bytes.hpp"
#include "compression.hpp"

#include <gart/core/words.hpp>
#include <gart/io/exr_file.hpp>
#include <gart/io/file.hpp>

#include <algorithm>
#include <array>
#include <cstring>

namespace gart {
namespace {

using namespace io;

constexpr char const* export_again = "export it again";
constexpr int zlib_window = 15;
constexpr u64 most_packing = 1100;  // deflate makes bytes no smaller than this

enum number_kind : std::int32_t { whole_32, float_16, float_32 };

struct exr_channel {
  std::string name;
  number_kind kind;
  std::size_t offset;  // within a line's bytes, a pixel wide
  std::size_t size() const { return kind == float_16 ? 2 : 4; }
};

class exr_reader {
 public:
  exr_reader(std::filesystem::path const& path, std::vector<u8> const& bytes)
      : name_(path.string()), bytes_(bytes), in_(bytes, name_) {}

  image_float read(std::string_view wanted) {
    read_header();
    std::vector<exr_channel const*> chosen;
    for (char const letter : wanted) chosen.push_back(&channel(letter));
    u64 const pixels = static_cast<u64>(width_) * static_cast<u64>(height_),
              line = line_bytes_ * static_cast<u64>(width_);
    u64 const blocks = (static_cast<u64>(height_) + lines_ - 1) / lines_;
    if (blocks > in_.remaining() / 8 || pixels > (u64{1} << 32) ||
        line * static_cast<u64>(height_) > most_packing * bytes_.size())
      refuse("'dataWindow' is of " + std::to_string(width_) + " x " + std::to_string(height_) + " pixels, and only " +
                 std::to_string(in_.remaining()) + " bytes follow",
             "the file is truncated or damaged: copy or export it again");
    std::vector<u64> offsets(blocks);
    for (u64& offset : offsets) offset = in_.get<u64>("the table of blocks");
    image_float image(width_, height_, static_cast<int>(wanted.size()));
    std::vector<char> seen(blocks, 0);
    for (u64 const offset : offsets) {
      std::int32_t top = 0;
      std::vector<u8> const raw = block(offset, line, top);
      char& once = seen[static_cast<std::size_t>(top) / lines_];
      if (once) refuse("has two blocks of line " + std::to_string(top));
      once = 1;
      for (std::size_t y = 0; y < raw.size() / line; ++y)
        for (std::size_t c = 0; c < chosen.size(); ++c)
          for (int x = 0; x < width_; ++x)
            image.at(x, top + static_cast<int>(y), static_cast<int>(c)) =
                number(raw.data() + y * line + chosen[c]->offset * static_cast<std::size_t>(width_) +
                           chosen[c]->size() * static_cast<std::size_t>(x),
                       chosen[c]->kind);
    }
    return image;
  }

 private:
  [[noreturn]] void refuse(std::string const& what, std::string const& remedy = export_again) const {
    throw io_error(name_, what, remedy);
  }

  void read_header() {
    if (in_.get<u32>("the magic number") != 20000630) refuse("is no OpenEXR file", "name one");
    u32 const version = in_.get<u32>("the version");
    if ((version & 0xffu) != 2 || (version & 0x1a00u))
      refuse(version & 0x200u    ? "is tiled"
             : version & 0x800u  ? "is deep"
             : version & 0x1000u ? "has several parts"
                                 : "is of another version than 2",
             "save it as one part of scan lines");
    bool has_channels = false, has_window = false, has_compression = false;
    for (std::string key; !(key = in_.text("the header")).empty();) {
      std::string const type = in_.text("the header");
      u32 const size = in_.get<u32>("the header");
      u64 const rest = in_.remaining();
      if (size > rest) refuse("attribute '" + key + "' reaches past the end of the file");
      if (key == "channels" && type == "chlist") read_channels(), has_channels = true;
      if (key == "compression") read_compression(in_.get<u8>("'compression'")), has_compression = true;
      if (key == "dataWindow") {
        std::array<std::int32_t, 4> w;
        for (auto& v : w) v = in_.get<std::int32_t>("'dataWindow'");
        std::int64_t const across = std::int64_t{w[2]} - w[0] + 1, down = std::int64_t{w[3]} - w[1] + 1;
        if (across < 1 || down < 1 || across > 65536 || down > 65536)
          refuse("'dataWindow' is of " + std::to_string(across) + " x " + std::to_string(down) + " pixels",
                 "1 to 65536 each way are read");
        width_ = static_cast<int>(across), height_ = static_cast<int>(down), first_ = w[1], has_window = true;
      }
      u64 const used = rest - in_.remaining();
      if (used > size) refuse("attribute '" + key + "' is shorter than its kind");
      in_.skip(size - used, "the header");
    }
    if (!has_channels || !has_window || !has_compression)
      refuse(std::string("has no attribute '") +
             (!has_channels ? "channels"
              : !has_window ? "dataWindow"
                            : "compression") +
             "'");
  }

  void read_channels() {
    for (std::string name; !(name = in_.text("'channels'")).empty();) {
      auto const kind = in_.get<std::int32_t>("'channels'");
      in_.skip(4, "'channels'");
      auto const across = in_.get<std::int32_t>("'channels'"), down = in_.get<std::int32_t>("'channels'");
      if (kind < whole_32 || kind > float_32 || across != 1 || down != 1 || channels_.size() >= 1024)
        refuse("channel '" + name.substr(0, 60) + "' has fewer samples than pixels, or numbers of no known kind",
               "save it with one sample a pixel, half or float");
      channels_.push_back({name, static_cast<number_kind>(kind), line_bytes_});
      line_bytes_ += channels_.back().size();
    }
  }

  void read_compression(u8 kind) {
    static constexpr char const* names[] = {"none",  "RLE", "ZIPS", "ZIP",  "PIZ",
                                            "PXR24", "B44", "B44A", "DWAA", "DWAB"};
    if (kind > 3)
      refuse(std::string("'compression' is ") + (kind < 10 ? names[kind] : "unknown"),
             "save it with ZIP, ZIPS, RLE or none");
    packing_ = kind, lines_ = kind == 3 ? 16 : 1;
  }

  exr_channel const& channel(char letter) const {
    for (exr_channel const& c : channels_)
      if (c.name == std::string(1, letter)) return c;
    if (std::string_view("RGB").find(letter) != std::string_view::npos && channels_.size() == 1 &&
        channels_[0].name == "Y")
      return channels_[0];
    std::string const all = joined(channels_, [](exr_channel const& c) { return c.name.substr(0, 60); });
    refuse(std::string("has no channel ") + letter + ", only " + (all.empty() ? "none" : all), "save it with one");
  }

  // The bytes of the lines from `top` on.
  std::vector<u8> block(u64 offset, u64 line, std::int32_t& top) const {
    if (offset > bytes_.size() || bytes_.size() - offset < 8)
      refuse("a block begins past the end of the file", "the file is truncated: copy or export it again");
    std::int32_t at = 0, size = 0;
    std::memcpy(&at, bytes_.data() + offset, 4), std::memcpy(&size, bytes_.data() + offset + 4, 4);
    std::int64_t const y = std::int64_t{at} - first_;
    if (y < 0 || y >= height_ || static_cast<u64>(y) % lines_)
      refuse("a block begins at line " + std::to_string(y) + " of " + std::to_string(height_));
    if (size < 0 || static_cast<u64>(size) > bytes_.size() - offset - 8)
      refuse("the block of line " + std::to_string(y) + " reaches past the end of the file",
             "the file is truncated: copy or export it again");
    top = static_cast<std::int32_t>(y);
    u64 const whole = line * std::min<u64>(lines_, static_cast<u64>(height_ - y));
    u8 const* const data = bytes_.data() + offset + 8;
    auto const n = static_cast<std::size_t>(size);
    if (n == whole) return {data, data + n};  // stored, since packing made it no smaller
    if (packing_ == 0 || n > whole) refuse("the block of line " + std::to_string(y) + " is of another size");
    std::vector<u8> packed = packing_ == 1 ? run_lengths(data, n, whole) : inflated(data, n, zlib_window, whole, name_);
    if (packed.size() != whole) refuse("the block of line " + std::to_string(y) + " unpacks to another size");
    for (std::size_t i = 1; i < packed.size(); ++i) packed[i] = static_cast<u8>(packed[i - 1] + packed[i] - 128);
    std::vector<u8> raw(packed.size());
    std::size_t const half = (raw.size() + 1) / 2;
    for (std::size_t i = 0; i < raw.size(); ++i) raw[i] = packed[(i % 2 ? half : 0) + i / 2];
    return raw;
  }

  static std::vector<u8> run_lengths(u8 const* data, std::size_t size, u64 whole) {
    std::vector<u8> out;
    for (std::size_t i = 0; i < size && out.size() < whole;) {
      int const count = static_cast<std::int8_t>(data[i++]);
      if (count < 0) {
        std::size_t const n = std::min(static_cast<std::size_t>(-count), size - i);
        out.insert(out.end(), data + i, data + i + n), i += n;
      } else if (i < size) {
        out.insert(out.end(), static_cast<std::size_t>(count) + 1, data[i++]);
      }
    }
    return out;
  }

  static float number(u8 const* at, number_kind kind) {
    if (kind == float_16) {
      u16 bits;
      std::memcpy(&bits, at, 2);
      return from_half(bits);
    }
    u32 bits;
    std::memcpy(&bits, at, 4);
    return kind == float_32 ? std::bit_cast<float>(bits) : static_cast<float>(bits);
  }

  std::string name_;
  std::vector<u8> const& bytes_;
  byte_reader in_;
  std::vector<exr_channel> channels_;
  std::size_t line_bytes_ = 0;  // a pixel wide
  int width_ = 0, height_ = 0;
  std::int32_t first_ = 0;
  u8 packing_ = 0;
  u64 lines_ = 1;  // of a block
};

}  // namespace

image_float read_exr(std::filesystem::path const& path, std::string_view channels) {
  std::vector<u8> const bytes = read_file(path);
  return exr_reader(path, bytes).read(channels);
}

}  // namespace gart
