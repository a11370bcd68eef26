"""The types in _gart.pyi are of what the module has, and of all of it."""
import ast
import pathlib
import unittest

import gart


def names_of(body):
    out = set()
    for node in body:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            out.add(node.name)
        elif isinstance(node, ast.AnnAssign):
            out.add(node.target.id)
    return {name for name in out if not name.startswith("_") or name == "__len__"}


class Stubs(unittest.TestCase):
    def test_names_are_the_modules(self):
        tree = ast.parse(pathlib.Path(gart.__file__).with_name("_gart.pyi").read_text())
        classes = {node.name: names_of(node.body) for node in tree.body if isinstance(node, ast.ClassDef)}
        # Types that stand in the stub alone: shapes of dictionaries.
        alone = {name for name in classes if not hasattr(gart._gart, name)}
        self.assertEqual(alone - {"_Dlpack"}, {"Image", "PoseGradient", "Gradients", "ViewScore", "Scores"})
        there = {name for name in dir(gart._gart) if not name.startswith("_")}
        self.assertEqual(names_of(tree.body) - alone, there)
        for name in there & set(classes):
            members = {m for m in vars(getattr(gart._gart, name)) if not m.startswith("_") or m == "__len__"}
            self.assertEqual(classes[name], members, name)

    def test_what_can_be_called_has_a_text(self):
        for name in dir(gart._gart):
            if not name.startswith("_") and name not in ("resolve", "configurations"):
                self.assertTrue(len(getattr(gart._gart, name).__doc__) > 10, name)


if __name__ == "__main__":
    unittest.main()
