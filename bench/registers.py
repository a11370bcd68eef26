#!/usr/bin/env python3
"""Registers and spilled bytes of the main kernels by row, as nvcc gives them; no GPU is needed.

    python3 bench/registers.py --nvcc nvcc --arch sm_90 --out bench/results/registers.json

Compiles bench/registers.cu with -Xptxas -v, writes the figures as JSON and prints them as a table.
"""
import argparse
import json
import os
import re
import subprocess
import sys
import tempfile

here = os.path.dirname(os.path.abspath(__file__))
parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--nvcc", default="nvcc")
parser.add_argument("--arch", default="sm_90")
parser.add_argument("--out", default=os.path.join(here, "results", "registers.json"))
a = parser.parse_args()

with tempfile.TemporaryDirectory() as folder:
    done = subprocess.run([a.nvcc, "-std=c++20", "--expt-relaxed-constexpr", "-diag-suppress=20012,554", "-Xptxas", "-v",
                           f"-arch={a.arch}", "-I", os.path.join(here, "..", "include"), "-cubin", "-o",
                           os.path.join(folder, "registers.cubin"), os.path.join(here, "registers.cu")],
                          capture_output=True, text=True)
if done.returncode != 0:
    sys.exit(f"{a.nvcc}: {done.stdout}{done.stderr}")
# Without the namespace of the instruction set (core/isa.hpp).
names = re.findall(r"Compiling entry function '(\S+)'", done.stderr)
plain = subprocess.run(["c++filt"], input="\n".join(names), capture_output=True, text=True, check=True).stdout
plain = re.sub(r"v\d+_\d+_\w+::", "", plain).split("\n")
figures = re.findall(r"(\d+) bytes stack frame, (\d+) bytes spill stores, (\d+) bytes spill loads\n.*?Used (\d+) registers",
                     done.stderr)
if not names or len(figures) != len(names):
    sys.exit(f"{a.nvcc}: says nothing that can be read of its kernels:\n{done.stderr[:2000]}")

rows = {}
for name, (stack, stores, loads, registers) in zip(plain, figures):
    sh = re.search(r"(?:composite|gather_row)<(\d)", name).group(1)
    response = re.search(r"generalized_gaussian<(\d)>", name)
    half = "gart::half_hit_entry" in name
    ordered = "(gart::gather_sums)1" in name
    row = (f"SH {sh}" + (f", kernel degree {response.group(1)}" if response.group(1) != "2" else "") +
           (", slots in half" if half else "") + (", ordered" if ordered else "") + (", depth" if "depth" in name else ""))
    kernel = "forward" if "walk_tile_warps" in name else "gather"
    rows.setdefault(row, {})[kernel] = {"registers": int(registers), "stack": int(stack),
                                        "spilled": int(stores) + int(loads)}
with open(a.out + ".part", "w") as f:
    json.dump({"what": "registers", "arch": a.arch, "rows": rows}, f, indent=1)
    f.write("\n")
os.replace(a.out + ".part", a.out)
print("| configuration | forward | gather |\n|---|---|---|")
for row in sorted(rows):
    cells = [rows[row].get(k) for k in ("forward", "gather")]
    text = [f"{c['registers']}" + (f", {c['spilled']} B spilled" if c["spilled"] else "") if c else "" for c in cells]
    print(f"| {row} | " + " | ".join(text) + " |")
