#!/usr/bin/env python3
"""Trains captures whose poses were disturbed, with and without `gart train --refine-poses`. Python 3 alone is needed.

    python3 bench/poses.py --gart build/program/gart --capture lego DIR --iterations 7000 -- --downscale 2

Every camera of a copy of the capture, test views too, is turned by --degrees about an axis drawn at random and shifted
by --share of the scene's extent in a direction drawn at random. Trainings: of the capture as it is and of the
copy, without and with --refine-poses (--runs takes fewer); disturbed_again trains the copy once more, from the poses
that disturbed_refined found (--poses). What is after -- goes to all of them.

The result, OUT/poses_NAME.json, has of each its scores, at the capture's poses and aligned, and of the poses that were
learned how far they are from the undisturbed: rotation in degrees and position in percent of the extent, after the
similarity that brings all of them nearest (the scene may move with its cameras). A capture's poses are themselves an
estimate: `from_clean_refined` is how far those of the copy are from what the capture's own became. Captures are
Blender's layout or COLMAP's binary files.
"""
import argparse
import json
import math
import os
import random
import shutil
import statistics
import struct
import sys
import tempfile

from common import command_line, commit_of, last_line, machine, now, run, write_json

RUNS = {"clean": (False, False), "clean_refined": (False, True), "disturbed": (True, False),
        "disturbed_refined": (True, True), "disturbed_again": (True, True)}


def matmul(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def apply(a, v):
    return [sum(a[i][k] * v[k] for k in range(3)) for i in range(3)]


def transposed(a):
    return [list(row) for row in zip(*a)]


def turn(w):
    angle = math.sqrt(sum(x * x for x in w))
    if angle == 0:
        return [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    x, y, z = (v / angle for v in w)
    c, s = math.cos(angle), math.sin(angle)
    k = 1 - c
    return [[c + x * x * k, x * y * k - z * s, x * z * k + y * s],
            [y * x * k + z * s, c + y * y * k, y * z * k - x * s],
            [z * x * k - y * s, z * y * k + x * s, c + z * z * k]]


def angles(r):
    side = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]]
    sine = 0.5 * math.sqrt(sum(x * x for x in side))
    angle = math.atan2(sine, 0.5 * (r[0][0] + r[1][1] + r[2][2] - 1))
    return [x * (angle / (2 * sine) if sine > 1e-12 else 0.5) for x in side]


def direction(source):
    v = [source.gauss(0, 1) for _ in range(3)]
    n = math.sqrt(sum(x * x for x in v))
    return [x / n for x in v]


def extent_of(positions):
    middle = [statistics.fmean(p[k] for p in positions) for k in range(3)]
    return 1.1 * max(math.dist(p, middle) for p in positions)


class Disturbance:
    """A pose (camera to world: rotation, position) to another."""

    def __init__(self, a, extent):
        self.source, self.angle, self.shift = random.Random(a.seed), math.radians(a.degrees), a.share * extent

    def __call__(self, rotation, position):
        w, t = direction(self.source), direction(self.source)
        return (matmul(turn([self.angle * x for x in w]), rotation),
                [p + self.shift * x for p, x in zip(position, t)])


def link_rest(source, to, but):
    os.makedirs(to)
    for name in os.listdir(source):
        if name not in but:
            os.symlink(os.path.abspath(os.path.join(source, name)), os.path.join(to, name))


def blender(a, source, to):
    """The training views' poses before and after, in the order of the files, and the extent."""
    files = [n for n in ("transforms_train.json", "transforms_test.json") if os.path.exists(os.path.join(source, n))]
    link_rest(source, to, files)
    pose = lambda f: ([row[:3] for row in f["transform_matrix"][:3]], [row[3] for row in f["transform_matrix"][:3]])
    with open(os.path.join(source, files[0])) as file:
        extent = extent_of([pose(f)[1] for f in json.load(file)["frames"]])
    disturb, before, after = Disturbance(a, extent), [], []
    for name in files:
        with open(os.path.join(source, name)) as file:
            transforms = json.load(file)
        for frame in transforms["frames"]:
            rotation, position = pose(frame)
            moved = disturb(rotation, position)
            frame["transform_matrix"] = [moved[0][i] + [moved[1][i]] for i in range(3)] + [[0, 0, 0, 1]]
            if name == files[0]:
                before.append((rotation, position))
                after.append(moved)
        with open(os.path.join(to, name), "w") as file:
            json.dump(transforms, file)
    # Blender's cameras look along -z, y up.
    opencv = lambda p: ([[row[0], -row[1], -row[2]] for row in p[0]], p[1])
    return [opencv(p) for p in before], [opencv(p) for p in after], extent


def quaternion_matrix(q):
    w, x, y, z = q
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]


def product(a, b):
    return [a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]]


def colmap(a, source, to):
    """As blender()."""
    sparse = next(s for s in ("sparse/0", "sparse") if os.path.exists(os.path.join(source, s, "images.bin")))
    with open(os.path.join(source, sparse, "images.bin"), "rb") as file:
        data = file.read()
    views, at = [], 8
    for _ in range(struct.unpack_from("<Q", data)[0]):
        start = at
        number, *numbers, camera = struct.unpack_from("<I7dI", data, at)
        end = data.index(b"\0", at + 64) + 1
        name = data[at + 64:end - 1].decode()
        at = end + 8 + 24 * struct.unpack_from("<Q", data, end)[0]
        views.append([name, number, numbers, camera, data[end:at]])
    views.sort()
    every = a.test_every
    is_test = lambda i: every and i % every == 0

    def camera_to_world(numbers):
        rotation = transposed(quaternion_matrix(numbers[:4]))
        return rotation, [-x for x in apply(rotation, numbers[4:])]

    poses = [camera_to_world(v[2]) for v in views]
    extent = extent_of([p[1] for i, p in enumerate(poses) if not is_test(i)])
    disturb = Disturbance(a, extent)
    after = [disturb(*p) for p in poses]
    link_rest(source, to, (sparse.split("/")[0],))
    folder = os.path.join(to, sparse)
    link_rest(os.path.join(source, sparse), folder, ("images.bin", "images.txt"))
    with open(os.path.join(folder, "images.bin"), "wb") as file:
        file.write(struct.pack("<Q", len(views)))
        for (name, number, numbers, camera, rest), old, new in zip(views, poses, after):
            # The new world to camera is the old times the turn back.
            w = angles(matmul(old[0], transposed(new[0])))
            angle = math.sqrt(sum(x * x for x in w))
            s = math.sin(angle / 2) / angle if angle else 0.5
            q = product(numbers[:4], [math.cos(angle / 2)] + [s * x for x in w])
            t = [-x for x in apply(quaternion_matrix(q), new[1])]
            file.write(struct.pack("<I7dI", number, *q, *t, camera) + name.encode() + b"\0" + rest)
    keep = [i for i in range(len(views)) if not is_test(i)]
    return [poses[i] for i in keep], [after[i] for i in keep], extent


def errors(found, truth, extent):
    """Medians and largest after the similarity between the two."""
    whole = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    for _ in range(5):
        off = [angles(matmul(t[0], transposed(matmul(whole, f[0])))) for f, t in zip(found, truth)]
        whole = matmul(turn([statistics.fmean(w[k] for w in off) for k in range(3)]), whole)
    rotation = sorted(math.degrees(math.sqrt(sum(
        x * x for x in angles(matmul(t[0], transposed(matmul(whole, f[0]))))))) for f, t in zip(found, truth))
    turned = [apply(whole, f[1]) for f in found]
    mean = lambda points: [statistics.fmean(p[k] for p in points) for k in range(3)]
    a, b = mean(turned), mean([t[1] for t in truth])
    left = [[x - m for x, m in zip(p, a)] for p in turned]
    right = [[x - m for x, m in zip(t[1], b)] for t in truth]
    scale = (sum(x * y for p, q in zip(left, right) for x, y in zip(p, q)) / sum(x * x for p in left for x in p))
    position = sorted(100 * math.dist([scale * x for x in p], q) / extent for p, q in zip(left, right))
    return {"median_degrees": statistics.median(rotation), "largest_degrees": rotation[-1],
            "median_percent_of_extent": statistics.median(position), "largest_percent_of_extent": position[-1],
            "whole_degrees": math.degrees(math.sqrt(sum(x * x for x in angles(whole)))), "whole_scale": scale}


def poses_of(path):
    with open(path) as file:
        return [([row[:3] for row in c["c2w"][:3]], [row[3] for row in c["c2w"][:3]]) for c in json.load(file)]


def train(a, capture, out, refined, poses=None):
    command = [a.gart, "train", capture, "--out", out, "--quiet", "--eval-every", "0", "--iterations", a.iterations,
               "--test-every", a.test_every, *a.rest]
    command += (["--refine-poses"] if refined else []) + (["--poses", poses] if poses else [])
    done = run(command)
    if done.returncode != 0:
        return {"error": last_line(done.stderr)}
    with open(os.path.join(out, "metrics.json")) as file:
        m = json.load(file)
    keys = ("psnr", "ssim", "psnr_capture_poses", "seconds", "gaussians", "sh_degree", "backend", "image_size")
    return {**{k: m[k] for k in keys if k in m}, "training_psnr": m["training_scores"]["psnr"],
            "pose_ms": sum(ms for stage, ms in m["stages_ms"].items() if stage.startswith("pose/"))}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gart", required=True, help="the program")
    parser.add_argument("--capture", nargs=2, action="append", required=True, metavar=("NAME", "DIR"))
    parser.add_argument("--out", default="bench/results")
    parser.add_argument("--iterations", type=int, default=7000)
    parser.add_argument("--test-every", type=int, default=8)
    parser.add_argument("--degrees", type=float, default=1)
    parser.add_argument("--share", type=float, default=0.01)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--runs", default=",".join(RUNS), help="of " + ", ".join(RUNS))
    parser.add_argument("--commit")
    parser.add_argument("--keep", help="folder in which the runs stay")
    parser.add_argument("rest", nargs="*", help="after --: for gart train")
    a = parser.parse_args()
    failed = False
    for name, source in a.capture:
        folder = a.keep or tempfile.mkdtemp(prefix="gart-poses-")
        copy = os.path.join(folder, name + "_disturbed")
        if os.path.exists(copy):
            shutil.rmtree(copy)
        reader = blender if os.path.exists(os.path.join(source, "transforms_train.json")) else colmap
        before, after, extent = reader(a, source, copy)
        runs, clean = [], None
        for run_name in a.runs.split(","):
            disturbed, refined = RUNS[run_name]
            out = os.path.join(folder, name + "_" + run_name)
            before_it = os.path.join(folder, name + "_disturbed_refined", "poses.json")
            poses = before_it if run_name == "disturbed_again" else None
            row = {"run": run_name, **train(a, copy if disturbed else source, out, refined, poses)}
            row["poses"] = errors(after if disturbed else before, before, extent)
            if refined and "error" not in row:
                found = poses_of(os.path.join(out, "poses.json"))
                row["start"], row["poses"] = row["poses"], errors(found, before, extent)
                if not disturbed:
                    clean = found
                elif clean:
                    row["from_clean_refined"] = errors(found, clean, extent)
            failed = failed or "error" in row
            runs.append(row)
            print(json.dumps(row), file=sys.stderr, flush=True)
        result = {"what": "poses", "machine": machine(), "commit": commit_of(a.commit),
                  "date": now(), "command": command_line(),
                  "capture": name, "views": len(before), "iterations": a.iterations, "degrees": a.degrees,
                  "share_of_extent": a.share, "seed": a.seed, "runs": runs}
        write_json(os.path.join(a.out, f"poses_{name}.json"), result)
        if not a.keep:
            shutil.rmtree(folder)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
