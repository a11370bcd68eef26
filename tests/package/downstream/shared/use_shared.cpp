// A program that knows nothing of gart loads the plugin.
#include <dlfcn.h>

#include <cstdio>

int main() {
  void* const plugin = dlopen(PLUGIN, RTLD_NOW | RTLD_LOCAL);
  if (!plugin) return std::fprintf(stderr, "%s\n", dlerror()), 1;
  auto const brightest = reinterpret_cast<float (*)()>(dlsym(plugin, "brightest"));
  float const found = brightest ? brightest() : 0;
#if defined(FROM_ARCHIVES)
  if (dlsym(plugin, "gart_serial_configurations")) return std::fprintf(stderr, "the plugin shows gart's names\n"), 1;
#endif
  std::printf("a plugin rendered %.2f\n", static_cast<double>(found));
  return found > 0.8f ? 0 : 1;
}
