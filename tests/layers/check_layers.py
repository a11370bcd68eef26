"""Holds the includes of include/gart, src and backends to cmake/layers.txt, and first shows that it would see a violation.

What it asks for: every folder has a line in layers.txt; a header includes only folders its line names; nothing in
include/gart includes a backend; GLM is included in math/glm.hpp alone; x.hpp, which must be safe for any host compiler,
includes no .cuh; what is included is there; a header that opens namespace gart, outside of the instruction set's, has a
line in interface.txt; no header has more than 350 lines. The library speaks of fields, not of a program's options: no "--
option" in its strings and comments, and each field that a string names as `struct.field` has an option in the program's
table. A source of the program that launches kernels belongs to gart_kernels or gart_synth, which are optimised as the library
is: their templates have the library's names, and a linker keeps either.
"""
import pathlib
import re
import sys
import tempfile

INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]')
STRING = re.compile(r'"(?:[^"\\]|\\.)*"')
OPTION = re.compile(r"""^"--|(?<![^\s(`"'])--[a-z"]""")
FIELD = re.compile(r"\b(?:train_options|render_options|dataset_options|configuration_request)\.[a-z_]+")
FIELD_TABLE = "program/field_names.cpp"
TRAIN_TABLE = "include/gart/train/option_fields.hpp"  # whose fields all have an option, or are set by name
LONGEST = 350  # lines of a header
SUFFIXES = {".hpp", ".cuh", ".cpp", ".cu", ".h"}


def read_layers(path):
    layers = {}
    for number, line in enumerate(path.read_text().splitlines(), 1):
        line = line.split("#")[0].strip()
        if not line:
            continue
        folder, colon, allowed = line.partition(":")
        if not colon or folder in layers:
            sys.exit(f"{path}:{number}: expected one `folder: folders` line for each folder, got `{line}`")
        layers[folder] = {folder, *allowed.split()}
        unknown = layers[folder] - layers.keys()
        if unknown:
            sys.exit(f"{path}:{number}: {folder} may include {', '.join(sorted(unknown))}, not above it: that is a cycle")
    return layers


def opens_gart(path):
    return path.exists() and re.search(r"^namespace gart(::\w+)* \{(?! inline)", path.read_text(), re.M) is not None


def fields_of(table):
    """What the program has an option for: its lines GART_CLI_FIELD(struct, field), and those of the table of fields."""
    own = {f"{struct}.{field}" for struct, field in re.findall(r"GART_CLI_FIELD\((\w+), (\w+)\),", table)}
    return own | {f"train_options.{field}" for field in re.findall(r"GART_FIELD\((\w+)", table)}


def wrong_words(line, fields):
    """What is wrong in a line's strings and comment."""
    strings = STRING.findall(line)
    comment = STRING.sub("", line).partition("//")[2]
    if any(OPTION.search(text) for text in [comment, *strings]):
        yield "names an option of a program; name the field, as core/error.hpp says"
    for field in (f for s in strings for f in FIELD.findall(s)):
        if field not in fields:
            yield f"{field} has no line in {FIELD_TABLE}, and the program's user would read it"


def violations(root, layers, interface):
    found = [f"{root / 'include' / 'gart' / name}: is in cmake/interface.txt, and does not open namespace gart"
             for name in sorted(interface) if not opens_gart(root / "include" / "gart" / name)]
    headers = root / "include" / "gart"
    fields = fields_of("".join((root / t).read_text() for t in (FIELD_TABLE, TRAIN_TABLE) if (root / t).exists()))
    for path in sorted([*headers.rglob("*"), *(root / "src").rglob("*"), *(root / "backends").rglob("*")]):
        if path.suffix not in SUFFIXES:
            continue
        inside = path.is_relative_to(headers)
        relative = path.relative_to(headers) if inside else path.relative_to(root)
        if inside and len(relative.parts) == 1:
            folder = "gart"
        else:  # src/NAME is the body of include/gart/NAME, and is held to its line
            folder = relative.parts[1 if relative.parts[0] == "src" else 0]
        if folder not in layers:
            found.append(f"{path}: folder {folder} has no line in cmake/layers.txt")
            continue
        if inside and str(relative) not in interface and opens_gart(path):
            found.append(f"{path}: lies in namespace gart: open the inline namespace GART_ISA (core/isa.hpp), or give it a line in "
                         "cmake/interface.txt where compiled libraries define or take what is in it")
        lines = path.read_text().splitlines()
        if inside and len(lines) > LONGEST:
            found.append(f"{path}: has {len(lines)} lines, at most {LONGEST}: split it by ideas")
        for number, line in enumerate(lines, 1):
            found += [f"{path}:{number}: {wrong}" for wrong in wrong_words(line, fields)]
            match = INCLUDE.match(line)
            if not match:
                continue
            name, where = match.group(1), f"{path}:{number}"
            if name.startswith("glm/") and inside and str(relative) != "math/glm.hpp":
                found.append(f"{where}: includes {name}; include gart/math/glm.hpp")
            if inside and path.suffix == ".hpp" and name.endswith(".cuh"):
                found.append(f"{where}: a .hpp is for any host compiler and may not include {name}")
            if inside and (name.startswith(("backends/", "src/", "..")) or '"' in line):
                found.append(f"{where}: include/gart includes with <gart/...>, and no backend")
            if not name.startswith("gart/"):
                continue
            if not (root / "include" / name).exists():
                found.append(f"{where}: {name} is not there")
            parts = name.split("/")
            target = parts[1] if len(parts) > 2 else "gart"
            if target not in layers[folder]:
                found.append(f"{where}: {folder} may not include {target} ({name})")
    return found


def lightly_optimised_kernels(root):
    """Sources of the program that launch kernels, and are in none of the libraries that are optimised for it."""
    program = root / "program"
    listed = "".join(path.read_text() for path in [program / "CMakeLists.txt", program / "synth" / "synth.cmake"])
    named = " ".join(re.findall(r"add_library\(gart_(?:kernels|synth) STATIC ([^)]*)\)", listed))
    return [f"{path}: launches kernels: list it under gart_kernels in program/CMakeLists.txt"
            for path in sorted(program.rglob("*.cpp"))
            if "<gart/exec/parallel.hpp>" in path.read_text() and not re.search(rf"\b{path.name}\b", named)]


def self_check(layers):
    """A small tree with every kind of violation, each of which has to be seen."""
    wrong = {
        "include/gart/core/a.hpp": "#include <gart/train/b.hpp>\n",
        "include/gart/train/b.hpp": "#include <gart/core/a.hpp>\n  # include <glm/vec3.hpp>\n",
        "include/gart/math/c.hpp": '#include "../../../backends/cpu/d.hpp"\n',
        "include/gart/exec/e.hpp": "#include <gart/exec/f.cuh>\n",
        "include/gart/exec/f.cuh": "#include <gart/core/nowhere.hpp>\n",
        "include/gart/attic/g.hpp": "\n",
        "backends/cpu/d.hpp": "#include <gart/train/b.hpp>\n",
        "src/math/m.cpp": "#include <gart/train/b.hpp>\n",
        "include/gart/math/h.hpp": "namespace gart { inline namespace GART_ISA { namespace detail {}}}\n",
        "include/gart/math/i.hpp": "namespace gart::detail {}\n",
        "include/gart/math/j.hpp": "namespace gart {}\n",
        "include/gart/math/k.hpp": 'f("lower " "--points");\n// (--points)\n--points;  // of "a--b"\n',
        "include/gart/math/l.hpp": 'f("raise train_options.points or train_options.seed");\n',
        "include/gart/math/n.hpp": "\n" * (LONGEST + 1),
        FIELD_TABLE: '{GART_CLI_FIELD(train_options, points), "--points"},\n',
        "program/CMakeLists.txt": "add_library(gart_kernels STATIC a/fast.cpp)\nadd_executable(gart_program a/slow.cpp)\n",
        "program/synth/synth.cmake": "add_library(gart_synth STATIC ${HERE}/made.cpp)\n",
        "program/synth/made.cpp": "#include <gart/exec/parallel.hpp>\n",
        "program/a/fast.cpp": "#include <gart/exec/parallel.hpp>\n",
        "program/a/slow.cpp": "#include <gart/exec/parallel.hpp>\n",
    }
    expected = {"core/a.hpp:1", "train/b.hpp:2", "math/c.hpp:1", "exec/e.hpp:1", "exec/f.cuh:1", "attic/g.hpp",
                "math/h.hpp", "math/i.hpp", "math/k.hpp:1", "math/k.hpp:2", "math/l.hpp:1", "math/m.cpp:1", "math/n.hpp",
                "program/a/slow.cpp"}
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name, text in wrong.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text)
        found = violations(root, layers, {"math/h.hpp", "math/j.hpp"}) + lightly_optimised_kernels(root)
        seen = {re.sub(rf"^{re.escape(str(root))}/(include/gart/|src/|)", "", v).split(": ")[0] for v in found}
    if seen != expected:
        sys.exit(f"the check itself is broken: of a tree with violations at {sorted(expected)} it saw {sorted(seen)}")


root = pathlib.Path(sys.argv[1])
layers = read_layers(root / "cmake" / "layers.txt")
self_check(layers)
lines = (root / "cmake" / "interface.txt").read_text().splitlines()
found = violations(root, layers, {line for line in lines if line and not line.startswith("#")})
found += lightly_optimised_kernels(root)
print("\n".join(found) or "includes follow cmake/layers.txt, namespaces cmake/interface.txt, messages name fields")
sys.exit(1 if found else 0)
