"""The example that trains in torch, on photographs of a small model in Blender's format; skipped without torch."""
import importlib.util
import json
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

import gart
import numpy as np
import scenes
from test_training import looking

SCRIPT = pathlib.Path(__file__).parents[2] / "examples" / "python" / "train_lego.py"


def write_png(path, pixels):
    """uint8 [H, W, 4]."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    height, width, _ = pixels.shape
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)) +
                     chunk(b"IDAT", zlib.compress(rows, 1)) + chunk(b"IEND", b""))


def write_capture(folder, views=8, size=128):
    renderer = gart.Renderer(scenes.model(n=30, degree=0), backend="openmp")
    for part, turn in (("train", 0.0), ("test", 0.4)):
        frames = []
        for k in range(views if part == "train" else 1):
            angle = turn + 2 * np.pi * k / views
            view = gart.Camera(size, size, size, size, c2w=looking((4 * np.sin(angle), 0.5, -4 * np.cos(angle))))
            seen = renderer.render(view)
            pixels = np.concatenate([seen["color"], 1 - seen["transmittance"][..., None]], -1)
            pixels[..., :3] /= np.maximum(pixels[..., 3:], 1e-3)
            write_png(folder / f"{part}_{k}.png", np.uint8(255 * pixels.clip(0, 1) + 0.5))
            opengl = view.c2w @ np.diag([1, -1, -1, 1])
            frames.append({"file_path": f"./{part}_{k}", "transform_matrix": opengl.tolist()})
        (folder / f"transforms_{part}.json").write_text(
            json.dumps({"camera_angle_x": 2 * np.arctan(0.5), "frames": frames}))


class Example(unittest.TestCase):
    @unittest.skipIf(importlib.util.find_spec("torch") is None, "no torch (python3-torch)")
    def test_torch_trains_a_capture(self):
        with tempfile.TemporaryDirectory() as temporary:
            folder = pathlib.Path(temporary)
            write_capture(folder)
            done = subprocess.run([sys.executable, SCRIPT, folder, "80", folder / "model.ply"], capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            scores = [float(s) for s in re.findall(r"test PSNR ([\d.]+)", done.stdout)]
            self.assertEqual(len(scores), 11)
            self.assertGreater(scores[-1], scores[0] + 6, done.stdout)
            self.assertIn(len(gart.load_model(folder / "model.ply")), (10_000, 100_000))


if __name__ == "__main__":
    unittest.main()
