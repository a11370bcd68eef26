// gart::io, built as part of another project: an image through both codecs.
#include <gart/io/image_file.hpp>

#include <cstdio>
#include <exception>

int main(int argc, char** argv) try {
  if (argc != 2) return 2;
  gart::image8 const grey(3, 2, 3, 128);
  gart::write_png(argv[1], grey);
  return gart::read_image(argv[1]).data == grey.data && !gart::encode_jpeg(grey).empty() ? 0 : 1;
} catch (std::exception const& e) {
  return std::fprintf(stderr, "use_io: %s\n", e.what()), 1;
}
