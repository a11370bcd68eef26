"""Links programs whose objects and whose libgart_cpu.a were compiled for different instruction sets, and holds what they
compute to what each part computes alone, bit for bit.

How many lanes the host policies have, and whether a fused multiply-add is one rounding, follows from -march. A program
and the library share each inline function and template of one name: where the name does not tell the two apart, one
runs the other's, and its images are black, or it crashes.

A program trains with the templates of the README (every method, SH 3) beside every configuration of
make_renderer and make_session. By default: the library that was built here; consumers for none and native at -O0, and
one at -O2: nvcc's host code, or that for none where there is no nvcc; the linker finding the library first, and last.
GART_TEST_ALL_INSTRUCTION_SETS=1 compiles two libraries more. It takes every pair of {none, x86-64-v3, native} at both
levels, and SH 0 to 3. One thread, because then the sums have one order.

The other libraries are compiled at -O0: nothing is inlined, so more names are shared, and it takes half of the time.

Values are compared where a program happens to have them. So the objects for none and for native at -O0, which inlines
nothing, are also searched for symbols that both have: none may have come out with a fused multiply-add, or with lanes.
Copies of a structure may: whatever register they go through, they move the same bytes. An optimised library would also
be slow if the linker took its templates from an object at -O0: all names of that object say that it is not optimised.
"""
import argparse
import concurrent.futures
import os
import pathlib
import platform
import re
import subprocess
import sys
import tempfile

parser = argparse.ArgumentParser()
parser.add_argument("--cmake", required=True)
parser.add_argument("--source", type=pathlib.Path, required=True)
parser.add_argument("--build", type=pathlib.Path, required=True)
parser.add_argument("--generator", required=True)
parser.add_argument("--cxx", required=True)
parser.add_argument("--jobs", default="1")
parser.add_argument("--march", default="", help="what the build's own library was compiled with")
parser.add_argument("--nvcc")
parser.add_argument("--sanitize", action="store_true")
a = parser.parse_args()
project = pathlib.Path(__file__).resolve().parent / "instruction_sets"
every = os.environ.get("GART_TEST_ALL_INSTRUCTION_SETS", "0") != "0"

features = set(re.search(r"^flags\s*:(.*)$", pathlib.Path("/proc/cpuinfo").read_text(), re.M)[1].split()) \
    if platform.machine() == "x86_64" else set()
if not {"avx2", "fma", "bmi2"} <= features:
    print("this machine has one instruction set only")
    sys.exit(77)


def run(*command, env=None):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, env=env)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\nexit code {done.returncode}\n{done.stdout}\n{done.stderr}")


def values(program):
    """What a program says: {what: (sum, hash)}; or how it ended."""
    try:
        done = subprocess.run([program], capture_output=True, text=True, timeout=300,
                              env={**os.environ, "OMP_NUM_THREADS": "1"})
    except subprocess.TimeoutExpired:
        return "did not end within 300 s"
    if done.returncode:
        return f"exit code {done.returncode} {done.stderr[-2000:]}"
    lines = [line.rsplit(" ", 2) for line in done.stdout.splitlines()]
    return {what: (float(total), bits) for what, total, bits in lines}


def symbols(path):
    """Of what a linker takes from one object for all."""
    told = subprocess.run(["nm", "--defined-only", path], capture_output=True, text=True, check=True).stdout
    return {name for _, kind, name in (line.split(maxsplit=2) for line in told.splitlines()) if kind in "WVu"}


def shared_code(one, other, program):
    """Functions that a linker takes of one object or of the other, in whose code the instruction set shows. The program is
    of the other: objdump takes a second for it, and minutes for an object of thousands of sections."""
    shared, found, name = symbols(one) & symbols(other), set(), None
    if not shared:
        sys.exit(f"{one} and {other} share nothing: they should share standard templates at least")
    if left_out := shared - symbols(program):
        sys.exit(f"{program} has not all of {other}: {sorted(left_out)[0]}")
    told = subprocess.run(["objdump", "-d", "--no-show-raw-insn", program], capture_output=True, text=True, check=True)
    for line in told.stdout.splitlines():
        if head := re.match(r"[0-9a-f]+ <(.*)>:$", line):
            name = head[1]
        elif name in shared and re.search(r"\tvfn?m(add|sub)|%zmm|%k[0-7]", line) and "\tvmov" not in line:
            found.add(name)
    return sorted(found)


with tempfile.TemporaryDirectory() as temporary:
    folder = pathlib.Path(temporary)
    own = (a.march.removeprefix("-march=") or "none")
    libraries = [own] + [s for s in ("x86-64-v3", "native", "none") if s != own][:2 if every else 0]
    consumers = ["none"] + (["x86-64-v3"] if every else []) + ["native"] + (["nvcc"] if a.nvcc else [])

    run(a.cmake, "--install", a.build, "--prefix", folder / own)
    for library in libraries[1:]:
        binary = folder / f"build_{library}"
        run(a.cmake, "-S", a.source, "-B", binary, "-G", a.generator, f"-DCMAKE_CXX_COMPILER={a.cxx}",
            "-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_CXX_FLAGS_RELEASE=-O0 -DNDEBUG", f"-DGART_ARCH_FLAG={'' if library == 'none' else '-march=' + library}",
            "-DGART_CUDA=OFF", "-DGART_EMBREE=OFF", "-DGART_DISTRIBUTED=OFF",
            "-DGART_BUILD_PROGRAM=OFF", "-DGART_BUILD_EXAMPLES=OFF",
            "-DCMAKE_OPTIMIZE_DEPENDENCIES=ON",  # an archive waits for none that it only names
            "-DGART_BUILD_TESTS=OFF", f"-DGART_SANITIZE={'ON' if a.sanitize else 'OFF'}")
        run(a.cmake, "--build", binary, "--parallel", a.jobs, "--target", "gart_cpu", "gart_runtime", "gart_io")
    archives = {}
    for library in libraries:
        archives[library] = folder / "archives" / library
        archives[library].mkdir(parents=True)
        for name in ("libgart_cpu.a", "libgart_runtime.a", "libgart_io.a"):
            found = [*(folder / f"build_{library}").rglob(name), *(folder / own).rglob(name)]
            (archives[library] / name).symlink_to(found[0])

    binary = folder / "programs"
    run(a.cmake, "-S", project, "-B", binary, "-G", a.generator, f"-DCMAKE_PREFIX_PATH={folder / own}",
        f"-DCMAKE_CXX_COMPILER={a.cxx}", f"-DCONSUMERS={';'.join(consumers)}", "-DLEVELS=0;2",
        f"-DEVERY_DEGREE={'ON' if every else 'OFF'}",
        f"-DLIBRARIES={';'.join(str(path) for path in archives.values())}", f"-DCMAKE_CUDA_COMPILER={a.nvcc or ''}",
        f"-DCMAKE_CXX_FLAGS={'-fsanitize=address,undefined -fno-sanitize-recover=undefined' if a.sanitize else ''}")
    objects = [f"{c}_O{level}" for c in consumers for level in (0, 2)
               if (c != "nvcc" if level == 0 else every or c == ("nvcc" if a.nvcc else "none"))]
    programs = [f"templates_alone_{o}" for o in objects] + [f"library_alone_{l}" for l in libraries]
    both = [(l, o, f"both_{l}_{o}_{order}") for l in libraries for o in objects
            for order in ("library_first", "objects_first")]
    programs += [name for _, _, name in both]
    run(a.cmake, "--build", binary, "--parallel", a.jobs, "--target", *programs)
    in_objects = {o: binary / "CMakeFiles" / f"templates_{o}_O0.dir" / "templates.cpp.o" for o in ("none", "native")}
    failures = [f"{name}: two instruction sets have code of this name, and it differs"
                for name in shared_code(in_objects["none"], in_objects["native"], binary / "templates_alone_native_O0")]
    failures += [f"{name}: not optimised, and its name does not say so (core/isa.hpp)" for name in symbols(in_objects["none"])
                 if re.search(r"\dv\d+_\d+_", name) and "_unoptimised" not in name]
    with concurrent.futures.ThreadPoolExecutor(int(a.jobs)) as pool:
        said = dict(zip(programs, pool.map(lambda name: values(binary / name), programs)))

for name in [p for p in programs if "_alone_" in p]:
    if not isinstance(said[name], dict):
        sys.exit(f"{name}: {said[name]}")
    # Instruction sets differ in roundings, and methods and policies too.
    for what, (total, _) in said[name].items():
        if not total > 0:
            failures.append(f"{name}: {what} is {total}")
for kind in ("templates_alone_", "library_alone_"):
    alone = [name for name in programs if name.startswith(kind)]
    for name in alone[1:]:
        for what in said[alone[0]].keys() & said[name].keys():
            total = said[alone[0]][what][0]
            if not abs(said[name][what][0] - total) <= 1e-3 * total:
                failures.append(f"{what}: {total} in {alone[0]}, {said[name][what][0]} in {name}")
for library, consumer, name in both:
    expected = {**said[f"templates_alone_{consumer}"], **said[f"library_alone_{library}"]}
    got = said[name]
    if not isinstance(got, dict):
        failures.append(f"{name}: {got}")
        continue
    wrong = [what for what in expected if got.get(what) != expected[what]]
    if wrong or len(got) != len(expected):
        what = wrong[0] if wrong else "count"
        failures.append(f"{name}: {len(wrong)} of {len(expected)} values differ, the first {what}: "
                        f"{got.get(what)} instead of {expected.get(what)}")
print("\n".join(failures) or
      f"{len(both)} programs of libraries for {', '.join(libraries)} and objects for {', '.join(consumers)}: "
      f"{len(said[both[0][2]])} values each are those of the parts alone")
sys.exit(1 if failures else 0)
