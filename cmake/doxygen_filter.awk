# What Doxygen reads of a header (cmake/Doxyfile.in), line for line. The instruction set's inline namespace
# (core/isa.hpp) reads as gart; lines of a /// comment that stand indented, tables and equations, stay as they are; and
# the comment behind `float a, b;` is of both, each a declaration of its own, where Doxygen takes it for the last one's.
function indented(line) { return line ~ /^ *\/\/\/   +[^ ]/ }

function each_its_comment(line,    at, code, text, i, c, depth, n, part, type, out) {
  at = index(line, "///<")
  if (!at) return line
  code = substr(line, 1, at - 1)
  text = substr(line, at + 4)
  sub(/ +$/, "", code)
  if (code ~ /\(/ || code !~ /;$/) return line
  n = 1
  part[1] = ""
  for (i = 1; i < length(code); ++i) {
    c = substr(code, i, 1)
    if (c ~ /[<{[]/) ++depth
    if (c ~ /[]>}]/) --depth
    if (c == "," && !depth) part[++n] = ""
    else part[n] = part[n] c
  }
  if (n == 1 || !match(part[1], /[A-Za-z_0-9]+( *=|\{|\[|$)/)) return line
  type = substr(part[1], 1, RSTART - 1)
  for (i = 1; i <= n; ++i) out = out (i > 1 ? type : "") part[i] "; /**<" text " */"
  return out
}

function show(next_line) {
  if (NR > 1) {
    if (!indented(line) && line ~ /^ *\/\/\/( |$)/ && indented(next_line)) line = line " @code{.unparsed}"
    else if (indented(line) && !indented(next_line)) line = line " @endcode"
    print line
  }
  line = next_line
}

{
  sub(/inline namespace GART_ISA \{ ?/, "");
  if (!sub(/^\}\}  \/\/ namespace gart::GART_ISA.*/, "}"))
    sub(/^\}\}\}  \/\/ namespace gart::GART_ISA.*/, "}}");
  show(each_its_comment($0))
}
END { NR++; show("") }
