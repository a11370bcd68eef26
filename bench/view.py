"""The part `view` of bench/run.py: what the viewer reaches (docs/rendering.md).

Each --model NAME PLY CAMERAS is served by `gart view`; a client asks for views as the page does: one each sixtieth of a
second along a smooth path through the cameras, and one at rest a moment after the last. Measured are frames a second,
their size, the time from an input to the first frame that shows it, and from the last motion to the whole view at rest.

Each --capture NAME DATASET is trained without a viewer, with one that nobody opens, and with a client that moves all the
time; each --repeats times, in turns. Compared are the seconds of the steps with what lies between them: loading, testing
and saving taken off.
"""
import os
import resource
import shlex
import shutil
import statistics
import time

from common import Failure, last_line, run
from training import read_json
from view_client import Client, Served

# As the page has them: seconds between two views that it asks for, and without a motion until it asks for one at rest.
INPUT_EVERY, REST_AFTER = 1 / 60, 0.15
PATH_FRAMES = 600


def sized(camera, pixels):
    """The same camera with an image of about so many pixels."""
    scale = (pixels / (camera["width"] * camera["height"])) ** 0.5
    out = dict(camera)
    for size, fields in (("width", ("fx", "cx", "f")), ("height", ("fy", "cy"))):
        out[size] = max(16, round(camera[size] * scale))
        for field in fields:
            if field in out:
                out[field] *= out[size] / camera[size]
    out.pop("name", None)
    return out


def at_share(values, share):
    values = sorted(values)
    return values[min(len(values) - 1, int(share * len(values)))]


class Mover:
    """Moves a client along a path, there and back."""

    def __init__(self, client, cameras, pixels):
        self.client = client
        some = [sized(c, pixels) for c in cameras[:8]]
        same = [{**c, "width": some[0]["width"], "height": some[0]["height"]} for c in some]
        client.say({"type": "path", "id": 1, "keyframes": same, "frames": PATH_FRAMES, "closed": False})
        there = [{k: v for k, v in c.items() if k != "name"} for c in client.wait("path")["cameras"]]
        self.path, self.at = there + there[::-1], 0

    def move(self, seconds, ends=lambda: False):
        """[(number, when it was asked for)] of the inputs."""
        inputs, began = [], time.monotonic()
        while time.monotonic() < began + seconds and not ends():
            due = began + len(inputs) * INPUT_EVERY
            while time.monotonic() < due:
                self.client.take(due - time.monotonic())
            inputs.append(self.client.view(self.path[self.at % len(self.path)], True))
            self.at += 1
        return inputs

    def rest(self):
        """Seconds from the last motion to the whole view."""
        _, moved = self.move(INPUT_EVERY)[-1]
        while time.monotonic() < moved + REST_AFTER:
            self.client.take(moved + REST_AFTER - time.monotonic())
        number, _ = self.client.view(self.path[(self.at - 1) % len(self.path)], False)
        while True:
            for came, header, _ in self.client.frames:
                if header["id"] == number and header["still"]:
                    return came - moved
            self.client.take(0.1)


class View:
    def view(self):
        for name, ply, cameras in self.a.model:
            self.write("view_" + name, [self.viewed(name, ply, cameras)], scene=name)
        for name, dataset in self.a.capture:
            self.write("view_training_" + name, self.trained(name, dataset), scene=name)

    def viewed(self, name, ply, cameras):
        listed = read_json(cameras) if cameras.endswith(".json") else None
        command = [self.program("gart"), "view", ply, *([] if isinstance(listed, list) else [cameras]), "--backend",
                   self.a.backend]
        with Served(command) as server:
            client = Client(server.address)
            all_cameras = listed if isinstance(listed, list) else [c["camera"] for c in client.hello["cameras"]]
            mover = Mover(client, all_cameras, self.a.pixels)
            mover.move(3)  # gart learns how long a pixel takes
            client.frames.clear()
            inputs = mover.move(self.a.seconds)
            began, ended = inputs[0][1], time.monotonic()
            came = [(when, h, size) for when, h, size in client.frames if when <= ended]
            if len(came) < 2:
                raise Failure(f"{name}: {len(came)} frames in {self.a.seconds} s")
            # To the first frame of that input or a later one.
            late, next_frame = [], 0
            for number, asked in inputs:
                while next_frame < len(came) and came[next_frame][1]["id"] < number:
                    next_frame += 1
                if next_frame < len(came):
                    late.append(1000 * (came[next_frame][0] - asked))
            rests = [mover.rest() for _ in range(9)]
            whole = [h for _, h, _ in client.frames if h["still"]]
            full = whole[-1]["full"]
            row = {"scene": name, "gaussians": client.hello["model"]["gaussians"], "backend": self.a.backend,
                   "canvas": full, "frames_a_second": len(came) / (ended - began),
                   "moving_size": [statistics.median(h[side] for _, h, _ in came) for side in ("width", "height")],
                   "moving_ms": statistics.median(h["ms"] for _, h, _ in came),
                   "moving_bytes": statistics.median(size for _, _, size in came),
                   "input_to_frame_ms": {"median": statistics.median(late), "share_95": at_share(late, 0.95)},
                   "rest_ms": statistics.median(h["ms"] for h in whole),
                   "motion_to_whole_s": {"median": statistics.median(rests), "most": max(rests)}}
            client.close()
        self.say(f"{name}: {row['frames_a_second']:.1f} frames a second of {row['moving_size']} of {full}, input to "
                 f"frame {row['input_to_frame_ms']['median']:.0f} ms, whole after {row['motion_to_whole_s']['median']:.2f} s")
        return row

    def trained(self, name, dataset):
        ways = {"without": [], "nobody": ["--view"], "client": ["--view"]}
        runs = {way: [] for way in ways}
        for repeat in range(self.a.repeats):
            # In another order each time, so that what a machine does besides falls on each.
            order = list(ways)[repeat % 3:] + list(ways)[:repeat % 3]
            for way in order:
                runs[way].append(self.one_training(name, dataset, way, ways[way]))
                self.say(f"{name}, {way}: {runs[way][-1]['seconds']:.2f} s, {runs[way][-1]['processor_seconds']:.2f} s "
                         "of the processor")
        usual = {way: {key: statistics.median(r[key] for r in rows) for key in ("seconds", "processor_seconds")}
                 for way, rows in runs.items()}
        out = []
        for way, rows in runs.items():
            slower = {key: value / usual["without"][key] - 1 for key, value in usual[way].items()}
            out.append({"viewer": way, **usual[way], "slower": slower["seconds"],
                        "slower_processor": slower["processor_seconds"], "runs": rows})
            self.say(f"{name}, {way}: {100 * slower['seconds']:.2f} % slower, of the processor "
                     f"{100 * slower['processor_seconds']:.2f} %")
        return out

    def one_training(self, name, dataset, way, options):
        folder = os.path.join(self.temporary, "viewed")
        shutil.rmtree(folder, ignore_errors=True)
        command = [self.program("gart"), "train", dataset, "--out", folder, "--backend", self.a.backend, "--no-auto",
                   *shlex.split(self.a.train), *options]
        before, began, frames = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic(), 0
        if options:
            with Served(command) as server:
                if way == "client":
                    frames = self.watch(server)
                code, said = server.process.wait(), server.text()
        else:
            done = run(command)
            code, said = done.returncode, done.stderr
        if code != 0:
            raise Failure(f"{name}, {way}: {last_line(said)}")
        wall, after = time.monotonic() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
        result = read_json(os.path.join(folder, "metrics.json"))
        besides = sum(result["wall_seconds"][part] for part in ("loading", "testing", "saving"))
        return {"seconds": wall - besides, "steps_seconds": result["wall_seconds"]["training"], "frames": frames,
                "iterations": result["iterations"], "psnr": result["psnr"],
                "processor_seconds": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime}

    def watch(self, server):
        """Moves until the training ends; the number of frames that came."""
        client = Client(server.address)
        mover = Mover(client, [c["camera"] for c in client.hello["cameras"]], self.a.pixels)
        try:
            mover.move(3600, lambda: server.process.poll() is not None)
        except (Failure, OSError):
            server.process.wait()  # it ended
        return len(client.frames)
