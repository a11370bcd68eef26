"""Compiles every case of cases/ twice. With GART_WHOLE it is a model of a concept, and has to compile: in one file
with the others, each in a namespace of its own, where it instantiates nothing of gart by name. Without, one member of it is
missing or misspelt: it must not compile, and the message has to name the member. A case is one file:

    // expects: P::row_floats       what the message has to say; `a or b`: of two compilers
    #ifdef GART_WHOLE
      static constexpr int row_floats = 3;
    #else
      static constexpr int row_float = 3;
    #endif

First the check shows that it would see a case that compiles, one that fails for another reason, and one that is no model.
"""
import argparse
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys
import tempfile

FLAGS = ["-std=c++20", "-Wall", "-Wextra", "-fopenmp", "-ffp-contract=off", "-fsyntax-only"]
EXPECTS = re.compile(r"^// expects: (.+)$", re.M)
INSTANTIATES = re.compile(r"^ *template (?:class|struct) ", re.M)
MESSAGE = re.compile(r"^\S+:\d+:\d+: +(?:\w+ )?(?:error|note): (.*)$", re.M)


def compiled(cxx, include, source, *options):
    return subprocess.run([cxx, *FLAGS, *options, f"-I{include}", str(source)], capture_output=True, text=True,
                          env={**os.environ, "LC_ALL": "C"})


def whole_complaint(cxx, include, cases):
    """What the compiler says of the cases with all their members; empty where nothing."""
    lines = sorted({line for case in cases for line in re.findall(r"^#include <.+>$", case.read_text(), re.M)})
    for case in cases:
        included = [f'#include "{case}"']
        lines += [f"namespace whole_{case.stem} {{", *included, "}"] if len(cases) > 1 else included
    with tempfile.TemporaryDirectory() as folder:
        source = pathlib.Path(folder) / "whole.cpp"
        source.write_text("\n".join(lines) + "\n")
        done = compiled(cxx, include, source, "-DGART_WHOLE")
    return f"a case does not compile with all its members\n{done.stderr}" if done.returncode else ""


def complaint(cxx, include, case):
    """What is wrong with a case; empty where nothing is."""
    expected = EXPECTS.search(case.read_text())
    if not expected:
        return f"{case}: has no line `// expects: NAME`"

    broken = compiled(cxx, include, case)
    if not broken.returncode:
        return f"{case}: compiles without {expected[1]}"
    if not any(name in message for name in expected[1].split(" or ") for message in MESSAGE.findall(broken.stderr)):
        return f"{case}: fails without {expected[1]}, and the message does not name it\n{broken.stderr}"
    return ""


def self_check(cxx, include):
    fine = "// expects: t.x\n#include <concepts>\ntemplate <class T> concept has_x = requires(T t) { t.x; };\n"
    seen = {"static_assert(true);": "compiles without", "#ifndef GART_WHOLE\n#error else\n#endif": "does not name it",
            "struct a {};\nstatic_assert(has_x<a>);": "with all its members",
            "struct a {\n#ifdef GART_WHOLE\nint x;\n#endif\n};\nstatic_assert(has_x<a>);": ""}
    for text, expected in seen.items():
        with tempfile.TemporaryDirectory() as folder:
            case = pathlib.Path(folder) / "case.cpp"
            case.write_text(fine + text + "\n")
            said = whole_complaint(cxx, include, [case]) or complaint(cxx, include, case)
        if (expected not in said) if expected else said:
            sys.exit(f"the check itself is broken: of a case with\n{text}\nit says `{said}`, not `{expected}`")


parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("include")
parser.add_argument("--cxx", required=True)
arguments = parser.parse_args()
self_check(arguments.cxx, arguments.include)
cases = sorted((pathlib.Path(__file__).parent / "cases").glob("*.cpp"))
with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
    alone = [case for case in cases if INSTANTIATES.search(case.read_text())]
    together = [[case for case in cases if case not in alone], *([case] for case in alone)]
    whole = [pool.submit(whole_complaint, arguments.cxx, arguments.include, some) for some in together]
    found = [c for c in pool.map(lambda case: complaint(arguments.cxx, arguments.include, case), cases) if c]
    found += [c for job in whole if (c := job.result())]
print("\n".join(found) or f"{len(cases)} cases: each is refused for what it lacks, by name")
sys.exit(1 if found else 0)
