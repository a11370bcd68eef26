// A map in an order of a program's own.
// expects: k.shift()
#include <gart/exec/parallel.hpp>
#include <gart/tiles/tile_map.hpp>

struct backwards {
  int take(int free_bits) { return bits = free_bits < 16 ? free_bits : 16; }
#ifdef GART_WHOLE
  int shift() const { return 0; }
#endif
  struct primitive {
    gart::u32 key;
  };
  primitive of(gart::index_t i) const { return {~i & ((gart::u32{1} << bits) - 1)}; }
  gart::u32 key(primitive const& p, gart::pixel_box const&, gart::u32) const { return p.key; }
  int bits = 0;
};

void build(gart::serial_exec& exec, gart::tile_map<gart::serial_exec, 8>& map,
           gart::footprints<gart::serial_exec, 8> const& prints) {
  map.build(exec, {64, 64}, prints, backwards{});
}
