"""What the binding does by itself is the same by nanobind and by pybind11."""
import gc
import subprocess
import sys
import unittest
import weakref

import gart
import numpy as np
import scenes

PROGRAM = """import gart, threading
held, never = threading.Event(), threading.Event()
def hold():
    view = gart.Camera(4, 4, 5, 5)
    held.set()
    never.wait()
threading.Thread(target=hold, daemon=True).start()
held.wait()
"""


class Binding(unittest.TestCase):
    def test_values_of_another_type_are_named(self):
        renderer, view = gart.Renderer(sh_degree=1, backend="serial"), scenes.camera()
        renderer.bind(*scenes.parameters())
        data = gart.Dataset([gart.View("a", view, np.zeros((32, 40, 3), np.uint8))])
        wrong = {
            "Renderer: sh_degree cannot be 'one'": lambda: gart.Renderer(sh_degree="one"),
            "Renderer: threads cannot be 1.5": lambda: gart.Renderer(threads=1.5),
            "Renderer: backend cannot be 3": lambda: gart.Renderer(backend=3),
            "Renderer: model cannot be 3": lambda: gart.Renderer(3),
            "Session: options cannot be 3": lambda: gart.Session(data, 3),
            "Session: start cannot be 3": lambda: gart.Session(data, start=3),
            "train_options.iterations cannot be 'many'": lambda: gart.TrainOptions(iterations="many"),
            "options cannot be 3": lambda: renderer.render(view, 3),
            "resolve: no argument 'color': there are backend": lambda: gart.resolve(color=1),
            "no option 'color': there are alpha_min": lambda: renderer.render(view, color=1),
            "incompatible function arguments": lambda: renderer.render("a camera"),
        }
        for text, call in wrong.items():
            with self.assertRaisesRegex(TypeError, text):
                call()

    def test_arrays_of_none_are_named(self):
        renderer, view = gart.Renderer(scenes.model(), backend="serial"), scenes.camera()
        mean, *rest = scenes.parameters()
        wrong = {
            "Renderer.bind: mean": lambda: renderer.bind(None, *rest),
            "Model: sh": lambda: gart.Model(mean, *rest[:3], None),
            "View: image": lambda: gart.View("a", view, None),
            "Renderer.trace: directions": lambda: renderer.trace(None),
            "Renderer.backward: color_gradient": lambda: renderer.backward(view, None),
            "track: photo": lambda: gart.track(renderer, None, view),
        }
        for text, call in wrong.items():
            with self.assertRaisesRegex(gart.InvalidArgument, f"{text} must be an array.*not <class 'NoneType'>"):
                call()

    def test_numbers_come_by_any_kind(self):
        view = gart.Camera(np.int64(40), 32, fx=np.float32(35), fy=36, c2w=scenes.C2W.tolist())
        np.testing.assert_allclose(view.c2w, scenes.C2W, atol=1e-7)
        options = gart.RenderOptions(near=1, background=np.array([0.1, 0.2, 0.3]), max_hits=np.int32(5))
        self.assertEqual((options.near, options.max_hits), (1.0, 5))
        np.testing.assert_allclose(options.background, [0.1, 0.2, 0.3], rtol=1e-6)

    def test_classes_may_be_derived_from(self):
        class Mine(gart.Renderer):
            def __init__(self, name):
                super().__init__(scenes.model(), backend="serial")
                self.name = name

        mine = Mine("mine")
        self.assertEqual((mine.name, len(mine)), ("mine", 40))
        expected = gart.Renderer(scenes.model(), backend="serial").render(scenes.camera())["color"]
        np.testing.assert_array_equal(mine.render(scenes.camera())["color"], expected)

    def test_objects_go_and_keep_what_they_need(self):
        renderer = gart.Renderer(sh_degree=1, backend="serial")
        arrays = scenes.parameters()
        renderer.bind(*arrays)
        of_renderer, of_array = weakref.ref(renderer), weakref.ref(arrays[0])
        gradient = np.ones((32, 40, 3), np.float32)
        out = dict(zip(("mean", "log_scale", "quaternion", "opacity", "sh"), [np.zeros_like(a) for a in arrays]))
        del arrays
        context = renderer.forward(scenes.camera())
        del renderer
        gc.collect()
        context.backward(gradient, **out)
        self.assertGreater(np.abs(out["sh"]).max(), 0)
        del context
        gc.collect()
        self.assertIsNone(of_renderer())
        self.assertIsNone(of_array())

    def test_arrays_may_be_empty(self):
        renderer = gart.Renderer(scenes.model(), backend="serial")
        hits = renderer.list_hits(np.array([[0, 1, 0]], np.float32), frame=(0, 100, 0))
        self.assertEqual((hits["ids"].shape, hits["ids"].dtype, hits["t"].shape), ((0,), np.uint32, (0,)))
        self.assertEqual(hits["offsets"].tolist(), [0, 0])

    def test_texts_are_the_modules(self):
        self.assertTrue(gart.Renderer.__doc__.startswith("Renders and differentiates views of one model."))
        self.assertIn("A view as a dictionary of new numpy arrays:", gart.Renderer.render.__doc__)
        self.assertEqual(gart.Camera.c2w.__doc__, "camera to world, float64 [4, 4]; reading makes a copy")
        self.assertEqual(gart.Model.kernel_degree.__doc__, "2: Gaussians")

    def test_a_process_ends_in_silence(self):
        """Also where a thread that goes on has an object of gart's."""
        done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))


if __name__ == "__main__":
    unittest.main()
