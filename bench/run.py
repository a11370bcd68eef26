#!/usr/bin/env python3
"""Checks and times a build of gart, and writes what it measured as JSON. Python 3 alone is needed.

    python3 bench/run.py --build DIR --scenes DIR --what tests,stages,paper

What (comma-separated; default tests and paper):
  tests       every CUDA test of the build
  sanitize    compute-sanitizer memcheck and racecheck over a training step of each method
  stages      gart_bench_cuda on the first scene: each stage on its own, and tile sizes 4, 8 and 16
  cpu         gart_bench: the same stages on the host policies, on a small scene; a minute or two
  methods     `gart bench`: a training step by method and tracer, on the first two scenes
  memory      `gart bench`: hit buffer and peak memory against the number of Gaussians, at two resolutions
  traits      `gart bench`: a training step by row (docs/performance.md): SH and kernel degree, hit format,
              determinism; on --backend, a host by one thread, and bytes a Gaussian. Needs -DGART_VARIANTS=ON
  paper       methods, memory and stages
  tradeoff    `gart tradeoff` on the first scene and on every --model: what each approximation costs and buys
  formats     every --model in each format and setting, by its test views: bytes, PSNR, SSIM (bench/formats.py)
  paths       frames of meshes and light among the Gaussians of the first scene, by bounces (bench/paths.py)
  view        every --model served by `gart view`, and what a viewer takes from training every --capture (bench/view.py)
  rules       `gart train` with each rule of docs/training.md changed alone (--rules names some), --seeds of each (3):
              a file rules_NAME.json a capture, written after each rule
  leave-one-out  every --capture by what `gart train` chooses and by each fixed setting: a setting tuned on all captures
              but one, scored on that one, stands against the choices (docs/training.md); leave_one_out.json
  curves      a short training of every --capture by each method, same seed: the loss curves against each other and
              against the noise from run to run, the test scores, and whether deterministic gives the same bits twice
  long        a full training of every --capture: every step checked (gart train --check-finite), five seeds, and
              deterministic twice; --long names those to run. long.json is written after each, and what is in it already
              of the same commit, machine and options is not run again

On a host, deterministic needs -DGART_VARIANTS=ON. curves.json and long.json keep the captures that are not named.

Scenes are DIR/NAME.ply with DIR/NAME.json, a list of cameras {"name","width","height","fx","fy","cx","cy","c2w"}.
synth_1000k is the scene of a million Gaussians, and so on. A missing one is made by --generator, a command in which
{dir}, {name} and {count} are replaced; without it, by gart_bench itself (discs on spheres, called discs_1000k). The
name of the scene stands beside every number.

Each result is a file OUT/WHAT.json: machine, commit, date, command, and `runs`. bench/plot.py makes the figures.
Exit code: 0, or 1 when a test or a measurement failed; what failed is in the file and on the standard error.
"""
import argparse
import array
import glob
import json
import os
import shlex
import shutil
import sys
import tempfile

from checks import Checks
from common import Failure, command_line, commit_of, last_line, machine, now, run, write_json
from formats import Formats
from paths import Paths
from training import LONG_PARTS, RULES, Trainings
from view import View

TRAININGS = ("rules", "leave-one-out", "curves", "long")
PARTS = ("tests", "sanitize", "stages", "cpu", "methods", "memory", "traits", "tradeoff", "formats",
         "paths", "view") + TRAININGS

# Rows of docs/performance.md: name, SH degree, kernel degree, options of gart bench.
TRAIT_ROWS = ([(f"SH {d}", d, 2, {}) for d in (3, 2, 1, 0)] +
              [(f"kernel degree {n}", 3, n, {}) for n in (4,)] +
              [("hit slots in half", 3, 2, {"hit-format": "half"}),
               ("hybrid", 3, 2, {"backward": "hybrid"}), ("deterministic", 3, 2, {"backward": "deterministic"})])


class Bench(Checks, Trainings, Formats, Paths, View):
    def __init__(self, a):
        self.a = a
        self.commit = commit_of(a.commit)
        self.machine = machine()
        self.failures = []
        self.temporary = tempfile.mkdtemp(prefix="gart-bench-")

    def program(self, name):
        for found in glob.glob(os.path.join(self.a.build, "**", name), recursive=True):
            if os.path.isfile(found) and os.access(found, os.X_OK):
                return found
        hint = "-DGART_BUILD_BENCH=ON" if name.startswith("gart_bench") else "-DGART_CUDA=ON"
        raise Failure(f"{self.a.build}: no program {name}; configure with {hint} and build")

    def say(self, text):
        print(text, file=sys.stderr, flush=True)

    def fail(self, text):
        self.failures.append(text)
        self.say("FAILED  " + text)

    def stamp(self):
        return {"machine": self.machine, "commit": self.commit, "date": now()}

    def write(self, what, runs, **more):
        path = os.path.join(self.a.out, what + ".json")
        write_json(path, {"what": what, **self.stamp(), "command": command_line(), **more, "runs": runs})
        self.say(f"wrote {path}")

    def scene(self, thousands):
        """(name, ply, json) of the scene of so many thousand Gaussians; made where it is missing."""
        names = (f"synth_{thousands}k", f"discs_{thousands}k")
        folder = self.a.scenes
        stem = lambda name: os.path.join(folder, name)
        complete = lambda name: os.path.exists(stem(name) + ".ply") and os.path.exists(stem(name) + ".json")
        for name in names:
            if complete(name) and not (self.a.generator and name != names[0]):
                return name, stem(name) + ".ply", stem(name) + ".json"
        os.makedirs(folder, exist_ok=True)
        if self.a.generator:
            name = names[0]
            text = self.a.generator.format(dir=shlex.quote(folder), name=name, count=1000 * thousands)
            made = run(["sh", "-c", text])
        else:
            name = names[1]
            made = run([self.program("gart_bench"), "--gaussians", 1000 * thousands, "--size", "1237x822", "--write",
                        stem(name)])
        if made.returncode != 0 or not complete(name):
            raise Failure(f"{folder}/{name}: could not be made: {last_line(made.stderr)}")
        return name, stem(name) + ".ply", stem(name) + ".json"

    def enlarged(self, cameras, factor):
        """The same cameras with images `factor` times as wide and high."""
        if factor == 1:
            return cameras
        with open(cameras) as f:
            entries = json.load(f)
        for camera in entries:
            for field in ("width", "height", "fx", "fy", "cx", "cy"):
                camera[field] *= factor
        path = os.path.join(self.temporary, f"x{factor}_" + os.path.basename(cameras))
        with open(path, "w") as f:
            json.dump(entries, f)
        return path

    def gart_bench(self, ply, cameras, tracer, backward, views, warmups, repeats, backend="cuda", **more):
        """The JSON of `gart bench`, or {"error": ...} for a row that fails."""
        path = os.path.join(self.temporary, "bench.json")
        if os.path.exists(path):
            os.remove(path)
        command = [self.program("gart"), "bench", ply, cameras, "--backend", backend, "--tracer", tracer, "--backward",
                   backward, "--views", views, "--warmups", warmups, "--repeats", repeats, "--json", path, "--quiet"]
        command += [text for name, value in more.items() for text in (f"--{name}", value)]
        done = run(command)
        if done.returncode != 0:
            self.fail(f"{backward}, {tracer}, {os.path.basename(ply)}: {last_line(done.stderr)}")
            return {"tracer": tracer, "backward": backward, "error": last_line(done.stderr)}
        with open(path) as f:
            return json.load(f)

    # The parts.

    def google_benchmark(self, what, program, arguments, every=".", **more):
        path = os.path.join(self.temporary, "stages.json")
        done = run([self.program(program), *arguments, f"--benchmark_filter={self.a.filter or every}",
                    f"--benchmark_out={path}", "--benchmark_out_format=json",
                    f"--benchmark_min_time={self.a.min_time}"])
        if done.returncode != 0:
            raise Failure(f"{program}: {last_line(done.stderr)}")
        with open(path) as f:
            raw = json.load(f)
        dropped = ("family_index", "per_family_instance_index", "repetition_index", "run_type", "threads", "run_name",
                   "repetitions", "time_unit", "cpu_time")
        runs = []
        for row in raw["benchmarks"]:
            entry = {k: v for k, v in row.items() if k not in dropped}
            entry["name"] = entry["name"].replace("/manual_time", "")
            entry["milliseconds"] = entry.pop("real_time", None)
            if row.get("error_occurred"):
                self.fail(f"{row['name']}: {row.get('error_message')}")
            runs.append(entry)
        self.write(what, runs, gaussians=raw["context"]["gaussians"], image=raw["context"]["image"], **more)

    def stages(self):
        name, ply, cameras = self.scene(self.a.counts[0])
        self.google_benchmark("stages", "gart_bench_cuda", ["--model", ply, "--cameras", cameras], scene=name)

    def cpu(self):
        self.google_benchmark("cpu", "gart_bench", ["--gaussians", "5000", "--size", "160x120"], scene="discs_5k")

    def methods(self):
        runs = []
        for thousands in self.a.counts[:2]:
            name, ply, cameras = self.scene(thousands)
            for tracer in self.a.tracers:
                for backward in self.a.backwards:
                    result = self.gart_bench(ply, cameras, tracer, backward, self.a.views, 5, self.a.repeats)
                    runs.append({"scene": name, **result})
                    if "error" not in result:
                        self.say(f"{name}, {tracer}, {backward}: step {result['step_ms']:.2f} ms, backward "
                                 f"{result['stages_ms']['backward']:.2f} ms")
        self.write("methods", runs)

    def memory(self):
        runs = []
        for thousands in self.a.counts:
            name, ply, cameras = self.scene(thousands)
            for factor in (1, 2):
                for backward in ("primitive", "hybrid"):
                    result = self.gart_bench(ply, self.enlarged(cameras, factor), self.a.tracers[0], backward, 1, 1, 3)
                    runs.append({"scene": name, "thousands": thousands, "scale": factor, **result})
                    if "error" not in result:
                        self.say(f"{name}, x{factor}, {backward}: hit buffer {result['hit_buffer_bytes'] / 1e9:.2f} GB, peak "
                                 f"{result['peak_bytes'] / 1e9:.2f} GB")
        self.write("memory", runs)

    def with_degrees(self, ply, sh_degree, kernel_degree):
        """The model with the bands above a degree left out, as one of a kernel degree."""
        with open(ply, "rb") as f:
            head = b""
            while not head.endswith(b"end_header\n"):
                head += f.readline()
            lines = head.decode().splitlines()
            names = [line.split()[2] for line in lines if line.startswith("property float")]
            values = array.array("f", f.read())
        rest = sum(name.startswith("f_rest_") for name in names) // 3
        keep = (sh_degree + 1) ** 2 - 1
        if keep > rest:
            raise Failure(f"{ply}: of a smaller SH degree than {sh_degree}")
        dropped = {f"f_rest_{channel * rest + k}" for channel in range(3) for k in range(keep, rest)}
        at = [i for i, name in enumerate(names) if name not in dropped]
        width = len(names)
        out = array.array("f", bytes(4 * len(at) * (len(values) // width)))
        for to, i in enumerate(at):
            out[to::len(at)] = values[i::width]
        f_rest = iter(range(3 * keep))
        header = ["ply", "format binary_little_endian 1.0", f"comment gart kernel_degree {kernel_degree}",
                  f"element vertex {len(values) // width}"]
        header += ["property float " + (f"f_rest_{next(f_rest)}" if names[i].startswith("f_rest_") else names[i])
                   for i in at] + ["end_header"]
        path = os.path.join(self.temporary, "degrees.ply")
        with open(path, "wb") as f:
            f.write(("\n".join(header) + "\n").encode())
            f.write(out.tobytes())
        return path

    def traits(self):
        name, ply, cameras = self.a.model[0] if self.a.model else self.scene(self.a.counts[0])
        backend, runs = self.a.backend, []
        # On a host the rows are compared by processor time, in which threads that wait would count.
        alone = {} if backend == "cuda" else {"threads": 1}
        for row, sh_degree, kernel_degree, options in TRAIT_ROWS:
            more = {"backward": "primitive", **alone, **options}
            result = self.gart_bench(self.with_degrees(ply, sh_degree, kernel_degree), cameras, "tiles",
                                     more.pop("backward"), self.a.views, 5, self.a.repeats, backend, **more)
            floats = 11 + 3 * (sh_degree + 1) ** 2
            # Adam's two moments; a checkpoint holds parameters and moments; a splat file three normals of zero besides.
            held = {"parameters": 4 * floats, "gradients": 4 * floats, "moments": 8 * floats, "checkpoint": 12 * floats,
                    "ply": 4 * (floats + 3)}
            runs.append({"scene": name, "row": row, "bytes_a_gaussian": held, **alone, **result})
            if "error" not in result:
                self.say(f"{row}: step {result['step_ms']:.2f} ms, of the processor "
                         f"{result['step_processor_ms']:.2f} ms")
        self.write("traits" if backend == "cuda" else "traits_" + backend, runs)

    def gart_tradeoff(self, ply, cameras, arguments):
        folder = os.path.join(self.temporary, "tradeoff")
        shutil.rmtree(folder, ignore_errors=True)
        done = run([self.program("gart"), "tradeoff", ply, cameras, "--out", folder, "--backend", self.a.backend,
                    "--clock", self.a.clock, "--quiet", *arguments])
        if done.returncode != 0:
            raise Failure(f"gart tradeoff {ply}: {last_line(done.stderr)}")
        with open(os.path.join(folder, "tradeoff.json")) as f:
            return json.load(f)

    def tradeoff(self):
        models = [self.scene(thousands) for thousands in self.a.counts[:1]] + self.a.model
        for name, ply, cameras in models:
            result = self.gart_tradeoff(ply, cameras, ["--repeats", self.a.repeats, "--views", self.a.views])
            # The cut-off that the model was trained with, against hardly any: what it leaves out itself.
            uncut = self.gart_tradeoff(ply, cameras, ["--repeats", 1, "--views", self.a.views, "--settings", "alpha_min",
                                                      "--reference-alpha-min", "1e-5"])
            result["uncut"] = {"reference": uncut["reference"], "settings": uncut["settings"]}
            self.write("tradeoff_" + name, result.pop("settings"), scene=name, **result)
            self.say(f"{name}: {len(result['absent'])} settings not compiled, {result['seconds']:.0f} s")

def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    listed = lambda text: [x for x in text.split(",") if x]
    here = os.path.dirname(os.path.abspath(__file__))
    parser.add_argument("--build", required=True, help="build folder, with -DGART_BUILD_BENCH=ON")
    parser.add_argument("--scenes", default="scenes", help="folder of the scenes")
    parser.add_argument("--out", default=os.path.join(here, "results"), help="folder of the results")
    parser.add_argument("--what", type=listed, default=["tests", "paper"], help="parts, comma-separated")
    parser.add_argument("--sanitize", action="store_true", help="the part sanitize besides")
    parser.add_argument("--generator", help="command that makes a missing scene: {dir} {name} {count}")
    parser.add_argument("--counts", type=lambda t: [int(x) for x in listed(t)], default=[1000, 2000, 3000, 4000, 5000],
                        help="thousands of Gaussians; methods take the first two, stages, paths and tradeoff the first; '' "
                             "for no scene in tradeoff")
    parser.add_argument("--tracers", type=listed, default=["tiles", "bvh"], help="memory takes the first")
    parser.add_argument("--backwards", type=listed, default=["pixel", "hybrid", "primitive"])
    parser.add_argument("--views", type=int, default=4, help="cameras of the methods")
    parser.add_argument("--repeats", type=int, default=20, help="measured steps a camera; the median counts")
    parser.add_argument("--backend", default="cuda", help="of traits, tradeoff, paths and the trainings")
    parser.add_argument("--filter", default="",
                        help="stages, cpu and paths: benchmarks, formats: settings, by regular expression")
    parser.add_argument("--min-time", type=float, default=0.2, help="stages, cpu and paths: seconds a benchmark")
    parser.add_argument("--model", nargs=3, action="append", default=[], metavar=("NAME", "PLY", "CAMERAS"),
                        help="tradeoff, and traits, which takes the first: a trained model and its capture or camera "
                             "JSON; may be repeated")
    parser.add_argument("--capture", nargs=2, action="append", default=[], metavar=("NAME", "DATASET"),
                        help="rules, leave-one-out, curves and long: a capture to train on; may be repeated")
    parser.add_argument("--train", default="",
                        help="the same: options of gart train, in one string; --iterations, where it is not among "
                             "them, is 1000 for curves and 30000 for the others")
    parser.add_argument("--seeds", type=int, help="leave-one-out: runs of each kind, 1 where not given; rules: 3; long: seeds, 5")
    parser.add_argument("--rules", type=listed, help="rules: those whose name begins with one of these, comma-separated")
    parser.add_argument("--long", type=listed, default=list(LONG_PARTS),
                        help="of " + ",".join(LONG_PARTS) + ": the trainings of long to run")
    parser.add_argument("--clock", default="wall", choices=("wall", "processor"),
                        help="tradeoff: what the fronts are drawn over; processor where a CPU has other work")
    parser.add_argument("--pixels", type=int, default=1000000, help="view: pixels of the page's canvas")
    parser.add_argument("--seconds", type=float, default=10, help="view: of motion that are measured")
    parser.add_argument("--commit", help="what was built, where the folder is no git checkout")
    a = parser.parse_args()
    wanted = a.what + (["sanitize"] if a.sanitize else [])
    if "paper" in wanted:
        wanted += ["stages", "methods", "memory"]
    unknown = [w for w in wanted if w not in PARTS + ("paper",)]
    if unknown:
        parser.error(f"--what {unknown[0]}: not one of {', '.join(PARTS)}, paper")
    unknown = [w for w in a.rules or [] if not any(name.startswith(w) for name, _ in RULES)]
    if unknown:
        parser.error(f"--rules {unknown[0]}: no rule's name begins so; there are: {'; '.join(n for n, _ in RULES)}")
    unknown = [w for w in a.long if w not in LONG_PARTS]
    if unknown:
        parser.error(f"--long {unknown[0]}: not one of {', '.join(LONG_PARTS)}")
    if any(p in wanted for p in TRAININGS) and not a.capture:
        parser.error(f"--capture NAME DIR is missing: {', '.join(TRAININGS)} train on captures")
    a.parts = [p for p in PARTS if p in wanted]
    if not os.path.isdir(a.build):
        parser.error(f"--build {a.build}: no such folder")
    return a


def main():
    bench = Bench(arguments())
    try:
        for part in bench.a.parts:
            bench.say(f"== {part}")
            try:
                getattr(bench, part.replace("-", "_"))()
            except Failure as failure:
                bench.fail(f"{part}: {failure}")
    finally:
        shutil.rmtree(bench.temporary, ignore_errors=True)
    for text in bench.failures:
        print("failed: " + text, file=sys.stderr)
    return 1 if bench.failures else 0


if __name__ == "__main__":
    sys.exit(main())
