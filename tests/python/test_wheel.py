"""A wheel of this build, installed into an empty folder and imported from there."""
import importlib.util
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
import zipfile

import gart

MAKE = pathlib.Path(__file__).parents[2] / "python" / "make_wheel.py"
PROGRAM = """import gart, pathlib, sys
assert pathlib.Path(gart.__file__).parent == pathlib.Path(sys.argv[1]) / "gart", gart.__file__
print(gart.__version__, gart.Renderer(backend="serial").configuration["backend"])
try:
    import torch
except ImportError:
    sys.exit()
import gart.torch
gart.torch.rasterization
"""


class Wheel(unittest.TestCase):
    def test_a_wheel_installs_and_runs(self):
        with tempfile.TemporaryDirectory() as temporary:
            folder = pathlib.Path(temporary).resolve()
            package = pathlib.Path(gart.__file__).parent
            made = subprocess.run([sys.executable, MAKE, package, folder], capture_output=True, text=True)
            if "gart's shared libraries" in made.stderr:
                self.skipTest("the build is of shared libraries")
            self.assertEqual(made.returncode, 0, made.stderr)
            wheel, to = pathlib.Path(made.stdout.strip()), folder / "installed"
            ours = f"cp{sys.version_info.major}{sys.version_info.minor}"
            tag = "cp312-abi3" if ".abi3." in gart._gart.__file__ else f"{ours}-{ours}"
            self.assertTrue(wheel.name.startswith(f"gart-{gart.__version__}-{tag}-"), wheel.name)
            if importlib.util.find_spec("pip"):
                done = subprocess.run([sys.executable, "-m", "pip", "install", "--no-index", "--no-deps", "--target", to, wheel],
                                      capture_output=True, text=True)
                self.assertEqual(done.returncode, 0, done.stderr)
            else:
                zipfile.ZipFile(wheel).extractall(to)
            environment = {**os.environ, "PYTHONPATH": str(to)}
            done = subprocess.run([sys.executable, "-c", PROGRAM, to], capture_output=True, text=True, env=environment,
                                  cwd=folder)
            self.assertEqual((done.stdout.strip(), done.returncode), (f"{gart.__version__} serial", 0), done.stderr)
            refused = subprocess.run([sys.executable, MAKE, folder, folder], capture_output=True, text=True)
            self.assertIn("build the target gart_python", refused.stderr)


if __name__ == "__main__":
    unittest.main()
