#pragma once
// What one launch of the device program reads and writes, in memory of the device.

#include <optix.h>
#include <vector_types.h>

namespace gart {

struct candidates_launch {
  OptixTraversableHandle tree;
  float4 const* rays;                 // origin and near, direction and far; where far < near there is no ray
  unsigned* counts;                   // of boxes met; written where there are no ids, else read
  unsigned long long const* offsets;  // where each ray's ids begin
  unsigned* ids;                      // of boxes met; null: they are counted
  unsigned* different;                // rays that met another number of boxes than was counted
};

}  // namespace gart
