#pragma once
// The page's files, compiled in from src/view/page by cmake/GartEmbed.cmake.

#include <gart/core/types.hpp>

#include <cstddef>
#include <string_view>

namespace gart::view {

struct page_file {
  char const* name;
  u8 const* bytes;
  std::size_t size;
};

// Of all files; null for one that there is not.
page_file const* find_page_file(std::string_view name);
// By the ending of a name.
char const* content_type_of(std::string_view name);

}  // namespace gart::view
