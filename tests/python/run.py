"""Runs the tests of this folder; 77 where numpy is missing. Words after it choose tests by name."""
import importlib.util
import pathlib
import sys
import unittest

if importlib.util.find_spec("numpy") is None:
    print(f"skipped: {sys.executable} has no numpy (python3-numpy)")
    sys.exit(77)
folder = str(pathlib.Path(__file__).parent)
sys.path.insert(0, folder)
loader = unittest.TestLoader()
if sys.argv[1:]:
    loader.testNamePatterns = [f"*{word}*" for word in sys.argv[1:]]
result = unittest.TextTestRunner(verbosity=2).run(loader.discover(folder))
sys.exit(not result.wasSuccessful())
