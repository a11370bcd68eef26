"""Charts as SVG files, for bench/plot.py: bars and lines."""
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
