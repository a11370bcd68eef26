// A program that knows nothing of gart loads the plugin.
#include <dlfcn.h>

#include <cstdio>

int main() {
  void* const plugin = dlopen(PLUGIN, RTLD_NOW | RTLD_LOCAL);
  if (!plugin) return std::fprintf(stderr, "%s\n", dlerror()), 1;
  auto const brightest = reinterpret_cast<float (*)()>(dlsym(plugin, "brightest"));
  bool const hidden = !dlsym(plugin, "gart_serial_configurations");
  float const found = brightest ? brightest() : 0;
  std::printf("a plugin rendered %.2f, and %s\n", static_cast<double>(found),
              hidden ? "hides the rest" : "shows the rest");
  return found > 0.8f && hidden ? 0 : 1;
}
