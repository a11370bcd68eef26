"""gart convert against other programs, both ways: @playcanvas/splat-transform reads what gart writes as gart reads it,
and the other way round; gltf-validator has nothing to say of a GLB but that it does not know the extension's names.

    python3 check_programs.py GART FOLDER

npm fetches the packages of programs/package-lock.json to FOLDER, where they stay. Skipped (exit 77), with the reason,
where there is no node or npm, or npm cannot fetch them."""
import filecmp
import json
import math
import os
import random
import shutil
import struct
import subprocess
import sys
import tempfile

PACKAGES = ("@playcanvas/splat-transform", "gltf-validator")
LISTED = os.path.join(os.path.dirname(os.path.abspath(__file__)), "programs")
VALIDATE = """const v = require(process.argv[1]), fs = require('fs');
v.validateBytes(new Uint8Array(fs.readFileSync(process.argv[2]))).then(r => console.log(JSON.stringify(r.issues)));"""


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)}: {done.stdout}{done.stderr}")
    return done.stdout


def skip(why):
    print("skipped: " + why)
    sys.exit(77)


def modules(folder):
    for program in ("node", "npm"):
        if not shutil.which(program):
            skip(f"{program} is not here (apt-get install nodejs npm)")
    os.makedirs(folder, exist_ok=True)
    lock, wanted = (os.path.join(f, "package-lock.json") for f in (folder, LISTED))
    # npm writes its own lock last: what was fetched in part is fetched again.
    fetched = os.path.exists(os.path.join(folder, "node_modules", ".package-lock.json"))
    if not (fetched and os.path.exists(lock) and filecmp.cmp(lock, wanted, shallow=False)):
        for name in ("package.json", "package-lock.json"):
            shutil.copy(os.path.join(LISTED, name), folder)
        try:
            npm = subprocess.run(["npm", "ci", "--no-audit", "--no-fund", "--silent", "--prefer-offline", "--ignore-scripts",
                                  "--fetch-retries=1", "--fetch-timeout=20000"], cwd=folder, timeout=180)
        except subprocess.TimeoutExpired:
            npm = None
        if npm is None or npm.returncode != 0:
            skip("npm could not fetch " + " and ".join(PACKAGES) + " (is there a network?)")
    return os.path.join(folder, "node_modules")


def write(path, count):
    random.seed(7)
    names = (["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2"] + [f"f_rest_{i}" for i in range(45)] +
             ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"])
    spread = lambda n: (-4, 1) if n.startswith("scale") else (0, 0.1) if n.startswith("f_rest") else (0, 1.5)
    with open(path, "wb") as f:
        f.write(("ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % count +
                 "".join(f"property float {n}\n" for n in names) + "end_header\n").encode())
        for _ in range(count):
            f.write(struct.pack("<59f", *(random.gauss(*spread(n)) for n in names)))


def read(path):
    with open(path, "rb") as f:
        data = f.read()
    end = data.index(b"end_header\n") + 11
    head = data[:end].decode().splitlines()
    names = [line.split()[2] for line in head if line.startswith("property float")]
    count = next(int(line.split()[2]) for line in head if line.startswith("element vertex"))
    values = struct.unpack(f"<{count * len(names)}f", data[end:])
    return [dict(zip(names, values[i * len(names):(i + 1) * len(names)])) for i in range(count)]


def unit(g):
    q = [g[f"rot_{k}"] for k in range(4)]
    size = math.sqrt(sum(v * v for v in q))
    return [v / size for v in q]


def compare(what, ours, theirs, turn):
    a, b = read(ours), read(theirs)
    if len(a) != len(b):
        sys.exit(f"{what}: {len(a)} and {len(b)} Gaussians")
    for i, (g, h) in enumerate(zip(a, b)):
        for name in g:
            if name.startswith("rot") or name.startswith("n"):
                continue
            x, y = g[name], h[name]
            if name == "opacity":  # nothing and all are infinite logits to some
                x, y = (1 / (1 + math.exp(-max(-700, min(700, v)))) for v in (x, y))
            if abs(x - y) > 1e-5 * max(1, abs(x)):
                sys.exit(f"{what}: Gaussian {i}, {name} is {g[name]} and {h[name]}")
        p, q = unit(g), unit(h)
        # Half a turn about an axis of its own leaves a Gaussian what it is.
        w, x, y, z = q
        same = ((w, x, y, z), (-x, w, z, -y), (-y, -z, w, x), (-z, y, -x, w))
        if min(max(abs(u - sign * v) for u, v in zip(p, r)) for r in same for sign in (1, -1)) > turn:
            sys.exit(f"{what}: Gaussian {i} is turned by {p} and {q}")
    print(f"{what}: {len(a)} Gaussians, the same")


def main():
    gart, found = sys.argv[1], modules(sys.argv[2])
    other = lambda *a: run("node", os.path.join(found, PACKAGES[0], "bin", "cli.mjs"), "-q", "-w", "-g", "cpu", *a)
    with tempfile.TemporaryDirectory() as folder:
        at = lambda name: os.path.join(folder, name)
        write(at("a.ply"), 1200)
        for kind in ("spz", "compressed.ply", "sog", "splat"):
            run(gart, "convert", at("a.ply"), at("ours." + kind), "--quiet")
            run(gart, "convert", at("ours." + kind), at("back.ply"), "--quiet")
            other(at("ours." + kind), at("theirs.ply"))
            # A byte of a .splat's rotation is taken as of 127.5 steps there, of 128 here.
            compare(f"{kind} by gart", at("back.ply"), at("theirs.ply"), 0.008 if kind == "splat" else 1e-5)
        for kind in ("spz", "compressed.ply", "sog"):
            other(at("a.ply"), "-i", "2", at("theirs." + kind)) if kind == "sog" else other(at("a.ply"), at("theirs." + kind))
            run(gart, "convert", at("theirs." + kind), at("back.ply"), "--quiet")
            other(at("theirs." + kind), at("theirs.ply"))
            compare(f"{kind} by splat-transform", at("back.ply"), at("theirs.ply"), 1e-5)
        other(at("a.ply"), at("theirs.glb"))
        run(gart, "convert", at("theirs.glb"), at("back.ply"), "--quiet")
        run(gart, "convert", at("a.ply"), at("ours.glb"), "--quiet")
        run(gart, "convert", at("ours.glb"), at("again.ply"), "--quiet")
        compare("glb by both", at("again.ply"), at("back.ply"), 1e-5)
        issues = json.loads(run("node", "-e", VALIDATE, os.path.join(found, PACKAGES[1]), at("ours.glb")))
        for message in issues["messages"]:
            of_names = message["code"] == "MESH_PRIMITIVE_INVALID_ATTRIBUTE" and "KHR_gaussian_splatting:" in message["pointer"]
            if not of_names and message["code"] != "UNSUPPORTED_EXTENSION":
                sys.exit(f"gltf-validator: {message}")
        print("glb by gart: valid")


main()
