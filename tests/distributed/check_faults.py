"""gart on several ranks. Trained, rendered and scored by three is the same, file by file, as by one. Of a training of which
one rank dies or fails all end within 30 s, what is said names the rank, and the checkpoint that was there before is
whole: one rank goes on from it.

usage: check_faults.py GART WORK_FOLDER LAUNCHER...     the launcher up to the number of ranks
"""
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time

from small_capture import expect, options_of, run, write_capture

gart, folder, launcher = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3:]
shutil.rmtree(folder, ignore_errors=True)
folder.mkdir(parents=True)
capture = folder / "capture"


def options(out, steps, exposure="off", test_every=0):
    return [gart, *options_of(capture, folder / out, steps, exposure, test_every)]


def ranks_of(launch):
    """Process by rank, of those that the launcher started."""
    found = {}
    for process in pathlib.Path("/proc").iterdir():
        if not process.name.isdigit():
            continue
        try:
            environment = (process / "environ").read_bytes().split(b"\0")
            words = (process / "cmdline").read_bytes().split(b"\0")
        except OSError:
            continue
        if os.fsencode(folder / "killed") not in words or os.path.basename(words[0]) != b"gart":
            continue
        for entry in environment:
            if entry.startswith((b"OMPI_COMM_WORLD_RANK=", b"PMI_RANK=")):
                found[int(entry.split(b"=")[1])] = int(process.name)
    return found


# Where each is; rank 0 alone talks.
info = run(*launcher, 3, gart, "info")
expect(info.returncode == 0 and info.stdout.count("gart       ") == 1 and "started here: 3" in info.stdout and
       all(info.stdout.count(f"rank {r} on {os.uname().nodename}, ") == 1 for r in range(3)), f"info:\n{info.stdout}{info.stderr}")

write_capture(capture)

# The same run by 1 and by 3 ranks, where sums have a fixed order, and what is said.
alone = run(*launcher, 1, *options("alone", 60), "--batch", 2, "--backward", "deterministic")
expect(alone.returncode == 0, f"1 rank: {alone.stderr}")
three = run(*launcher, 3, *options("three", 60), "--batch", 2, "--backward", "deterministic")
expect(three.returncode == 0, f"3 ranks: {three.stderr}")
expect((folder / "alone/model.ply").read_bytes() == (folder / "three/model.ply").read_bytes(), "the models differ")
expect((folder / "alone/checkpoint.gart").read_bytes() == (folder / "three/checkpoint.gart").read_bytes(),
       "the checkpoints differ")
expect(re.search(r"  3 ranks: .* steps/s, .* each$", three.stderr, re.MULTILINE),
       f"progress says nothing of the ranks:\n{three.stderr}")
expect(three.stdout.count("trained ") == 1 and three.stderr.count("3 ranks, ") == 1, f"rank 0 alone talks:\n{three.stderr}")

# With exposures and poses that are learned, and test views, which are aligned to their photographs.
for name, count in (("one_posed", 1), ("three_posed", 3)):
    done = run(*launcher, count, *options(name, 40, "on", 4), "--refine-poses", "--batch", 2, "--backward", "deterministic")
    expect(done.returncode == 0, f"{name}: {done.stderr}")
for file in ("model.ply", "exposures.json", "poses.json", "poses_test.json", "renders/0.png"):
    expect((folder / "one_posed" / file).read_bytes() == (folder / "three_posed" / file).read_bytes(), f"{file} differs")

# Three blocks of rows: each rank writes its own and reads its own, from a checkpoint and from a model to start from.
def blocks(out, count, *more):
    done = run(*launcher, count, gart, *more, "--out", folder / out, "--threads", 1)
    expect(done.returncode in (0, 130), f"{out}: {done.stderr}")
    return done


many = ["train", capture, "--iterations", 12, "--stop-at", 6, "--points", 9000, "--max-gaussians", 9500, "--test-every", 0,
        "--sh-degree", 1, "--no-auto", "--background", "black", "--exposure", "off", "--backward", "deterministic", "--batch", 2]
for count in (1, 2, 3, 4):
    blocks(f"blocks_{count}", count, *many)
for file in ("model.ply", "checkpoint.gart"):
    files = [(folder / f"blocks_{count}" / file).read_bytes() for count in (1, 2, 3, 4)]
    expect(files.count(files[0]) == 4 and len(files[0]) > 9000 * 4, f"{file} differs by the number of ranks")
for count in (1, 2, 3):
    shutil.copytree(folder / "blocks_4", folder / f"resumed_{count}")
    blocks(f"resumed_{count}", count, "train", "--resume", "--stop-at", 0)
files = [(folder / f"resumed_{count}/checkpoint.gart").read_bytes() for count in (1, 2, 3)]
expect(files.count(files[0]) == 3, "a run goes on otherwise with another number of ranks")
started = [word for word in many if word not in ("--points", 9000)] + ["--start", folder / "blocks_1/model.ply"]
for count in (1, 3):
    blocks(f"started_{count}", count, *started)
expect((folder / "started_1/checkpoint.gart").read_bytes() == (folder / "started_3/checkpoint.gart").read_bytes(),
       "a start differs by the number of ranks")

# Where the model cannot be put in its place all end, and the checkpoint is the last one.
(folder / "started_3/model.ply").unlink()
(folder / "started_3/model.ply/in the way").mkdir(parents=True)
before = (folder / "started_3/checkpoint.gart").read_bytes()
failed = run(*launcher, 3, gart, "train", "--resume", "--stop-at", 8, "--out", folder / "started_3", "--threads", 1)
expect(failed.returncode == 1, "a rank that cannot write is no success")
expect("rank 0 of 3" in failed.stderr and "model.ply" in failed.stderr and "cannot be replaced" in failed.stderr,
       f"its message:\n{failed.stderr}")
expect((folder / "started_3/checkpoint.gart").read_bytes() == before, "the last checkpoint is not whole")
expect(not list((folder / "started_3").glob(".*.tmp")), "a temporary file stays")

# Views that are dealt out.
for name, count in (("one", 1), ("three", 3)):
    done = run(*launcher, count, gart, "render", folder / "three/model.ply", capture, "--out", folder / f"images_{name}",
               "--json", folder / f"timings_{name}.json")
    expect(done.returncode == 0 and done.stdout.count("4 views in") == 1, f"render by {name}: {done.stdout} {done.stderr}")
    done = run(*launcher, count, gart, "eval", folder / "three/model.ply", capture, "--out", folder / f"scores_{name}.json",
               "--renders", folder / f"images_{name}", "--test-every", 2)
    expect(done.returncode == 0, f"eval by {name}: {done.stderr}")
views = [[view["name"] for view in json.loads((folder / f"timings_{n}.json").read_text())["views"]] for n in ("one", "three")]
expect(views[0] == views[1] and len(views[0]) == 4, f"the views' order: {views}")
images = [{p.name: p.read_bytes() for p in (folder / f"images_{n}").iterdir()} for n in ("one", "three")]
expect(images[0] == images[1] and len(images[0]) == 6, "the images differ")
scores = [json.loads((folder / f"scores_{n}.json").read_text()) for n in ("one", "three")]
for key in ("psnr", "ssim", "psnr_affine_colour"):
    expect(scores[0][key] == scores[1][key], f"{key} differs: {scores[0][key]}, {scores[1][key]}")

# A rank that is killed.
launch = subprocess.Popen([str(c) for c in [*launcher, 3, *options("killed", 1000000)]], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True)
began = time.monotonic()
while not (folder / "killed/checkpoint.gart").exists() or len(ranks_of(launch)) < 3:
    expect(launch.poll() is None and time.monotonic() - began < 100, "the run does not begin")
    time.sleep(0.1)
time.sleep(1)
os.kill(ranks_of(launch)[1], signal.SIGKILL)
killed = time.monotonic()
output = "".join(launch.communicate(timeout=60))
print(f"all ended {time.monotonic() - killed:.1f} s after rank 1 was killed")
expect(time.monotonic() - killed < 30, "the others did not end within 30 s")
expect(launch.returncode != 0, "a killed rank is no success")
expect("rank 1" in output, f"the message does not name rank 1:\n{output}")
resumed = run(gart, "train", "--resume", "--out", folder / "killed", "--stop-at", 5, "--threads", 1)
expect(resumed.returncode == 130, f"one rank does not go on from the checkpoint: {resumed.stderr}")

# A rank that fails: it alone is told of a model that is not there.
script = folder / "rank1.sh"
script.write_text(f"""#!/bin/sh
if [ "${{OMPI_COMM_WORLD_RANK:-$PMI_RANK}}" = 1 ]; then exec "$@" --start {folder}/no_such_model.ply; fi
exec "$@"
""")
script.chmod(0o755)
began = time.monotonic()
failed = run(*launcher, 3, script, *options("failed", 100000))
expect(time.monotonic() - began < 60 and failed.returncode != 0, "a rank that fails ends all")
expect("rank 1 of 3" in failed.stderr and "no_such_model.ply" in failed.stderr, f"its message:\n{failed.stderr}")
print("passed")
