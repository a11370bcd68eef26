// gart::embree: its rows are there.
#include <gart/runtime/session.hpp>

#include <cstdio>

int main() {
  for (gart::row_info const& row : gart::compiled_rows())
    if (row.tracer == "embree") return std::printf("%s on %s\n", row.tracer.c_str(), row.backend.c_str()), 0;
  return 1;
}
