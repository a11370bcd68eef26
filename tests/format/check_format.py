"""Holds the sources to .clang-format, and first shows that it would see one that is not formatted.

Versions of clang-format differ in what they make of one file: it has to be version 14, as `clang-format-14` or as
`clang-format`. Without it the test is skipped (77).
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys

FOLDERS = ("include", "src", "backends", "program", "examples", "tests", "bench")
SUFFIXES = {".hpp", ".cuh", ".cpp", ".cu", ".h"}
VERSION = 14


def find_program():
    for name in (f"clang-format-{VERSION}", "clang-format"):
        if path := shutil.which(name):
            said = subprocess.run([path, "--version"], capture_output=True, text=True, check=True).stdout
            if (version := re.search(r"version (\d+)", said)) and int(version[1]) == VERSION:
                return path
    return None


def check(program, arguments, text=None):
    """Its exit status, and what it says of lines that are not formatted."""
    process = subprocess.Popen([program, "--dry-run", "-Werror", *arguments], stdin=subprocess.PIPE,
                               stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    errors = process.communicate(text)[1]
    return process.returncode, errors


root = pathlib.Path(sys.argv[1])
program = find_program()
if not program:
    print(f"skipped: there is no clang-format {VERSION}")
    sys.exit(77)
style = f"--assume-filename={root / 'include' / 'x.hpp'}"
if check(program, [style], "int  a ;\n")[0] == 0 or check(program, [style], "int a;\n")[0] != 0:
    sys.exit("the check itself is broken: it cannot tell `int  a ;` from `int a;`")

files = sorted(path for folder in FOLDERS for path in (root / folder).rglob("*")
               if path.suffix in SUFFIXES and not path.is_relative_to(root / "tests" / "fuzz" / "corpus"))
wrong, errors = check(program, [os.fspath(path) for path in files])
if wrong:
    found = sorted(set(re.findall(r"^(.+?):\d+:\d+: error: ", errors, re.M)))
    print("\n".join(found) or errors)
    print(f"{len(found)} of {len(files)} files are not formatted: run {program} -i on them")
    sys.exit(1)
print(f"{len(files)} files follow .clang-format")
