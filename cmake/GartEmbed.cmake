# cmake -DFOLDER=... -DOUTPUT=page.cpp -P GartEmbed.cmake: the files of a folder as a C++ table that src/view/page.hpp
# declares.
file(GLOB files RELATIVE ${FOLDER} ${FOLDER}/*.html ${FOLDER}/*.js ${FOLDER}/*.css ${FOLDER}/*.svg)
list(SORT files)
set(arrays)
set(table)
set(number 0)
foreach(name IN LISTS files)
  file(READ ${FOLDER}/${name} hex HEX)
  string(REGEX REPLACE "(................................................................)" "\\1\n" hex "${hex}")
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${hex}")
  string(APPEND arrays "constexpr gart::u8 file_${number}[] = {\n${bytes}0};\n")
  string(APPEND table "    {\"${name}\", file_${number}, sizeof file_${number} - 1},\n")
  math(EXPR number "${number} + 1")
endforeach()
file(WRITE ${OUTPUT}.new "// Made from src/view/page by cmake/GartEmbed.cmake.
#include \"page.hpp\"

namespace {

${arrays}
// The last one ends the table.
constexpr gart::view::page_file files[] = {
${table}    {nullptr, nullptr, 0},
};

}  // namespace

namespace gart::view {

page_file const* find_page_file(std::string_view name) {
  for (page_file const* f = files; f->name; ++f)
    if (name == f->name) return f;
  return nullptr;
}

}  // namespace gart::view
")
file(RENAME ${OUTPUT}.new ${OUTPUT})
