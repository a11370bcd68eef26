#!/usr/bin/env python3
"""Holds boxes of random ellipsoids through every lens to their silhouettes in double, by many. Python 3 alone is needed.

    python3 bench/boxes.py --test build/tests/camera/test_camera --ellipsoids 1000000

So many ellipsoids a model, a third of them of each range of sizes, one in twenty on a pole or the axis, on the seam or at
the rim (tests/camera/boxes.cpp). The result, OUT/camera_boxes.json, has of each how many had a hit outside of its box, and
the mean area of boxes over that of exact ones. About 50 microseconds of a core an ellipsoid.
"""
import argparse
import datetime
import json
import os
import re
import shlex
import sys

from common import commit_of, last_line, machine, run

ROW = re.compile(r"^\| (\w+) \| (\S+) \| (\S+) \| (\d+) \| (\d+) \| (\d+) \| (\S+) \|$", re.MULTILINE)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--test", required=True, help="the test program of cameras, built")
    parser.add_argument("--ellipsoids", type=int, default=1000000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", default="bench/results")
    parser.add_argument("--commit")
    a = parser.parse_args()
    each = (a.ellipsoids + 2) // 3
    done = run([a.test, "-tc=no silhouette of an ellipsoid*"],
               env={**os.environ, "GART_TEST_COUNT": str(each), "GART_TEST_SEED": str(a.seed), "GART_TEST_TABLE": "1"})
    rows = [{"model": m[0], "radius_over_distance": [float(m[1]), float(m[2])], "ellipsoids": int(m[3]),
             "hits_outside": int(m[4]), "measured": int(m[5]), "area_over_exact": float(m[6])}
            for m in ROW.findall(done.stdout)]
    if not rows:
        print("bench/boxes.py: " + last_line(done.stdout + done.stderr), file=sys.stderr)
        return 1
    result = {"what": "mean area of boxes over that of exact ones, random ellipsoids against their silhouettes in double",
              "machine": machine(), "commit": commit_of(a.commit),
              "date": datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
              "command": " ".join(shlex.quote(x) for x in ["python3"] + sys.argv), "seed": a.seed,
              "passed": done.returncode == 0, "rows": rows}
    os.makedirs(a.out, exist_ok=True)
    path = os.path.join(a.out, "camera_boxes.json")
    with open(path + ".part", "w") as file:
        json.dump(result, file, indent=1)
        file.write("\n")
    os.replace(path + ".part", path)
    return 0 if done.returncode == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
