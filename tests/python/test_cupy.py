"""Arrays of a CUDA device by CuPy; skipped without CuPy, a device or a build for it."""
import importlib.util
import unittest

import gart
import numpy as np
import scenes

if importlib.util.find_spec("cupy") is None or gart.resolve()["backend"] != "cuda":
    raise unittest.SkipTest("no CuPy (cupy-cuda13x), or no CUDA device that gart was built for")
import cupy

NAMES = ("mean", "log_scale", "quaternion", "opacity", "sh")


class CuPy(unittest.TestCase):
    def setUp(self):
        self.view = scenes.camera()
        self.arrays = [cupy.asarray(a) for a in scenes.parameters()]
        self.renderer = gart.Renderer(sh_degree=1, backend="cuda")
        self.renderer.bind(*self.arrays)

    def test_images_are_those_of_numpy_and_torch(self):
        """The same bits: from a copy of the model, into CuPy's memory and into torch's."""
        expected = gart.Renderer(scenes.model(), backend="cuda").render(self.view)["color"]
        color = cupy.full((32, 40, 3), 7, np.float32)
        self.renderer.render_to(self.view, color=color)
        np.testing.assert_array_equal(cupy.asnumpy(color), expected)
        if importlib.util.find_spec("torch"):
            import torch
            gart_torch = importlib.import_module("gart.torch")
            tensors = [torch.from_numpy(a).cuda() for a in scenes.parameters()]
            np.testing.assert_array_equal(gart_torch.render(*tensors, self.view)[0].cpu(), expected)

    def test_memory_is_lent(self):
        """What is written to the arrays that were bound is seen: they are not copied."""
        before, after = (cupy.empty((32, 40, 3), np.float32) for _ in range(2))
        self.renderer.render_to(self.view, color=before)
        self.arrays[4][:] = 0.5
        self.renderer.render_to(self.view, color=after)
        self.assertGreater(float(abs(after - before).max()), 0.05)

    def test_gradients_are_the_hosts(self):
        gradient = np.random.default_rng(3).normal(0, 1, (32, 40, 3)).astype(np.float32)
        expected = gart.Renderer(scenes.model(), backend="openmp").backward(self.view, gradient)
        out = {name: cupy.empty_like(a) for name, a in zip(NAMES, self.arrays)}
        self.renderer.forward(self.view).backward(cupy.asarray(gradient), **out)
        for name in NAMES:
            most = np.abs(expected[name]).max()
            np.testing.assert_allclose(cupy.asnumpy(out[name]), expected[name], rtol=2e-3, atol=2e-3 * most)

    def test_arrays_of_the_host_are_refused(self):
        with self.assertRaisesRegex(gart.InvalidArgument, "Renderer.bind: mean must be .* on cuda:0; it is .* on the host"):
            self.renderer.bind(*scenes.parameters())
        with self.assertRaisesRegex(gart.InvalidArgument, "must be .* on the host; it is .* on cuda:0"):
            gart.Renderer(sh_degree=1, backend="openmp").bind(*self.arrays)

    def test_memory_is_flat_over_many_calls(self):
        """In one of three tries: other processes may take the device's memory meanwhile."""
        out = {name: cupy.empty_like(a) for name, a in zip(NAMES, self.arrays)}
        color = cupy.ones((32, 40, 3), np.float32)

        def free_after(calls):
            for _ in range(calls):
                self.renderer.bind(*self.arrays)
                self.renderer.forward(self.view, color=color).backward(color, **out)
            self.renderer.wait()
            return cupy.cuda.runtime.memGetInfo()[0]

        lost = [free_after(100) - free_after(1000) for _ in range(3)]
        self.assertLessEqual(min(lost), 2 ** 21)


if __name__ == "__main__":
    unittest.main()
