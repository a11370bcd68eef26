#!/usr/bin/env python3
"""Trains one scene through several lenses and scores all on the same pinhole views. Python 3 alone is needed.

    python3 bench/lenses.py --gart build/program/gart --size 400 --views 100

`gart synth` makes the scene's captures, from the same places, with as many pixels a radian on the axis: by pinholes, by a
fisheye (OPENCV_FISHEYE, --angle across), over the whole sphere, and by pinholes with a rolling shutter that turn by
--rolling degrees while they are read. Each is trained by the same number of steps to the same number of Gaussians, and
scored by `gart eval` on the test views of the first. A last training takes the rolling capture for one of cameras that
stood still where each was in the middle of its read-out: what is lost where the shutter is ignored.

The result, OUT/lenses.json, has of each its score, what it is over the pinholes', and the training's own. --keep keeps
captures and runs; captures that are there already are taken as they are. What is after -- goes to every training.
"""
import argparse
import datetime
import json
import math
import os
import shlex
import shutil
import sys
import tempfile

from common import commit_of, last_line, machine, run
from poses import angles, link_rest, matmul, transposed, turn

ACROSS = 0.69  # radians that a view of gart synth has across
CAPTURES = ("pinhole", "fisheye", "sphere", "rolling")


def synth(a, name, folder):
    if os.path.exists(os.path.join(folder, "transforms_train.json")):
        return
    focal = 0.5 * a.size / math.tan(0.5 * ACROSS)
    more = {"pinhole": ["--size", a.size],
            "fisheye": ["--size", round(focal * math.radians(a.angle)),
                        "--camera", f"OPENCV_FISHEYE,fx={focal:.6g},k1=0.02,k2=-0.004"],
            "sphere": ["--size", round(focal * math.pi), "--camera", "EQUIRECTANGULAR"],
            "rolling": ["--size", a.size, "--rolling", a.rolling]}[name]
    done = run([a.gart, "synth", "--out", folder, "--train", a.views, "--test", a.test if name == "pinhole" else 1,
                "--samples", a.samples, "--points", a.points, "--seed", a.seed, "--quiet"] + more)
    if done.returncode != 0:
        raise SystemExit("bench/lenses.py: " + name + ": " + last_line(done.stderr))


def without_shutter(source, to):
    """The capture with the pose of the middle of each read-out in place of its two."""
    if os.path.exists(to):
        shutil.rmtree(to)
    link_rest(source, to, ("transforms_train.json",))
    with open(os.path.join(source, "transforms_train.json")) as file:
        transforms = json.load(file)
    transforms.pop("shutter_type")
    for frame in transforms["frames"]:
        first, last = frame["transform_matrix"], frame.pop("transform_matrix_end")
        a, b = ([row[:3] for row in m[:3]] for m in (first, last))
        half = turn([0.5 * x for x in angles(matmul(transposed(a), b))])
        rotation = matmul(a, half)
        frame["transform_matrix"] = [rotation[i] + [0.5 * (first[i][3] + last[i][3])] for i in range(3)] + [[0, 0, 0, 1]]
    with open(os.path.join(to, "transforms_train.json"), "w") as file:
        json.dump(transforms, file)


def train(a, capture, truth, out):
    done = run([a.gart, "train", capture, "--out", out, "--quiet", "--eval-every", "0", "--no-auto", "--iterations",
                a.iterations, "--max-gaussians", a.gaussians, "--seed", a.seed, "--background", "white"] + a.rest)
    if done.returncode != 0:
        return {"error": last_line(done.stderr)}
    with open(os.path.join(out, "metrics.json")) as file:
        own = json.load(file)
    done = run([a.gart, "eval", os.path.join(out, "model.ply"), truth, "--out", os.path.join(out, "pinholes.json"),
                "--background", "white", "--quiet"])
    if done.returncode != 0:
        return {"error": last_line(done.stderr)}
    with open(os.path.join(out, "pinholes.json")) as file:
        scores = json.load(file)
    return {"psnr": scores["psnr"], "ssim": scores["ssim"], "training_psnr": own["training_scores"]["psnr"],
            "image_size": own["image_size"], "gaussians": own["gaussians"], "seconds": own["seconds"]}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gart", required=True, help="the program, with Embree for gart synth")
    parser.add_argument("--out", default="bench/results")
    parser.add_argument("--views", type=int, default=100)
    parser.add_argument("--test", type=int, default=20)
    parser.add_argument("--size", type=int, default=200, help="of a pinhole's image, a side")
    parser.add_argument("--angle", type=float, default=120, help="across the fisheye's image, degrees")
    parser.add_argument("--rolling", type=float, default=4, help="degrees while an image is read")
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--points", type=int, default=20000)
    parser.add_argument("--iterations", type=int, default=7000)
    parser.add_argument("--gaussians", type=int, default=50000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--captures", default=",".join(CAPTURES), help="of " + ", ".join(CAPTURES))
    parser.add_argument("--only-captures", action="store_true", help="make them and end (with --keep)")
    parser.add_argument("--commit")
    parser.add_argument("--keep", help="folder in which captures and runs stay")
    parser.add_argument("rest", nargs="*", help="after --: for gart train")
    a = parser.parse_args()
    folder = a.keep or tempfile.mkdtemp(prefix="gart-lenses-")
    chosen = ["pinhole"] + [c for c in a.captures.split(",") if c != "pinhole"]
    at = {name: os.path.join(folder, name) for name in chosen}
    os.makedirs(folder, exist_ok=True)
    for name in chosen:
        synth(a, name, at[name])
    if a.only_captures:
        return 0
    if "rolling" in chosen:
        at["rolling, ignored"] = os.path.join(folder, "rolling_ignored")
        without_shutter(at["rolling"], at["rolling, ignored"])
    rows = []
    for name, capture in at.items():
        row = {"capture": name, **train(a, capture, at["pinhole"], capture + "_run")}
        if rows and "psnr" in row and "psnr" in rows[0]:
            row["over_pinhole"] = row["psnr"] - rows[0]["psnr"]
        rows.append(row)
        print(json.dumps(row), file=sys.stderr, flush=True)
    result = {"what": "lenses", "machine": machine(), "commit": commit_of(a.commit),
              "date": datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
              "command": " ".join(shlex.quote(x) for x in ["python3"] + sys.argv), "views": a.views,
              "pinhole_size": a.size, "angle": a.angle, "rolling_degrees": a.rolling, "iterations": a.iterations,
              "seed": a.seed, "runs": rows}
    os.makedirs(a.out, exist_ok=True)
    path = os.path.join(a.out, "lenses.json")
    with open(path + ".part", "w") as file:
        json.dump(result, file, indent=1)
        file.write("\n")
    os.replace(path + ".part", path)
    if not a.keep:
        shutil.rmtree(folder)
    return 1 if any("error" in r for r in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
