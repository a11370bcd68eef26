#include "support.hpp"

#include <sys/resource.h>

#include <csignal>
#include <ostream>

using namespace gart_test;

namespace {

std::size_t files_in(fs::path const& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

}  // namespace

TEST_CASE("a file is written whole and replaces the old one") {
  scratch_folder const folder;
  fs::path const path = folder.put("a.txt", "first");
  gart::write_file(path, std::string_view("second\0third", 12));
  CHECK(text_of(path) == std::string("second\0third", 12));
  CHECK(files_in(folder.path) == 1);
}

TEST_CASE("a body that fails leaves the old file and no temporary one") {
  scratch_folder const folder;
  fs::path const path = folder.put("a.txt", "old");
  CHECK_THROWS_AS(gart::write_file(path,
                                   [](std::ostream& out) {
                                     out << "new";
                                     throw std::logic_error("no");
                                   }),
                  std::logic_error);
  CHECK(text_of(path) == "old");
  std::string const what = error_of(
      [&] { gart::write_file(path, [](std::ostream& out) { out << "new", out.setstate(std::ios::badbit); }); });
  CHECK(holds(what, path.string()));
  CHECK(text_of(path) == "old");
  CHECK(files_in(folder.path) == 1);
}

TEST_CASE("a full disk is reported and leaves no half-written file") {
  scratch_folder const folder;
  fs::path const path = folder.put("a.bin", "old");
  rlimit before{};
  REQUIRE(getrlimit(RLIMIT_FSIZE, &before) == 0);
  auto const handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit limit = before;
  limit.rlim_cur = 8192;  // the same failing write(2) as on a full disk
  REQUIRE(setrlimit(RLIMIT_FSIZE, &limit) == 0);
  std::string const large(1 << 20, 'x'), barely(8193, 'x');
  std::string const what = error_of([&] { gart::write_file(path, large); });
  std::string const at_the_end = error_of([&] { gart::write_file(path, barely); });
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  CHECK(holds(what, path.string()));
  CHECK(holds(what, "File too large"));
  CHECK(holds(at_the_end, "cannot be written"));
  CHECK(text_of(path) == "old");
  CHECK(files_in(folder.path) == 1);
}

TEST_CASE("places that cannot be written or read are named") {
  scratch_folder const folder;
  fs::path const file = folder.put("file", "x");
  for (fs::path const& path : {folder.path / "none" / "a", file / "a"}) {
    std::string const what = error_of([&] { gart::write_file(path, "x"); });
    CHECK(holds(what, path.string()));
    CHECK(holds(what, "folder that exists"));
  }
  fs::create_directory(folder.path / "sub");
  CHECK(holds(error_of([&] { gart::write_file(folder.path / "sub", "x"); }), "sub"));
  CHECK(files_in(folder.path) == 2);
  CHECK(holds(error_of([&] { gart::read_file(folder.path / "none"); }), "no such file"));
  CHECK(holds(error_of([&] { gart::read_file(folder.path); }), "is a folder"));
}
