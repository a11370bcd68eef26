"""The parts `tests` and `sanitize` of bench/run.py: a build's CUDA tests, and a training step under compute-sanitizer."""
import glob
import os
import re
import shutil
import time

from common import Failure, first_match, last_line, run

SKIPPED = 77


class Checks:
    def tests(self):
        programs = sorted(p for p in glob.glob(os.path.join(self.a.build, "tests", "**", "test_*_cuda"), recursive=True)
                          if os.access(p, os.X_OK) and os.path.isfile(p))
        if not programs:
            raise Failure(f"{self.a.build}/tests: no CUDA tests; configure with -DGART_CUDA=ON -DGART_BUILD_TESTS=ON")
        runs = []
        for program in programs:
            name, start = os.path.basename(program), time.time()
            done = run([program], env={**os.environ, "GART_SCENES": os.path.abspath(self.a.scenes)})
            result = {0: "passed", SKIPPED: "skipped"}.get(done.returncode, "failed")
            row = {"test": name, "result": result, "seconds": round(time.time() - start, 1)}
            totals = re.search(r"assertions:\s*(\d+)", done.stdout)
            if totals:
                row["assertions"] = int(totals.group(1))
            said = re.findall(r"MESSAGE: (.* differ)$", done.stdout, re.MULTILINE)
            if said:
                row["said"] = said
            if result == "failed":
                errors = re.findall(r"^.* ERROR: .*\n(?:.+\n)*", done.stdout, re.MULTILINE)
                row["output"] = "".join(errors)[:3000] + done.stdout[-1000:] + done.stderr[-1000:]
                self.fail(name)
            self.say(f"{name}: {result}, {row['seconds']} s")
            runs.append(row)
        self.write("tests", runs)

    def sanitize(self):
        sanitizer = shutil.which("compute-sanitizer") or "/usr/local/cuda/bin/compute-sanitizer"
        if not os.path.exists(sanitizer):
            raise Failure("compute-sanitizer: not found; it comes with the CUDA toolkit")
        stem = os.path.join(self.temporary, "small")
        made = run([self.program("gart_bench"), "--gaussians", 3000, "--size", "96x64", "--write", stem])
        if made.returncode != 0:
            raise Failure(f"{stem}: could not be made: {last_line(made.stderr)}")
        runs = []
        for tool in ("memcheck", "racecheck"):
            for tracer in self.a.tracers:
                for backward in self.a.backwards:
                    command = [sanitizer, "--tool", tool, "--error-exitcode", "99", self.program("gart"), "bench",
                               stem + ".ply", stem + ".json", "--backend", "cuda", "--tracer", tracer, "--backward",
                               backward, "--views", "1", "--warmups", "0", "--repeats", "1", "--quiet"]
                    done = run(command)
                    summary = first_match(r"(?:ERROR|RACECHECK) SUMMARY: (.*)$", done.stdout + done.stderr)
                    row = {"tool": tool, "tracer": tracer, "backward": backward, "summary": summary,
                           "clean": done.returncode == 0}
                    if not row["clean"]:
                        row["output"] = (done.stdout + done.stderr)[:3000]
                        self.fail(f"{tool}, {tracer}, {backward}: {summary}")
                    self.say(f"{tool}, {tracer}, {backward}: {summary}")
                    runs.append(row)
        self.write("sanitize", runs)
