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

from charts import SOFT, Svg, bars, lines, scatter, stacked
from tables import clock_of, formats, ranks, source, table, viewed_training, viewer
from training_pages import TrainingPages

HERE = os.path.dirname(os.path.abspath(__file__))
STRATEGIES = ("pixel", "hybrid", "primitive")

# The parts of a step and the stages that make them up: stages nest, so each part names the outermost ones.
COMPONENTS = (
    ("preprocess", r"preprocess"),
    ("footprint, scan", r"footprint|scan"),
    ("tile maps", r"map"),
    ("BVH", r"bvh/boxes|bvh build"),
    ("clear LT", r"clear"),
    ("forward", r"forward"),
    ("loss", r"loss_.*"),
    ("backward", r"backward"),
    ("Adam", r"adam"),
)


def components(run):
    stages = run.get("stages_ms", {})
    return [(name, sum(ms for label, ms in stages.items() if re.fullmatch(pattern, label)))
            for name, pattern in COMPONENTS]


def backward_ms(run):
    return run.get("stages_ms", {}).get("backward")


class Pages(TrainingPages):
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

    def strategies(self):
        result = self.load("strategies")
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
                         f"{run['lt_bytes'] / 1e9:.2f}", f"{run['peak_bytes'] / 1e9:.2f}"])
        first = good[0] if good else None
        size = f"{first['width']} x {first['height']}, mean of {first['views']} views" if first else ""
        self.tables["strategies"] = table(
            ["scene", "tracer", "strategy", "forward, ms", "backward, ms", "against pixel", "step, ms", "LT, GB",
             "peak, GB"], rows) + ["", f"{size}, medians of {first['repeats'] if first else 0}; {source(result)}."]
        if not good:
            return
        tracers = list(dict.fromkeys(r["tracer"] for r in good))
        scenes = list(dict.fromkeys(r["scene"] for r in good))
        pick = lambda scene, tracer: [r for s in STRATEGIES for r in good
                                      if (r["scene"], r["tracer"], r["backward"]) == (scene, tracer, s)]
        bars(self.figure("backward"), "Backward pass by strategy", "ms",
             [(f"{scene}, {tracer}", [(r["backward"], backward_ms(r)) for r in pick(scene, tracer)])
              for tracer in tracers for scene in scenes if pick(scene, tracer)], source(result))
        for tracer in tracers:
            stacked(self.figure(f"step_{tracer}"), f"A training step by its parts, {tracer} tracer", "ms",
                    [(f"{scene}, {r['backward']}", components(r)) for scene in scenes for r in pick(scene, tracer)],
                    source(result))

    # Runs of `strategies` with others than the three: bench/run.py --backwards deterministic,recomputed.
    def variants(self):
        result = self.load("variants")
        if not result:
            return
        rows = [[r["scene"], r["backward"], f"{backward_ms(r):.2f}", f"{r['stages_ms'].get('clear', 0):.2f}",
                 f"{r['step_ms']:.2f}"] for r in result["runs"] if "error" not in r]
        self.tables["variants"] = table(["scene", "strategy", "backward, ms", "clear, ms", "step, ms"],
                                        rows) + ["", f"{source(result)}; in that commit `primitive` is `cleared`."]

    def counters(self):
        result = self.load("counters")
        if not result:
            return
        rows = [[r["kernel"], f"{r['ms']:.2f}", f"{r['sm_percent']:.0f}%", f"{r['dram_percent']:.0f}%",
                 f"{r['l1_hit_percent']:.0f}%", f"{r['occupancy_percent']:.0f}%",
                 f"{r['stall_cycles']:.1f} of {r['cycles_per_instruction']:.1f}"] for r in result["runs"]]
        self.tables["counters"] = table(["kernel", "time, ms", "SM", "DRAM", "L1 hits", "occupancy",
                                         "cycles an instruction waiting for loads"], rows) + ["", f"{source(result)}."]

    def memory(self):
        result = self.load("memory")
        if not result:
            return
        good = [r for r in result["runs"] if "error" not in r]
        self.tables["memory"] = table(
            ["scene", "image", "strategy", "LT, GB", "peak, GB"],
            [[r["scene"], f"{r['width']} x {r['height']}", r["backward"], f"{r['lt_bytes'] / 1e9:.2f}",
              f"{r['peak_bytes'] / 1e9:.2f}"] if "error" not in r else
             [r["scene"], f"scale {r['scale']}", r["backward"], "failed", ""] for r in result["runs"]]
        ) + ["", f"First camera; {source(result)}."]
        if not good:
            return
        for field, name, title in (("lt_bytes", "lt_memory", "LT buffer against the number of Gaussians"),
                                   ("peak_bytes", "peak_memory", "Peak memory of a training step")):
            series = {}
            for r in good:
                kind = f"{r['backward']}, {r['width']} x {r['height']}"
                series.setdefault(kind, []).append((r["thousands"] / 1000, r[field] / 1e9))
            lines(self.figure(name), title, "GB", "million Gaussians", list(series.items()), source(result))

    def stages(self):
        result = self.load("stages")
        if not result:
            return
        times = {r["name"].rsplit("/", 1)[0]: r["milliseconds"] for r in result["runs"] if not r.get("error_occurred")}
        self.tables["stages"] = table(["stage", "ms"], [[f"`{name}`", f"{ms:.3f}"] for name, ms in times.items()]) + [
            "", f"{result['scene']}, {result['image']}; {source(result)}."]
        parts = (("tile map", "tile_map/{}/depth"), ("traversal", "trace/tiles/{}"),
                 ("backward", "backward/tiles/primitive/{}"))
        groups = [(f"{size} x {size}", [(name, times[pattern.format(size)]) for name, pattern in parts
                                        if pattern.format(size) in times]) for size in (4, 8, 16)]
        groups = [g for g in groups if g[1]]
        if groups:
            bars(self.figure("tile_size"), f"Tile size, primitive strategy, {result['scene']}", "ms", groups,
                 source(result))

    def cpu(self):
        result = self.load("cpu")
        if not result:
            return
        rows = {}
        for r in result["runs"]:
            name, policy = r["name"].rsplit("/", 1)
            rows.setdefault(name, {})[policy] = r["milliseconds"]
        shown = lambda row, policy: f"{row[policy]:.2f}" if row.get(policy) is not None else ""
        self.tables["cpu"] = table(
            ["stage", "serial, ms", "openmp, ms"],
            [[f"`{name}`", shown(row, "serial"), shown(row, "openmp")] for name, row in rows.items()]
        ) + ["", f"{result['scene']}, {result['image']}, {result['machine']['cores']} cores; {source(result)}."]

    def tradeoff(self):
        sections, uncut = [], []
        for path in sorted(glob.glob(os.path.join(self.results, "tradeoff_*.json"))):
            result = self.load(os.path.basename(path)[:-5])
            name, runs = result["scene"], result["runs"]
            exact = runs[0]
            size = f"{result['width']} x {result['height']}"
            by_processor = result["clock"] == "processor"
            time = clock_of(result)
            unit = f"forward and backward, ms {'of all threads ' if by_processor else ''}a view"
            subject = f"{name}: {result['gaussians']:,} Gaussians, {size}, {result['backend']}"
            svg = Svg(1060, 960, subject)
            for top, which, title, error in (
                    (90, "image", "root mean square error of the colour", lambda r: r["image"]["rms"]),
                    (510, "gradients", "relative error of the gradient, worst group", lambda r: r["gradient_worst"])):
                points = [(r["name"], r[time], error(r), r["front"][which]) for r in runs if error(r)]  # none of a format
                scatter(svg, top, points, unit, title)
            svg.text(20, 940, source(result), size=11, color=SOFT)
            svg.write(self.figure("tradeoff_" + name))
            worst = lambda r: max(r["gradients"], key=lambda group: r["gradients"][group] or 0)
            gradient = lambda r: f"{r['gradient_worst']:.1e} ({worst(r)})" if r["gradient_worst"] is not None else "-"
            marks = lambda r: "".join(mark for mark, which in (("i", "image"), ("g", "gradients")) if r["front"][which])
            rows = [[f"`{r['name']}`", marks(r), f"{r['image']['max']:.1e}", f"{r['image']['psnr']:.1f}",
                     gradient(r), f"{r['prepare_ms']:.1f}", f"{r['forward_ms']:.1f}",
                     f"{r['backward_ms']:.1f}", f"{r['total_ms']:.1f}", f"{r['processor_ms']:.1f}", f"{exact[time] / r[time]:.2f}x",
                     f"{r['lt_bytes'] / 1e6:.1f}", f"{r['peak_bytes'] / 1e6:.0f}"] for r in runs]
            sections += [f"### {subject}", "", f"![Error against time, {name}](figures/tradeoff_{name}.svg)", ""]
            sections += table(["setting", "front", "image, max", "PSNR, dB", "gradient, worst group", "prepare, ms",
                               "forward, ms", "backward, ms", "total, ms", "processor, ms", "against exact", "LT, MB", "peak, MB"], rows)
            absent = ", ".join(f"`{a['name']}`" for a in result["absent"])
            sections += ["", f"{result['pixels']:,} pixels of {len(result['views'])} views, medians of "
                         f"{result['repeats']}; the whole run took {result['seconds']:.0f} s. "
                         + (f"Not compiled there: {absent}. " if absent else "") + source(result) + ".", ""]
            uncut += [[name, f"`{r['name']}`", f"{r['approximations']['alpha_min']:.4g}", f"{r['image']['max']:.1e}",
                       f"{r['image']['psnr']:.1f}", f"{r['gradient_worst']:.1e}"]
                      for r in sorted(result["uncut"]["settings"], key=lambda r: r["approximations"]["alpha_min"])]
        if sections:
            self.tables["tradeoff"] = sections
            self.tables["uncut"] = table(["scene", "setting", "alpha_min", "image, max", "PSNR, dB",
                                          "gradient, worst group"], uncut)

    def formats(self):
        found = sorted(glob.glob(os.path.join(self.results, "formats_*.json")))
        if found:
            self.tables["formats"] = formats([self.load(os.path.basename(path)[:-5]) for path in found])

    def ranks(self):
        found = sorted(glob.glob(os.path.join(self.results, "ranks_*.json")))
        results = [r for r in (self.load(os.path.basename(path)[:-5]) for path in found) if "scene" in r]
        if not results:
            return
        self.tables["ranks"] = ranks(results)
        groups = [(result["scene"].removesuffix(".ply"),
                   [(f"{r['ranks']} GPU{'s' * (r['ranks'] > 1)}, {r['what'].removeprefix('steps ')}", r["images_a_second"])
                    for r in result["runs"] if r["what"] == "steps alone" or
                    r["what"].startswith("steps") and r["ranks"] > 1]) for result in results]
        bars(self.figure("ranks"), "Images a second of training", "images a second", groups,
             "; ".join(dict.fromkeys(source(result) for result in results)))

    def viewer(self):
        found = sorted(glob.glob(os.path.join(self.results, "view_*.json")))
        results = [self.load(os.path.basename(path)[:-5]) for path in found]
        for name, make, trained in (("view", viewer, False), ("view_training", viewed_training, True)):
            some = [r for r in results if r["what"].startswith("view_training_") == trained]
            if some:
                self.tables[name] = make(some)

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
    pages.strategies()
    pages.variants()
    pages.counters()
    pages.memory()
    pages.stages()
    pages.cpu()
    pages.ranks()
    pages.tradeoff()
    pages.formats()
    pages.viewer()
    pages.cutoffs()
    pages.leave_one_out()
    pages.curves()
    pages.long()
    pages.write_tables()


if __name__ == "__main__":
    main()
