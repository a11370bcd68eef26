#!/usr/bin/env python3
"""Times training on several ranks (docs/backends.md), on one machine with several GPUs or on its cores, and writes what it
measured as JSON. Python 3 and MPI's launcher are needed, and gart_bench_ranks of a build (-DGART_BUILD_BENCH=ON).

    python3 bench/scale.py --build DIR --out FILE.json --ranks 1,2 --scene synth_1000k.ply

What is measured:
  links     how the GPUs are connected, as nvidia-smi has it
  exchange  each rank sends --megabytes to every other: of device memory by NCCL and through the host, of host memory
  steps     images a second by views and by strips, for each number of ranks; one rank by the plain trainer too (alone)
  stages    where a step's time goes, with the most ranks
  bits      a short training by `deterministic`: loss and checksum of the model, which all numbers of ranks must share

Exit code: 0, or 1 where a run failed or bits differ; what failed is in the file and on the standard error.
"""
import argparse
import datetime
import glob
import json
import os
import shlex
import shutil
import sys

from common import commit_of, last_line, machine, run


class Scale:
    def __init__(self, a):
        self.a, self.failures, self.runs = a, [], []
        found = [p for p in glob.glob(os.path.join(a.build, "**", "gart_bench_ranks"), recursive=True) if os.path.isfile(p)]
        if not found:
            sys.exit(f"{a.build}: there is no gart_bench_ranks; configure with -DGART_BUILD_BENCH=ON and build it")
        self.program = os.path.abspath(found[0])
        scene = os.path.splitext(a.scene)[0] if a.scene else None
        self.scene = (["--model", scene + ".ply", "--cameras", scene + ".json"] if scene else
                      ["--gaussians", a.gaussians, "--size", a.size, "--copies", a.copies]) + ["--degree", a.degree]
        self.common = [*self.scene, "--backend", a.backend] + (["--threads", a.threads] if a.threads else [])

    def measure(self, what, ranks, *options):
        command = [*shlex.split(self.a.launch), "-n", ranks, self.program, *options]
        done = run(command, timeout=600)
        text = " ".join(str(c) for c in command)
        lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
        if done.returncode != 0 or not lines:
            self.failures.append({"what": what, "ranks": ranks, "command": text, "said": done.stderr[-1500:]})
            print(f"FAILED {what}, {ranks} ranks: {last_line(done.stderr)}", file=sys.stderr, flush=True)
            return None
        result = {"what": what, **json.loads(lines[-1])}
        print(json.dumps(result), flush=True)
        self.runs.append(result)
        return result

    def options_of(self, backward):
        return [*self.common, "--backward", backward, "--steps", self.a.steps]

    def steps(self):
        for backward in self.a.backwards.split(","):
            common = self.options_of(backward)
            if self.a.alone:
                self.measure("steps alone", 1, *common, "--alone", 1)
            for ranks in self.a.ranks:
                self.measure("steps by strips", ranks, *common)
                if ranks > 1:
                    self.measure("steps by views", ranks, *common, "--batch", ranks)

    def stages(self):
        most = self.a.ranks[-1]
        for backward in self.a.backwards.split(",") if most > 1 else []:
            common = [*self.options_of(backward), "--stages", 1]
            self.measure("stages by strips", most, *common)
            self.measure("stages by views", most, *common, "--batch", most)

    def bits(self):
        for batch in (1, 2):
            seen = set()
            for ranks in self.a.ranks:
                if batch > 1 and ranks > batch and ranks % batch:
                    continue
                r = self.measure(f"bits of a batch of {batch}", ranks, *self.common, "--backward", "deterministic",
                                 "--steps", 20, "--learn", 1, "--batch", batch)
                if r:
                    seen.add((r["loss"], r["checksum"]))
            if len(seen) > 1:
                self.failures.append({"what": f"bits of a batch of {batch}", "said": f"they differ: {sorted(seen)}"})
                print(f"FAILED: bits differ: {sorted(seen)}", file=sys.stderr, flush=True)

    def go(self):
        out = {"what": "ranks", "machine": machine(), "commit": commit_of(self.a.commit),
               "date": datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
               "command": " ".join(shlex.quote(w) for w in ["python3", *sys.argv])}
        if shutil.which("nvidia-smi"):
            out["machine"]["gpus"] = len(run(["nvidia-smi", "-L"]).stdout.splitlines())
            out["links"] = run(["nvidia-smi", "topo", "-m"]).stdout.splitlines()
        parts = self.a.what.split(",")
        if "exchange" in parts:
            for ranks in [r for r in self.a.ranks if r > 1]:
                for megabytes in self.a.megabytes.split(","):
                    self.measure("exchange", ranks, "--exchange", megabytes)
        if "bits" in parts:
            self.bits()
        if "steps" in parts:
            self.steps()
        if "stages" in parts:
            self.stages()
        discs = f"{int(self.a.gaussians):,} discs" + (f", {self.a.copies} copies" if self.a.copies != "1" else "")
        out["scene"] = os.path.basename(self.a.scene) if self.a.scene else discs
        out["runs"], out["failures"] = self.runs, self.failures
        with open(self.a.out + ".part", "w") as file:
            json.dump(out, file, indent=1, sort_keys=True)
        os.replace(self.a.out + ".part", self.a.out)
        return 1 if self.failures else 0


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--build", required=True, metavar="DIR", help="build folder")
    p.add_argument("--out", required=True, metavar="FILE", help="where the JSON goes")
    p.add_argument("--what", default="exchange,bits,steps,stages", metavar="LIST")
    p.add_argument("--ranks", default="1,2", metavar="LIST", help="numbers of ranks, ascending")
    p.add_argument("--launch", default="mpirun", metavar="COMMAND", help="the launcher with its options, up to -n")
    p.add_argument("--scene", metavar="FILE.ply", help="with FILE.json, its cameras; else discs of gart's own")
    p.add_argument("--gaussians", default="1000000", metavar="N")
    p.add_argument("--copies", default="1", metavar="N", help="of the discs, of which a view sees one")
    p.add_argument("--degree", default="3", metavar="N", help="of the colours' spherical harmonics")
    p.add_argument("--size", default="1237x822", metavar="WxH")
    p.add_argument("--backend", default="auto", metavar="NAME")
    p.add_argument("--backwards", default="primitive", metavar="LIST")
    p.add_argument("--steps", default="100", metavar="N", help="that are timed")
    p.add_argument("--threads", metavar="N", help="of each rank, on a host")
    p.add_argument("--megabytes", default="50,100,200", metavar="LIST")
    p.add_argument("--alone", action="store_true", help="time the plain trainer too")
    p.add_argument("--commit", default="", metavar="ID", help="where the folder is no checkout")
    a = p.parse_args()
    if a.scene and a.copies != "1":
        p.error("--copies are of the discs, and --scene names another scene: give one of the two")
    a.ranks = sorted(int(r) for r in a.ranks.split(","))
    return Scale(a).go()


if __name__ == "__main__":
    sys.exit(main())
