"""Charts as SVG files, for bench/plot.py: bars, stacked bars, lines, courses of a training and scatters."""
import math
import os
import textwrap

COLORS = ["#4269d0", "#efb118", "#ff725c", "#6cc5b0", "#3ca951", "#a463f2", "#97bbf5", "#9c6b4e", "#9498a0"]
INK, SOFT, GRID = "#1f2328", "#57606a", "#d8dee4"


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
    notes = textwrap.wrap(note, 118)
    svg = Svg(760, 386 + 14 * len(notes), title)
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
    for i, text in enumerate(notes):
        svg.text(20, 384 + 14 * i, text, size=11, color=SOFT)
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


def decade_ticks(low, high):
    """Round numbers between 10^low and 10^high."""
    steps = (1, 2, 3, 5, 7) if high - low < 1 else (1, 2, 5) if high - low < 2.3 else (1,)
    values = (m * 10.0 ** e for e in range(math.floor(low), math.ceil(high) + 1) for m in steps)
    return [v for v in values if low <= math.log10(v) <= high]


def courses(path, title, y_title, panels):
    """panels: [(label, [(series, [(step, value)])], note)], below each other, values over a logarithmic scale. Earlier
    series are drawn wider, so that those which lie on each other are all seen."""
    names = list(dict.fromkeys(name for _, series, _ in panels for name, _ in series))
    color = {name: COLORS[i % len(COLORS)] for i, name in enumerate(names)}
    width = {name: 1.4 + 3 * (len(names) - 1 - i) for i, name in enumerate(names)}
    svg = Svg(760, 80 + 340 * len(panels), title)
    svg.legend(20, 56, color.items())
    left, right = 70, 720
    for p, (label, series, note) in enumerate(panels):
        top, bottom = 110 + 340 * p, 340 + 340 * p
        points = [point for _, row in series for point in row]
        low, high = (math.log10(edge(value for _, value in points)) for edge in (min, max))
        low, high = low - 0.03, high + 0.03
        steps = ticks(max(step for step, _ in points))
        x_of = lambda v: left + (right - left) * v / steps[-1]
        y_of = lambda v: bottom - (bottom - top) * (math.log10(v) - low) / (high - low)
        for v in steps:
            svg.text(x_of(v), bottom + 18, f"{v:g}", anchor="middle", color=SOFT)
        for v in decade_ticks(low, high):
            svg.line(left, y_of(v), right, y_of(v))
            svg.text(left - 8, y_of(v) + 4, f"{v:g}", anchor="end", color=SOFT)
        svg.text(left, top - 12, f"{label}: {y_title}", color=SOFT)
        svg.text(right, bottom + 36, "step", anchor="end", color=SOFT)
        for name, row in series:
            at = " ".join(f"{x_of(step):.1f},{y_of(value):.1f}" for step, value in row)
            svg.add(f'<polyline points="{at}" fill="none" stroke="{color[name]}" stroke-width="{width[name]:.1f}" '
                    f'stroke-linejoin="round"><title>{text_of(name)}</title></polyline>')
        svg.text(20, bottom + 54, note, size=11, color=SOFT)
    svg.write(path)


def scatter(svg, top, points, x_title, y_title):
    """points: [(label, x, y, on the front)] over two logarithmic scales, in a panel 400 high that begins at `top`."""
    left, right, bottom = 80, 1010, top + 360
    xs, ys = [p[1] for p in points], [p[2] for p in points]
    spread = lambda values, room: (math.log10(min(values)) - room, math.log10(max(values)) + room)
    (x_low, x_high), (y_low, y_high) = spread(xs, 0.06), spread(ys, 0.2)
    x_of = lambda v: left + (right - left) * (math.log10(v) - x_low) / (x_high - x_low)
    y_of = lambda v: bottom - (bottom - top) * (math.log10(v) - y_low) / (y_high - y_low)

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
