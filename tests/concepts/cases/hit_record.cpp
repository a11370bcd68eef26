// expects: r.place_of(id, at)
#include <gart/render/record.hpp>

struct nothing : gart::record_none {
#ifndef GART_WHOLE
  gart::u32 place_of(gart::u32 id) const { return id; }  // hides the one that takes a pixel
#endif
};
static_assert(gart::hit_record<nothing>);
