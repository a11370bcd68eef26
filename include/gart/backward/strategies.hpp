#pragma once
// Seam 3: a backward strategy is a composition: what the forward pass records, which terms are gathered by primitive and
// which are scattered by pixel.

#include <gart/backward/terms.hpp>
#include <gart/render/record.hpp>

namespace gart {

struct pixel_strategy {
  static constexpr char const* name = "pixel";
  using record = record_none;
  using gather = terms<>;
  using scatter = terms<color, geometry>;
};

}  // namespace gart
