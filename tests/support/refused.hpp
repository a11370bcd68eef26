#pragma once
// Checks that a call is refused with an error that says what.

#include <gart/core/error.hpp>

#include <doctest/doctest.h>

namespace gart_test {

template <class F>
void refused(F&& call, char const* what) {
  CHECK_THROWS_WITH_AS(call(), doctest::Contains(what), gart::invalid_argument);
}

}  // namespace gart_test
