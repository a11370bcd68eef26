"""Two gart in one process, one of them inside another package: each renders, and raises its own errors."""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import gart

PROGRAM = """import sys
sys.path[:0] = sys.argv[1:]
import gart as one
import other.gart as other
assert one.__file__.startswith(sys.argv[2]) and other.__file__.startswith(sys.argv[1]), (one.__file__, other.__file__)
assert one.Camera is not other.Camera and one.InvalidArgument is not other.InvalidArgument
for gart in (one, other):
    renderer = gart.Renderer(backend="serial", sh_degree=0)
    try:
        renderer.render(gart.Camera(4, 4, 5, 5), near=-1.0)
    except gart.InvalidArgument as e:
        print(e.field)
"""


class Two(unittest.TestCase):
    def test_two_modules_keep_apart(self):
        here = pathlib.Path(gart.__file__).resolve().parent
        with tempfile.TemporaryDirectory() as folder:
            folder = str(pathlib.Path(folder).resolve())
            shutil.copytree(here, pathlib.Path(folder) / "other" / "gart")
            done = subprocess.run([sys.executable, "-c", PROGRAM, folder, str(here.parent)], capture_output=True, text=True)
        self.assertEqual(done.stdout.split(), ["render_options.near"] * 2, done.stderr)


if __name__ == "__main__":
    unittest.main()
