// Of which degrees the compiled configurations are that ranks train by: rows of degree 3 hold 1 and 2 as well.
#include <gart/runtime/request.hpp>

#include <doctest/doctest.h>

#include <map>
#include <set>
#include <string>

using namespace gart;

TEST_CASE("ranks train at every degree, in rows of degree 0 or 3") {
  std::map<std::string, std::set<int>> degrees;
  for (configuration_info const& c : compiled_configurations())
    if (c.ranks) degrees[std::string(to_string(c.backend)) + " " + c.backward].insert(c.sh_degree);
  CHECK(degrees.size() >= 2);  // with sums in a fixed order and without
  for (auto const& [name, there] : degrees) {
    CAPTURE(name);
    CHECK(there == std::set<int>{0, 3});
  }
}
