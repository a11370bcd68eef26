// The addresses of the hit buffer: one to one onto [0, sum of box areas), primitive by primitive, tile by tile.
#include <gart/backward/hit_layout.hpp>
#include <support/policies.hpp>

#include <random>
#include <vector>

namespace {

using gart::u32;
using gart::u64;

// All tiles, row by row; those past a seam after those before it.
template <int Size>
std::vector<u32> in_order(gart::tile_grid<Size> const& grid, gart::footprint_slots const& r) {
  std::vector<u32> out;
  for (u32 row = 0; row < grid.rows(); ++row)
    for (bool past : {false, true})
      for (u32 column = 0; column < grid.columns(); ++column)
        if ((r.seam > 0 && grid.tile(column, row).x1 <= r.box.x0) == past) out.push_back(row * grid.columns() + column);
  return out;
}

template <int Size>
void check_addresses(std::mt19937_64& random, int trials) {
  auto const below = [&](int n) { return static_cast<int>(random() % static_cast<u64>(n)); };
  for (int trial = 0; trial < trials; ++trial) {
    gart::tile_grid<Size> const grid{1 + below(70), 1 + below(70)};
    CAPTURE(Size);
    CAPTURE(grid.width);
    CAPTURE(grid.height);
    std::vector<gart::footprint_slots> ranges(1 + below(20));
    u64 slots = 0;
    for (auto& r : ranges) {
      int const x0 = below(grid.width + 1), y0 = below(grid.height + 1);
      r.box = {static_cast<gart::u16>(x0), static_cast<gart::u16>(y0),
               static_cast<gart::u16>(x0 + below(grid.width - x0 + 1)),
               static_cast<gart::u16>(y0 + below(grid.height - y0 + 1))};
      if (below(8) == 0) r.box = {0, 0, static_cast<gart::u16>(grid.width), static_cast<gart::u16>(grid.height)};
      // Past the image's right border, and on from its left one.
      int const longest = grid.width - gart::footprint::seam_room;
      if (longest > 1 && below(3) == 0) {
        int const first = 1 + below(grid.width - 1), end = first + 1 + below(longest);
        if (end > grid.width) {
          r.seam = static_cast<gart::u16>(grid.width);
          r.box.x0 = static_cast<gart::u16>(first), r.box.x1 = static_cast<gart::u16>(end);
        }
      }
      r.offset = slots & gart::footprint_slots::most;
      slots += r.box.area();
    }
    // In the order the buffer is meant to have, addresses count up by one: that is the bijection.
    u64 next = 0;
    long wrong = 0, wrong_walk = 0;
    for (auto const& r : ranges)
      for (u32 t : in_order(grid, r)) {
        gart::pixel_box const cell = gart::cell_in(r, grid.tile(t));
        u64 const cell_begin = next;
        for (u32 y = cell.y0; y < cell.y1; ++y)
          for (u32 x = cell.x0; x < cell.x1; ++x) wrong += gart::hit_slot_index<Size>(r, x, y) != next++;
        // What a gather over (primitive, tile) walks.
        if (!cell.empty()) wrong_walk += r.offset + gart::tile_offset(r, cell) != cell_begin;
        wrong_walk += next - cell_begin != cell.area();
      }
    CHECK(wrong == 0);
    CHECK(wrong_walk == 0);
    CHECK(next == slots);
  }
}

template <int Size>
void check_grid(int width, int height) {
  gart::tile_grid<Size> const grid{width, height};
  CAPTURE(Size);
  CAPTURE(width);
  CAPTURE(height);
  std::vector<int> covered(static_cast<std::size_t>(width) * height, 0);
  for (u32 t = 0; t < grid.count(); ++t) {
    gart::pixel_box const b = grid.tile(t);
    CHECK(!b.empty());
    CHECK(gart::tiles_of<Size>(b).area() == 1);
    for (int y = b.y0; y < b.y1; ++y)
      for (int x = b.x0; x < b.x1; ++x) ++covered[static_cast<std::size_t>(y) * width + x];
  }
  for (int c : covered)
    if (c != 1) FAIL_CHECK("a pixel lies in " << c << " tiles");
}

}  // namespace

TEST_CASE("addresses of (primitive, tile, pixel) are one to one") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  check_addresses<4>(random, 100);
  check_addresses<8>(random, 100);
  check_addresses<16>(random, 100);
}

TEST_CASE("addresses keep 64 bits") {
  gart::footprint_slots const range{u64{5} << 32, {0, 0, 65535, 65535}};
  CHECK(gart::hit_slot_index<8>(range, 65534, 65534) == (u64{5} << 32) + u64{65535} * 65535 - 1);
}

TEST_CASE("tiles cover every pixel once, whatever the image's size") {
  int const sizes[][2] = {{1, 1}, {7, 5}, {8, 8}, {64, 48}, {33, 17}};
  for (auto const& [width, height] : sizes) {
    check_grid<4>(width, height);
    check_grid<8>(width, height);
    check_grid<16>(width, height);
  }
  CHECK(gart::tile_grid<16>{65535, 65535}.tile(4096 * 4096 - 1).area() == 15 * 15);
}

TEST_CASE("the tiles of a box are those that share a pixel with it") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed() + 1);
  gart::tile_grid<8> const grid{61, 45};
  for (int trial = 0; trial < 300; ++trial) {
    auto const below = [&](int n) { return static_cast<gart::u16>(random() % static_cast<u64>(n)); };
    gart::pixel_box b{below(61), below(45), 0, 0};
    b.x1 = static_cast<gart::u16>(b.x0 + below(62 - b.x0)), b.y1 = static_cast<gart::u16>(b.y0 + below(46 - b.y0));
    gart::pixel_box const tiles = gart::tiles_of<8>(b);
    long wrong = 0;
    for (u32 t = 0; t < grid.count(); ++t) {
      u32 const x = t % grid.columns(), y = t / grid.columns();
      bool const listed = x >= tiles.x0 && x < tiles.x1 && y >= tiles.y0 && y < tiles.y1;
      wrong += listed == (b.empty() || gart::intersect(b, grid.tile(t)).empty());
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("the tiles of a box past a seam go on from the image's first") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed() + 2);
  int past = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    auto const below = [&](int n) { return static_cast<int>(random() % static_cast<u64>(n)); };
    int const width = 34 + below(90), columns = (width + 7) / 8;
    int const first = 1 + below(width - 1), end = first + 1 + below(width - gart::footprint::seam_room);
    if (end <= width) continue;
    ++past;
    CAPTURE(width);
    CAPTURE(first);
    CAPTURE(end);
    gart::footprint_slots const range(0, {static_cast<gart::u16>(first), 3, static_cast<gart::u16>(end), 20},
                                      static_cast<gart::u16>(width));
    gart::pixel_box const tiles = gart::tiles_of<8>(range);
    std::vector<int> listed(static_cast<std::size_t>(columns)), touched(listed);
    for (int x = first; x < end; ++x) touched[static_cast<std::size_t>(x % width / 8)] = 1;
    for (int column = tiles.x0; column < tiles.x1; ++column) ++listed[static_cast<std::size_t>(column % columns)];
    CHECK(listed == touched);
    CHECK(tiles.y0 == 0);
    CHECK(tiles.y1 == 3);
  }
  CHECK(past > 100);
}
