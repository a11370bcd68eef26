"""The part `formats` of bench/run.py: what each format of models costs (docs/formats.md).

Each --model NAME PLY CAPTURE is written in every format and setting by `gart convert` and scored against the capture's
test views by `gart eval`, with the model itself. --train holds options of gart eval, as --downscale 4; --filter chooses
settings by their names, and the PLY is always among them.
"""
import os
import re
import shlex
import time

from common import Failure, last_line, run
from training import read_json

# Name, ending, options of gart convert.
SETTINGS = (("PLY", ".ply", []),
            ("GLB", ".glb", []),
            ("compressed PLY", ".compressed.ply", []),
            ("SPZ", ".spz", []),
            ("SPZ, bits 5,4", ".spz", ["--sh-bits", "5,4"]),
            ("SPZ, bits 5,5", ".spz", ["--sh-bits", "5,5"]),
            ("SPZ, bits 8,8", ".spz", ["--sh-bits", "8,8"]),
            ("SPZ, SH 2", ".spz", ["--sh-degree", "2"]),
            ("SPZ, SH 1", ".spz", ["--sh-degree", "1"]),
            ("SPZ, SH 0", ".spz", ["--sh-degree", "0"]),
            ("SPZ, no opacity under 0.02", ".spz", ["--prune", "0.02"]),
            ("SOG", ".sog", []),
            ("SOG, palette of 512", ".sog", ["--palette", "512"]),
            ("SOG, palette of 4096", ".sog", ["--palette", "4096"]),
            ("SOG, SH 0", ".sog", ["--sh-degree", "0"]),
            ("splat", ".splat", []))


class Formats:
    def formats(self):
        for name, ply, capture in self.a.model:
            runs = []
            wanted = [s for s in SETTINGS if s is SETTINGS[0] or re.search(self.a.filter, s[0])]
            for setting, ending, options in wanted:
                out = os.path.join(self.temporary, "model" + ending)
                scores = os.path.join(self.temporary, "scores.json")
                began = time.monotonic()
                done = run([self.program("gart"), "convert", ply, out, *options])
                seconds = time.monotonic() - began
                if done.returncode == 0:
                    done = run([self.program("gart"), "eval", out, capture, "--out", scores, "--backend",
                                self.a.backend, "--quiet", *shlex.split(self.a.train)])
                if done.returncode != 0:
                    raise Failure(f"{name}, {setting}: {last_line(done.stderr)}")
                result = read_json(scores)
                row = {"setting": setting, "bytes": os.path.getsize(out), "gaussians": result["gaussians"],
                       "sh_degree": result["sh_degree"], "psnr": result["psnr"], "ssim": result["ssim"],
                       "convert_seconds": seconds}
                row["share"] = row["bytes"] / os.path.getsize(ply)
                row["psnr_lost"] = (runs[0]["psnr"] if runs else row["psnr"]) - row["psnr"]
                self.say(f"{name}, {setting}: {row['share']:.3f} of the PLY, {row['psnr']:.2f} dB, "
                         f"{row['psnr_lost']:.3f} lost, converted in {seconds:.1f} s")
                runs.append(row)
            self.write("formats_" + name, runs, scene=name)
