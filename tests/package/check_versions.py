"""Two versions of gart in one program. The other version is a copy of the headers with another number, in which two
functions give other results. Objects that use the formulas, kernels and templates of either are linked together: the
namespace has the version (gart/core/isa.hpp). What the compiled libraries define lies in namespace gart itself. There
shared objects keep apart by symbol versions, as backends/CMakeLists.txt links gart's own.

Each time a link without what keeps the versions apart comes first, to show that a mixture is seen.
"""
import argparse
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

parser = argparse.ArgumentParser()
parser.add_argument("include", type=pathlib.Path)
parser.add_argument("--cxx", required=True)
a = parser.parse_args()

PART = """#include <gart/math/logit.hpp>
#include <gart/optim/options.hpp>
extern "C" double PART_formula() { return gart::sigmoid_in_double(0.0); }
extern "C" double PART_interface() { return static_cast<double>(gart::least_opacity(0.25f, 0.0f)); }
"""
MAIN = """#include <cstdio>
extern "C" double one_formula(), one_interface(), two_formula(), two_interface();
int main() { std::printf("%g %g %g %g\\n", one_formula(), two_formula(), one_interface(), two_interface()); }
"""


def run(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout


def changed(path, pattern, to):
    text = path.read_text()
    if not re.search(pattern, text):
        sys.exit(f"{path}: has no {pattern}; the test changes it")
    path.write_text(re.sub(pattern, to, text, count=1))


def expect(what, got, formulas, interface):
    numbers = [float(n) for n in got.split()]
    if numbers[:2] != formulas or (interface and numbers[2:] != interface):
        sys.exit(f"{what}: the parts of two versions got {got}")


with tempfile.TemporaryDirectory() as folder:
    at = pathlib.Path(folder)
    for other in ("same_number", "other_number"):
        shutil.copytree(a.include, at / other)
        changed(at / other / "gart/math/logit.hpp", r"double sigmoid_in_double\(double x\) \{ return 1", "double sigmoid_in_double(double x) { return 2")
        changed(at / other / "gart/optim/options.hpp", r"return std::max\(opacity,", "return 1 + std::max(opacity,")
    changed(at / "other_number/gart/core/version.hpp", r"GART_VERSION_MINOR \d+", "GART_VERSION_MINOR 987")
    (at / "part.cpp").write_text(PART)
    (at / "main.cpp").write_text(MAIN)

    def part(name, include):
        run(a.cxx, "-std=c++20", "-O0", "-fPIC", f"-I{include}", f"-DPART_formula={name}_formula",
            f"-DPART_interface={name}_interface", "-c", at / "part.cpp", "-o", at / f"{name}.o")
    part("one", a.include)
    for other, formulas in (("same_number", [0.5, 0.5]), ("other_number", [0.5, 1.0])):
        part("two", at / other)
        run(a.cxx, at / "main.cpp", at / "one.o", at / "two.o", "-o", at / "program")
        expect("linked together, " + other, run(at / "program"), formulas, None)
    for flags, interface in (([], [0.25, 0.25]), (["-Wl,--default-symver"], [0.25, 1.25])):
        for name in ("one", "two"):
            run(a.cxx, "-shared", at / f"{name}.o", f"-Wl,-soname,lib{name}.so", *flags, "-o", at / f"lib{name}.so")
        run(a.cxx, at / "main.cpp", f"-L{at}", "-lone", "-ltwo", f"-Wl,-rpath,{at}", "-o", at / "program")
        expect("as shared objects, " + " ".join(flags), run(at / "program"), [0.5, 1.0], interface)
print("two versions of gart keep apart in one program")
