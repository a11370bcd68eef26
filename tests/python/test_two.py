"""Two modules of gart in one process: each renders, and raises its own errors."""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import gart

PROGRAM = """import sys
modules = []
for folder in sys.argv[1:]:
    for name in [name for name in sys.modules if name.split(".")[0] == "gart"]:
        del sys.modules[name]
    sys.path.insert(0, folder)
    import gart
    modules.append(gart)
    assert gart.__file__.startswith(folder), gart.__file__
one, other = modules
assert one.Camera is not other.Camera and one.InvalidArgument is not other.InvalidArgument
for gart in modules:
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
            shutil.copytree(here, pathlib.Path(folder) / "gart")
            done = subprocess.run([sys.executable, "-c", PROGRAM, str(here.parent), folder], capture_output=True, text=True)
        self.assertEqual(done.stdout.split(), ["render_options.near"] * 2, done.stderr)


if __name__ == "__main__":
    unittest.main()
