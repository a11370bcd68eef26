#!/usr/bin/env python3
"""Draws bench/results/*.json: charts into docs/figures/*.svg, tables into docs/*.md. Python 3 alone is needed.

    python3 bench/plot.py [--results bench/results] [--docs docs]

A table stands in the page between <!-- table NAME --> and <!-- end -->, and is replaced there. A result that is not
there leaves its chart and its table as they are; a result that names a failed measurement shows it as such.
"""
import argparse
import glob
import json
import math
import os
import re

HERE = os.path.dirname(os.path.abspath(__file__))
COLORS = ["#4269d0", "#efb118", "#ff725c", "#6cc5b0", "#3ca951", "#a463f2", "#97bbf5", "#9c6b4e", "#9498a0"]
STRATEGIES = ("pixel", "hybrid", "primitive")
INK, SOFT, GRID = "#1f2328", "#57606a", "#d8dee4"

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


def text_of(value):
    return str(value).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def ticks(top, wanted=5):
    """Round numbers from 0 to at least `top`."""
    if top <= 0:
        return [0, 1]
    step = 10.0 ** len(str(int(top)))
    while top / step < wanted:
        for divisor in (2, 2.5, 2):
            if top / step >= wanted:
                break
            step /= divisor
    out = [0.0]
    while out[-1] < top:
        out.append(out[-1] + step)
    return out


class Svg:
    """A drawing on a light ground of its own, so that it reads on light and on dark pages."""

    def __init__(self, width, height, title):
        self.width, self.height, self.parts = width, height, []
        self.text(20, 30, title, size=16, weight="600")

    def add(self, markup):
        self.parts.append(markup)

    def text(self, x, y, value, size=12, anchor="start", color=INK, weight="400"):
        self.add(f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="{anchor}" fill="{color}" '
                 f'font-weight="{weight}">{text_of(value)}</text>')

    def line(self, x0, y0, x1, y1, color=GRID, width=1):
        self.add(f'<line x1="{x0:.1f}" y1="{y0:.1f}" x2="{x1:.1f}" y2="{y1:.1f}" stroke="{color}" '
                 f'stroke-width="{width}"/>')

    def bar(self, x, y, width, height, color, hint):
        self.add(f'<rect x="{x:.1f}" y="{y:.1f}" width="{max(width, 0):.1f}" height="{height:.1f}" fill="{color}">'
                 f"<title>{text_of(hint)}</title></rect>")

    def legend(self, x, y, entries):
        for name, color in entries:
            self.bar(x, y - 9, 11, 11, color, name)
            self.text(x + 16, y, name, color=SOFT)
            x += 34 + 7 * len(name)

    def write(self, path):
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path + ".part", "w") as f:
            f.write(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width} {self.height}" '
                    f'width="{self.width}" height="{self.height}" font-family="system-ui, sans-serif">\n'
                    f'<rect width="{self.width}" height="{self.height}" rx="8" fill="#ffffff" stroke="{GRID}"/>\n'
                    + "\n".join(self.parts) + "\n</svg>\n")
        os.replace(path + ".part", path)
        print("wrote", path)


def axis(svg, left, right, top, bottom, values, unit):
    """A vertical scale; returns the height of a value."""
    y_of = lambda v: bottom - (bottom - top) * v / values[-1]
    for v in values:
        svg.line(left, y_of(v), right, y_of(v))
        svg.text(left - 8, y_of(v) + 4, f"{v:g}", anchor="end", color=SOFT)
    svg.text(left, top - 12, unit, color=SOFT)
    return y_of


def bars(path, title, unit, groups, note):
    """groups: [(label, [(series, value)])]; a bar each, side by side."""
    series = list(dict.fromkeys(name for _, row in groups for name, _ in row))
    color = {name: COLORS[i % len(COLORS)] for i, name in enumerate(series)}
    svg = Svg(760, 400, title)
    svg.legend(20, 56, color.items())
    y_of = axis(svg, 70, 740, 104, 330, ticks(max(v for _, row in groups for _, v in row)), unit)
    share = 670 / len(groups)
    for g, (label, row) in enumerate(groups):
        width = min(70, 0.75 * share / len(row))
        x = 70 + share * (g + 0.5) - width * len(row) / 2
        for name, value in row:
            svg.bar(x + 2, y_of(value), width - 4, y_of(0) - y_of(value), color[name],
                    f"{label}, {name}: {value:.3g} {unit}")
            svg.text(x + width / 2, y_of(value) - 5, f"{value:.3g}", size=11, anchor="middle")
            x += width
        svg.text(70 + share * (g + 0.5), 352, label, anchor="middle")
    svg.text(20, 384, note, size=11, color=SOFT)
    svg.write(path)


def stacked(path, title, unit, rows, note):
    """rows: [(label, [(part, value)])]; one horizontal bar a row."""
    names = list(dict.fromkeys(name for _, parts in rows for name, value in parts if value > 0))
    color = {name: COLORS[i % len(COLORS)] for i, name in enumerate(names)}
    height = 120 + 40 * len(rows) + 50
    svg = Svg(860, height, title)
    svg.legend(20, 56, color.items())
    values = ticks(max(sum(v for _, v in parts) for _, parts in rows))
    left, right, top, bottom = 210, 780, 80, 80 + 40 * len(rows)
    x_of = lambda v: left + (right - left) * v / values[-1]
    for v in values:
        svg.line(x_of(v), top, x_of(v), bottom)
        svg.text(x_of(v), bottom + 18, f"{v:g}", anchor="middle", color=SOFT)
    svg.text(right + 12, bottom + 18, unit, color=SOFT)
    for r, (label, parts) in enumerate(rows):
        y, at = top + 40 * r + 8, 0.0
        svg.text(left - 10, y + 17, label, anchor="end")
        for name, value in parts:
            if value > 0:
                svg.bar(x_of(at), y, x_of(at + value) - x_of(at), 24, color[name],
                        f"{label}, {name}: {value:.3g} {unit}")
                at += value
        svg.text(x_of(at) + 6, y + 17, f"{at:.3g}", size=11)
    svg.text(20, height - 16, note, size=11, color=SOFT)
    svg.write(path)


def lines(path, title, unit, x_title, series, note):
    """series: [(name, [(x, y)])]."""
    svg = Svg(760, 420, title)
    color = {name: COLORS[i % len(COLORS)] for i, (name, _) in enumerate(series)}
    svg.legend(20, 56, color.items())
    points = [p for _, row in series for p in row]
    y_of = axis(svg, 70, 720, 104, 330, ticks(max(y for _, y in points)), unit)
    low, high = min(x for x, _ in points), max(x for x, _ in points)
    x_of = lambda x: 90 + 610 * (x - low) / max(high - low, 1e-9)
    for x in sorted({x for x, _ in points}):
        svg.text(x_of(x), 350, f"{x:g}", anchor="middle", color=SOFT)
    svg.text(395, 372, x_title, anchor="middle", color=SOFT)
    for name, row in series:
        path_of = " ".join(f"{x_of(x):.1f},{y_of(y):.1f}" for x, y in sorted(row))
        svg.add(f'<polyline points="{path_of}" fill="none" stroke="{color[name]}" stroke-width="2"/>')
        for x, y in row:
            svg.add(f'<circle cx="{x_of(x):.1f}" cy="{y_of(y):.1f}" r="3.5" fill="{color[name]}">'
                    f"<title>{text_of(name)}: {x:g} M, {y:.3g} {unit}</title></circle>")
    svg.text(20, 404, note, size=11, color=SOFT)
    svg.write(path)


def scatter(svg, top, points, x_title, y_title):
    """points: [(label, x, y, on the front)] over two logarithmic scales, in a panel 400 high that begins at `top`."""
    left, right, bottom = 80, 1010, top + 360
    xs, ys = [p[1] for p in points], [p[2] for p in points]
    spread = lambda values, room: (math.log10(min(values)) - room, math.log10(max(values)) + room)
    (x_low, x_high), (y_low, y_high) = spread(xs, 0.06), spread(ys, 0.2)
    x_of = lambda v: left + (right - left) * (math.log10(v) - x_low) / (x_high - x_low)
    y_of = lambda v: bottom - (bottom - top) * (math.log10(v) - y_low) / (y_high - y_low)

    def decade_ticks(low, high):
        steps = (1, 2, 3, 5, 7) if high - low < 1 else (1, 2, 5) if high - low < 2.3 else (1,)
        values = (m * 10.0 ** e for e in range(math.floor(low), math.ceil(high) + 1) for m in steps)
        return [v for v in values if low <= math.log10(v) <= high]

    for v in decade_ticks(x_low, x_high):
        svg.line(x_of(v), top, x_of(v), bottom)
        svg.text(x_of(v), bottom + 18, f"{v:g}", anchor="middle", color=SOFT)
    for v in decade_ticks(y_low, y_high):
        svg.line(left, y_of(v), right, y_of(v))
        svg.text(left - 8, y_of(v) + 4, f"{v:g}", anchor="end", color=SOFT)
    svg.text(right, bottom + 36, x_title, anchor="end", color=SOFT)
    svg.text(left, top - 10, y_title, color=SOFT)

    front = sorted((p for p in points if p[3]), key=lambda p: p[1])
    corners = [(x_of(front[0][1]), y_of(front[0][2]))]
    for _, x, y, _ in front[1:]:
        corners += [(x_of(x), corners[-1][1]), (x_of(x), y_of(y))]
    svg.add(f'<polyline points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in corners)}" fill="none" '
            f'stroke="{COLORS[0]}" stroke-width="1.6"/>')
    taken = []
    for label, x, y, on_front in sorted(points, key=lambda p: p[3]):
        taken.append((x_of(x) - 4, y_of(y) - 4, x_of(x) + 4, y_of(y) + 4))
        svg.add(f'<circle cx="{x_of(x):.1f}" cy="{y_of(y):.1f}" r="4" fill="{COLORS[0] if on_front else "#b9c0c6"}">'
                f"<title>{text_of(label)}: {x:.3g} ms, error {y:.2g}</title></circle>")
    # The front chooses the places of its labels first; further off, a thin line leads to the point.
    for label, x, y, on_front in sorted(points, key=lambda p: (not p[3], p[1])):
        at, width = (x_of(x), y_of(y)), 6.3 * len(label)
        for reach in (8, 20, 36, 56, 80, 110) if on_front else (8, 20, 36):
            for across, down in ((1, 0), (-1, 0), (1, -1), (1, 1), (-1, -1), (-1, 1), (0, -1), (0, 1)):
                end = (at[0] + across * reach, at[1] + down * reach)
                x0 = end[0] if across > 0 else end[0] - width if across < 0 else end[0] - width / 2
                box = (x0, end[1] - 7, x0 + width, end[1] + 7)
                if box[0] < left or box[2] > right + 40 or box[1] < top or box[3] > bottom:
                    continue
                if any(box[0] < o[2] and o[0] < box[2] and box[1] < o[3] and o[1] < box[3] for o in taken):
                    continue
                break
            else:
                continue
            taken.append(box)
            if reach > 10:
                svg.line(*at, *end)
            svg.text(x0, end[1] + 4, label, size=11, color=INK if on_front else "#8b949e")
            break


def table(header, rows):
    out = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return out + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]


def clock_of(tradeoff):
    return "processor_ms" if tradeoff["clock"] == "processor" else "total_ms"


def source(result):
    machine = result["machine"]
    return f"{machine.get('gpu', machine['cpu'])}, commit {result['commit']}, {result['date']}"


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
                points = [(r["name"], r[time], error(r), r["front"][which]) for r in runs if error(r)]
                scatter(svg, top, points, unit, title)
            svg.text(20, 940, source(result), size=11, color=SOFT)
            svg.write(self.figure("tradeoff_" + name))
            worst = lambda r: max(r["gradients"], key=lambda group: r["gradients"][group] or 0)
            marks = lambda r: "".join(mark for mark, which in (("i", "image"), ("g", "gradients")) if r["front"][which])
            rows = [[f"`{r['name']}`", marks(r), f"{r['image']['max']:.1e}", f"{r['image']['psnr']:.1f}",
                     f"{r['gradient_worst']:.1e} ({worst(r)})", f"{r['prepare_ms']:.1f}", f"{r['forward_ms']:.1f}",
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

    def presets(self):
        rows = []
        for path in sorted(glob.glob(os.path.join(self.results, "presets_*.json"))):
            result = self.load(os.path.basename(path)[:-5])
            trade = self.load("tradeoff_" + result["scene"])
            of = {r["name"].replace("preset=", ""): r for r in trade["runs"]} if trade else {}
            for r in result["runs"]:
                a, t = r["approximations"], of.get(r["preset"])
                rows.append([result["scene"], r["preset"], f"{a['alpha_min']:.3g}", f"{a['t_min']:.3g}"] +
                            ([f"{t['image']['psnr']:.1f}", f"{t['gradient_worst']:.1e}", f"{t[clock_of(trade)]:.1f}"] if t
                             else ["", "", ""]) +
                            [f"{r['psnr']:.2f}", f"{r['ssim']:.4f}", f"{r['seconds']:.0f}", f"{r['gaussians']:,}"])
            rows.append([f"{result['scene']}: {source(result)}"] + [""] * 10)
        if rows:
            self.tables["presets"] = table(["scene", "preset", "alpha_min", "t_min", "image PSNR, dB",
                                            "gradient, worst group", "a view, ms", "trained PSNR, dB", "SSIM",
                                            "training, s", "Gaussians"], rows)

    def auto(self):
        rows = []
        for path in sorted(glob.glob(os.path.join(self.results, "auto_*.json"))):
            result = self.load(os.path.basename(path)[:-5])
            runs = [r for r in result["runs"] if "error" not in r]
            full = {r["seed"]: r for r in runs if r["mode"] == "--no-auto"}
            for r in runs:
                base = full.get(r["seed"], {})
                change = f"{r['psnr'] - base['psnr']:+.3f}" if r["mode"] == "--auto" and base else ""
                gains = ", ".join(f"{t['band']}: {t['gain']:+.3f} ({t['forecast']:+.3f})" for t in r["sh_trials"])
                rows.append([result["capture"], "full" if r["mode"] == "--no-auto" else "auto", r["sh_degree"],
                             r["floats_per_gaussian"], f"{r['psnr']:.3f}", change, f"{r['seconds']:.0f}",
                             f"{r['cpu_seconds']:.0f}", f"{r['model_bytes'] / 1e3:,.0f}",
                             f"{r['checkpoint_bytes'] / 1e3:,.0f}", f"{r['peak_bytes'] / 1e6:.1f}", gains])
            first = runs[0] if runs else {}
            rows.append([f"{result['capture']}: {first.get('image_size', '')}, {first.get('options', '')}; "
                         f"{first.get('backend', '')}, {source(result)}"] + [""] * 11)
        if rows:
            self.tables["auto"] = table(["capture", "model", "SH", "floats", "PSNR, dB", "against full", "training, s",
                                         "CPU, s", "PLY, kB", "checkpoint, kB", "peak, MB",
                                         "bands tried: gain (forecast), dB"], rows)

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
    pages.tradeoff()
    pages.presets()
    pages.auto()
    pages.write_tables()


if __name__ == "__main__":
    main()
