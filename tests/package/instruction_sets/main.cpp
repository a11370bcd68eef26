#include <cstdio>
#include <exception>

void use_templates();
void use_interface();

int main() try {
#if defined(USE_TEMPLATES)
  use_templates();
#endif
#if defined(USE_INTERFACE)
  use_interface();
#endif
  return 0;
} catch (std::exception const& e) {
  return std::fprintf(stderr, "%s\n", e.what()), 1;
}
