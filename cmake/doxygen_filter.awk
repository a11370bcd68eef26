# What Doxygen reads of a header (cmake/Doxyfile.in), line for line. The instruction set's inline namespace
# (core/isa.hpp) reads as gart, and lines of a /// comment that stand indented, tables and equations, stay as they are.
function indented(line) { return line ~ /^ *\/\/\/   +[^ ]/ }
function show(next_line) {
  if (NR > 1) {
    if (!indented(line) && line ~ /^ *\/\/\/( |$)/ && indented(next_line)) line = line " @verbatim"
    else if (indented(line) && !indented(next_line)) line = line " @endverbatim"
    print line
  }
  line = next_line
}
{ sub(/namespace gart::inline GART_ISA/, "namespace gart"); show($0) }
END { NR++; show("") }
