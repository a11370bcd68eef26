#!/usr/bin/env python3
"""Writes teapot.obj: a pot of turned profiles, a spout and a handle. It stands on y = 0, one unit high."""
import math
import sys


def spline(points, t):
    """Catmull-Rom through the points, t in [0, 1]."""
    s = t * (len(points) - 1)
    k = min(int(s), len(points) - 2)
    t = s - k
    p0, p1, p2, p3 = points[max(k - 1, 0)], points[k], points[k + 1], points[min(k + 2, len(points) - 1)]
    return [b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)))
            for a, b, c, d in zip(p0, p1, p2, p3)]


def turned(profile):
    """(radius, height) about y."""
    def at(u, v):
        r, y = spline(profile, v)
        return r * math.sin(2 * math.pi * u), y, r * math.cos(2 * math.pi * u)
    return at


def tube(path):
    """(x, y, radius) in the plane z = 0."""
    def at(u, v):
        x, y, r = spline(path, v)
        a, b = spline(path, max(v - 1e-3, 0)), spline(path, min(v + 1e-3, 1))
        dx, dy = b[0] - a[0], b[1] - a[1]
        length = math.hypot(dx, dy)
        c, s = r * math.cos(2 * math.pi * u), r * math.sin(2 * math.pi * u)
        return x - c * dy / length, y + c * dx / length, s
    return at


def normal(at, u, v):
    """Across both parameters; where a profile meets its axis, along that."""
    h = 1e-3
    v = min(max(v, 2 * h), 1 - 2 * h)
    low, high = v - h, v + h
    a = [x - y for x, y in zip(at(u + h, (low + high) / 2), at(u - h, (low + high) / 2))]
    b = [x - y for x, y in zip(at(u, high), at(u, low))]
    n = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    length = math.hypot(*n)
    return [x / length for x in n]


parts = [  # the surface, steps around it and along it
    (turned([(0, 0), (.33, 0), (.36, .03), (.52, .2), (.55, .36), (.46, .55), (.34, .66), (.32, .7), (.29, .7)]), 28, 18),
    (turned([(.31, .69), (.28, .73), (.12, .81), (.05, .84), (.07, .9), (.1, .95), (.05, 1), (0, 1)]), 20, 12),
    (tube([(.42, .22, .14), (.62, .28, .12), (.75, .48, .08), (.86, .68, .06), (.96, .74, .075)]), 12, 10),
    (tube([(-.4, .6, .05), (-.62, .66, .05), (-.84, .56, .05), (-.82, .36, .05), (-.66, .2, .05), (-.44, .16, .05)]), 10, 16),
]
with open(sys.argv[1] if len(sys.argv) > 1 else 'teapot.obj', 'w') as out:
    out.write('# of teapot.py\n')
    places = ['']  # OBJ counts from 1
    for surface, around, along in parts:
        first = len(places)
        for j in range(along + 1):
            for i in range(around):
                places.append('%.3f %.3f %.3f' % tuple(round(x, 3) + 0.0 for x in surface(i / around, j / along)))
                out.write('v ' + places[-1] + '\nvn %.2f %.2f %.2f\n' % tuple(normal(surface, i / around, j / along)))
        for j in range(along):
            for i in range(around):
                a, b = first + j * around + i, first + j * around + (i + 1) % around
                corners = {places[c]: c for c in (a, b, b + around, a + around)}.values()  # on the axis two are one
                out.write('f ' + ' '.join('%d//%d' % (c, c) for c in corners) + '\n')
