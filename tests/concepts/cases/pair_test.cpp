// A map of the pairs that a program's own test leaves.
// expects: t.meets(p, cell, tile)
#include <gart/exec/parallel.hpp>
#include <gart/tiles/tile_map.hpp>

struct left_half {
  struct primitive {};
  primitive of(gart::index_t) const { return {}; }
#ifdef GART_WHOLE
  bool meets(primitive const&, gart::pixel_box const& cell, gart::u32) const { return cell.x0 < 32; }
#endif
};

void build(gart::serial_exec& exec, gart::tile_map<gart::serial_exec, 8>& map,
           gart::footprints<gart::serial_exec, 8> const& prints) {
  map.build(exec, {64, 64}, prints, gart::number_order{}, left_half{});
}
