#!/usr/bin/env python3
"""Draws bench/results/*.json: charts into docs/figures/*.svg, tables into docs/*.md. Python 3 alone is needed.

    python3 bench/plot.py [--results bench/results] [--docs docs]

A table stands in the page between <!-- table NAME --> and <!-- end -->, and is replaced there. A result that is not
there leaves its chart and its table as they are; a result that names a failed measurement shows it as such.
"""
import argparse
import glob
import json
import os
import re

from charts import bars, lines

HERE = os.path.dirname(os.path.abspath(__file__))
METHODS = ("pixel", "hybrid", "primitive")


def table(header, rows):
    out = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return out + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]


def source(result):
    machine = result["machine"]
    return f"{machine.get('gpu', machine.get('cpu'))}, commit {result['commit']}, {result['date']}"


def backward_ms(run):
    return run.get("stages_ms", {}).get("backward")


class Pages:
    def __init__(self, results, docs):
        self.results, self.docs, self.tables = results, docs, {}

    def load(self, what):
        path = os.path.join(self.results, what + ".json")
        if not os.path.exists(path):
            print(f"{path}: not measured; left as it is")
            return None
        with open(path) as f:
            return json.load(f)

    def figure(self, name):
        return os.path.join(self.docs, "figures", name + ".svg")

    def methods(self):
        result = self.load("methods")
        if not result:
            return
        rows, good = [], [r for r in result["runs"] if "error" not in r]
        slowest = {(r["scene"], r["tracer"]): backward_ms(r) for r in good if r["backward"] == "pixel"}
        for run in result["runs"]:
            if "error" in run:
                rows.append([run["scene"], run["tracer"], run["backward"], "failed", "", "", "", "", ""])
                continue
            ms, pixel = backward_ms(run), slowest.get((run["scene"], run["tracer"]))
            rows.append([run["scene"], run["tracer"], run["backward"], f"{run['stages_ms'].get('forward', 0):.2f}",
                         f"{ms:.2f}", f"{pixel / ms:.1f}x" if pixel else "", f"{run['step_ms']:.2f}",
                         f"{run['hit_buffer_bytes'] / 1e9:.2f}", f"{run['peak_bytes'] / 1e9:.2f}"])
        first = good[0] if good else None
        size = f"{first['width']} x {first['height']}, mean of {first['views']} views" if first else ""
        self.tables["methods"] = table(
            ["scene", "tracer", "method", "forward, ms", "backward, ms", "against pixel", "step, ms", "hit buffer, GB",
             "peak, GB"], rows) + ["", f"{size}, medians of {first['repeats'] if first else 0}; {source(result)}."]
        if not good:
            return
        tracers = list(dict.fromkeys(r["tracer"] for r in good))
        scenes = list(dict.fromkeys(r["scene"] for r in good))
        pick = lambda scene, tracer: [r for s in METHODS for r in good
                                      if (r["scene"], r["tracer"], r["backward"]) == (scene, tracer, s)]
        bars(self.figure("backward"), "Backward pass by gradient method", "ms",
             [(f"{scene}, {tracer}", [(r["backward"], backward_ms(r)) for r in pick(scene, tracer)])
              for tracer in tracers for scene in scenes if pick(scene, tracer)], source(result))

    def memory(self):
        result = self.load("memory")
        series = {}
        for r in (result or {}).get("runs", []):
            if "error" not in r:
                kind = f"{r['backward']}, {r['width']} x {r['height']}"
                series.setdefault(kind, []).append((r["thousands"] / 1000, r["peak_bytes"] / 1e9))
        if series:
            lines(self.figure("peak_memory"), "Peak memory of a training step", "GB", "million Gaussians",
                  list(series.items()), source(result))

    def ranks(self):
        found = sorted(glob.glob(os.path.join(self.results, "ranks_*.json")))
        results = [r for r in (self.load(os.path.basename(path)[:-5]) for path in found) if "scene" in r]
        if not results:
            return
        groups = [(result["scene"].removesuffix(".ply"),
                   [(f"{r['ranks']} GPU{'s' * (r['ranks'] > 1)}, {r['what'].removeprefix('steps ')}", r["images_a_second"])
                    for r in result["runs"] if r["what"] == "steps alone" or
                    r["what"].startswith("steps") and r["ranks"] > 1]) for result in results]
        bars(self.figure("ranks"), "Images a second of training", "images a second", groups,
             "; ".join(dict.fromkeys(source(result) for result in results)))

    def leave_one_out(self):
        result = self.load("leave_one_out")
        if not result:
            return
        scores, names = {}, []
        for r in result["runs"]:
            scores.setdefault(r["capture"], {}).setdefault(r["setting"], []).append(r["psnr"])
            if r["setting"] not in names and not r["setting"].startswith("chosen"):
                names.append(r["setting"])
        tuned = {r["capture"]: r["tuned"] for r in result["summary"]}
        rows = []
        for capture, of in scores.items():
            means = {setting: sum(values) / len(values) for setting, values in of.items()}
            rows.append([capture, means["chosen"], tuned[capture]] + [means.get(n) for n in names])
        average = ["mean"] + [None if None in column else sum(column) / len(rows) for column in list(zip(*rows))[1:]]
        shown = lambda v: "-" if v is None else f"{v:.2f}"  # of runs that were not made
        cells = []
        for row in rows:
            best = max(v for v in row[3:] if v is not None)
            cells.append([row[0]] + [shown(v) for v in row[1:3]] +
                         [f"**{shown(v)}**" if v == best else shown(v) for v in row[3:]])
        cells.append([average[0]] + [shown(v) for v in average[1:]])
        letters = {"exposure": "E", "vignetting": "V", "twentieth": "T", "pixels 100": "P", "match": "M", "usual": "usual"}
        short = [" ".join(letters[part] for part in n.split(", ")) for n in names]
        self.tables["leave_one_out"] = table(["capture", "as chosen", "tuned on the others"] + short, cells)

    def write_tables(self):
        for path in sorted(glob.glob(os.path.join(self.docs, "*.md"))):
            with open(path) as f:
                page = before = f.read()
            for name, rows in list(self.tables.items()):
                page, found = re.subn(rf"(<!-- table {name} -->\n).*?(<!-- end -->)",
                                      lambda m: m.group(1) + "\n".join(rows) + "\n" + m.group(2), page,
                                      flags=re.DOTALL)
                if found:
                    del self.tables[name]
            if page == before:
                continue
            with open(path + ".part", "w") as f:
                f.write(page)
            os.replace(path + ".part", path)
            print("wrote", path)
        for name in self.tables:
            print(f"{self.docs}: no page has a place for the table {name}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--results", default=os.path.join(HERE, "results"))
    parser.add_argument("--docs", default=os.path.join(os.path.dirname(HERE), "docs"))
    a = parser.parse_args()
    pages = Pages(a.results, a.docs)
    pages.methods()
    pages.memory()
    pages.ranks()
    pages.leave_one_out()
    pages.write_tables()


if __name__ == "__main__":
    main()
