"""Compiles every public header alone, included twice: .hpp by the host compiler; by nvcc, where there is one, each .cuh
and all .hpp together; the options as a user names some of them; and templates as a user instantiates them. The host
compiler gives no warning of any kind that a user may ask for (HOST). First it shows that a header that is not
self-contained, one without `#pragma once`, one that opens the namespace GART_ISA with no such macro, and one that
converts or shadows in silence, is seen. Other compilers that are there (OTHERS) take all headers and the templates.

Most headers include most of the same. So one compilation takes a chain of them, each of which is included, directly or
not, by the next: what comes before a header is what it would have brought anyway.
"""
import argparse
import concurrent.futures
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

# Clang counts signs among conversions, g++ does not.
PLAIN = ["-std=c++20", "-Wall", "-Wextra", "-Wshadow", "-Wconversion", "-Wno-sign-conversion", "-Werror", "-ffp-contract=off", "-fsyntax-only", "-x", "c++"]
HOST = [*PLAIN, "-fopenmp"]
# A user's other compilers, libraries and machines, and a program that is built without OpenMP.
OTHERS = [["g++"], ["clang++-16", "-fopenmp", "-march=x86-64-v3"], ["clang++-19", "-fopenmp"],
          ["clang++-16", "-stdlib=libc++"], ["clang++-19", "-stdlib=libc++"], ["aarch64-linux-gnu-g++", "-fopenmp"],
          ["x86_64-w64-mingw32-g++-posix", "-fopenmp"]]
# PTX of one architecture: no host compilation and no assembler, because what is looked for is front-end errors.
CUDA = ["-std=c++20", "--expt-relaxed-constexpr", "-diag-suppress=20012", "-arch=sm_90", "-ptx", "-o", "/dev/null",
        "-x", "cu"]


# Members that are not named have initialisers of their own, and no struct has a base, or -Wextra warns in every program
# that does this.
OPTIONS = """#include <gart/gart.hpp>
inline gart::dataset_options const loading{.downscale = 4};
inline gart::train_options const training{.iterations = 2000};
inline gart::render_options const rendering{.alpha_min = 0.01f, .near = 0.1f, .background = gart::vec3(1)};
inline gart::track_options const tracking{.render = {.near = 0.1f}};
inline gart::splat_packing const packing{.palette = 4096};
inline gart::configuration_request const request{.backend = gart::backend_kind::openmp};
"""


INCLUDED = re.compile(r"^ *# *include <(gart/[^>]+)>", re.M)


def included_by(include, name):
    """The headers of gart that a header includes, directly or not."""
    found, left = set(), [name]
    while left:
        for other in INCLUDED.findall((include / left.pop()).read_text()):
            if other not in found and (include / other).exists():
                found.add(other)
                left.append(other)
    return found


def chains(include, names):
    """All of them, in lists of which each header is included by the next, and not the other way round too."""
    brings = {name: included_by(include, name) for name in names}
    left = sorted(names, key=lambda name: len(brings[name]))
    while left:
        chain = [left.pop()]
        for name in reversed(left):
            if name in brings[chain[0]] and chain[0] not in brings[name]:
                chain.insert(0, name)
        left = [name for name in left if name not in chain]
        yield chain


def failure(command, include, names, folder):
    """What the compiler says of a file that includes `names` twice; empty when it compiles."""
    with tempfile.NamedTemporaryFile("w", dir=folder, suffix=".cc") as source:
        for name in [*names, *names]:
            source.write(f"#include <{name}>\n")
            if "GART_ISA" in (include / name).read_text():
                source.write(f"#if !defined(GART_ISA)\n#error {name} has no GART_ISA: include gart/core/isa.hpp\n#endif\n")
        source.flush()
        done = subprocess.run([*command, f"-I{include}", source.name], capture_output=True, text=True)
    what = names[0] if len(names) == 1 else f"{len(names)} headers, {names[0]} to {names[-1]}"
    return f"{what}: does not compile with {command[0]}\n{done.stdout}{done.stderr}" if done.returncode else ""


# What a template warns of is seen where it is instantiated.
TEMPLATES = """#include <gart/exec/parallel.hpp>
#include <gart/trace/bvh_tracer.hpp>
#include <gart/trace/tile_tracer.hpp>
#include <gart/train/trainer_impl.hpp>
namespace gart {
using shape = generalized_gaussian<4>;
template class basic_trainer<openmp_exec, scene_traits<1>, tile_tracer<openmp_exec>, primitive_method, self_comm>;
template class basic_trainer<openmp_exec, scene_traits<3, shape>, bvh_tracer<openmp_exec, shape>, hybrid_method, self_comm>;
template class basic_trainer<serial_exec, scene_traits<0>, tile_tracer<serial_exec>, deterministic_method, self_comm>;
template class basic_trainer<serial_exec, scene_traits<2>, bvh_tracer<serial_exec>, pixel_method, self_comm>;
}  // namespace gart
"""


def program_failure(what, text, command, include, folder):
    source = pathlib.Path(folder) / f"{what.split()[0]}.cc"
    source.write_text(text)
    done = subprocess.run([*command, f"-I{include}", str(source)], capture_output=True, text=True)
    return f"{what}:\n{done.stderr}" if done.returncode else ""


def works(command, folder):
    """Whether the compiler is there, with its libraries and GLM."""
    program = "#include <atomic>\n#include <glm/glm.hpp>\n#if defined(_OPENMP)\n#include <omp.h>\n#endif\n"
    return shutil.which(command[0]) is not None and not program_failure("tried", program, command, folder, folder)


def self_check(host, folder):
    headers = {
        "good.hpp": ("#pragma once\n#include <cstddef>\ninline std::size_t good() { return 0; }\n", True),
        "alone.hpp": ("#pragma once\ninline std::size_t alone() { return 0; }\n", False),
        "twice.hpp": ("struct twice {};\n", False),
        "name.hpp": ("#pragma once\nnamespace gart { inline namespace GART_ISA {}}\n", False),
        "converts.hpp": ("#pragma once\ninline float converts(int x) { return static_cast<float>(x) + x; }\n", False),
        "shadows.hpp": ("#pragma once\ninline int shadowed;\ninline int shadows(int shadowed) { return shadowed; }\n",
                        False),
    }
    folder = pathlib.Path(folder)
    for name, (text, compiles) in headers.items():
        (folder / name).write_text(text)
        if (failure(host, folder, [name], folder) == "") != compiles:
            sys.exit(f"the check itself is broken: {name} should {'' if compiles else 'not '}compile")
    if failure(host, folder, ["good.hpp", "converts.hpp"], folder) == "":
        sys.exit("the check itself is broken: converts.hpp should not compile after another")
    (folder / "gart").mkdir()
    for name, text in {"a": "", "b": "#include <gart/a>\n", "c": "#include <gart/b>\n#include <gart/d>\n",
                       "d": "#include <gart/c>\n"}.items():
        (folder / "gart" / name).write_text(text)
    found = sorted(sorted(chains(folder, ["gart/a", "gart/b", "gart/c", "gart/d"])), key=len)
    if found not in ([["gart/c"], ["gart/a", "gart/b", "gart/d"]], [["gart/d"], ["gart/a", "gart/b", "gart/c"]]):
        sys.exit(f"the check itself is broken: chains are {found}")


parser = argparse.ArgumentParser()
parser.add_argument("include", type=pathlib.Path)
parser.add_argument("--cxx", required=True)
parser.add_argument("--nvcc")
parser.add_argument("--glm", type=pathlib.Path, help="the folder that has glm/glm.hpp, for compilers of other machines")
parser.add_argument("--jobs", type=int, default=1)
a = parser.parse_args()
include = a.include.resolve()

with tempfile.TemporaryDirectory() as folder:
    host = [a.cxx, *HOST]
    self_check(host, folder)
    headers = sorted(str(p.relative_to(include)) for p in (include / "gart").rglob("*") if p.suffix in (".hpp", ".cuh"))
    plain = [name for name in headers if name.endswith(".hpp")]
    if not plain:
        sys.exit(f"no headers in {include}/gart")
    glm = []
    if a.glm:
        (pathlib.Path(folder) / "with_glm").mkdir()
        (pathlib.Path(folder) / "with_glm" / "glm").symlink_to(a.glm.resolve() / "glm")
        glm = ["-isystem", f"{folder}/with_glm"]
    others = {" ".join(other): [*other, *PLAIN, *glm] for other in OTHERS}
    there = {name: command for name, command in others.items() if works(command, folder)}
    with concurrent.futures.ThreadPoolExecutor(max(1, a.jobs)) as pool:
        jobs = []
        everything = "".join(f"#include <{name}>\n" for name in plain) + OPTIONS + TEMPLATES
        for number, (name, command) in enumerate(there.items()):
            jobs.append(pool.submit(program_failure, f"{number} all headers by {name}", everything, command, include, folder))
        if a.nvcc:
            units = [[name] for name in headers if name.endswith(".cuh")]
            jobs += [pool.submit(failure, [a.nvcc, *CUDA], include, unit, folder) for unit in [plain, *units]]
        jobs += [pool.submit(failure, host, include, unit, folder) for unit in [plain, *chains(include, plain)]]
        for what, text in {"options as a user names some of them": OPTIONS,
                           "templates as a user instantiates them": TEMPLATES}.items():
            jobs.append(pool.submit(program_failure, what, text, host, include, folder))
    failures = [message for job in jobs if (message := job.result())]

print("\n".join(failures) or f"{len(headers if a.nvcc else plain)} headers compile" +
      ("" if a.nvcc else "; .cuh files were not tried: no nvcc"))
print("also by: " + "; ".join(there) + ". Not there: " + ("; ".join(n for n in others if n not in there) or "none"))
sys.exit(1 if failures else 0)
