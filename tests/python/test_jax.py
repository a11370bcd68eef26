"""gart.jax with a stand-in for the three names of JAX that it calls, and with JAX where it is."""
import importlib.util
import os
import sys
import types
import unittest
from unittest import mock

import gart
import numpy as np
import scenes


class ShapeDtypeStruct:
    def __init__(self, shape, dtype):
        self.shape, self.dtype = shape, dtype


class Lent:
    """An array as JAX shows it on the CPU: immutable, by DLPack and __array__."""

    def __init__(self, array):
        self.array, self.shape = array, array.shape

    def __dlpack__(self, *, stream=None, max_version=None, dl_device=None, copy=None):
        return self.array.__dlpack__()

    def __dlpack_device__(self):
        return self.array.__dlpack_device__()

    def __array__(self, dtype=None):
        seen = self.array.view() if dtype in (None, self.array.dtype) else self.array.astype(dtype)
        seen.flags.writeable = False
        return seen


def pure_callback(callback, result_shape_dtypes, *args):
    """Of arrays, or tuples of them, to new arrays that are what was said."""
    out = callback(*args)
    assert type(out) is type(result_shape_dtypes) and len(out) == len(result_shape_dtypes)
    for got, said in zip(out, result_shape_dtypes):
        assert (got.shape, got.dtype) == (said.shape, said.dtype), (got.shape, said.shape)
    return tuple(Lent(got) for got in out)


class custom_vjp:
    def __init__(self, function):
        self.function = function

    def defvjp(self, forward, backward):
        self.forward, self.backward = forward, backward

    def __call__(self, *args):
        return self.function(*args)


class Jax(unittest.TestCase):
    def setUp(self):
        made = []

        class Kept(custom_vjp):
            def __init__(self, function):
                super().__init__(function)
                made.append(self)
        self.made = made
        fake = types.SimpleNamespace(ShapeDtypeStruct=ShapeDtypeStruct, pure_callback=pure_callback, custom_vjp=Kept)
        with mock.patch.dict(sys.modules, {"jax": fake}):
            import gart.jax
        self.addCleanup(sys.modules.pop, "gart.jax", None)
        self.render = gart.jax.render

    def test_images_and_gradients_are_the_reference(self):
        model, view = scenes.model(n=30, degree=1), scenes.camera()
        arrays = [Lent(a) for a in scenes.parameters(n=30, degree=1)]
        expected = gart.reference(model, view, **scenes.SMOOTH)
        for got, name in zip(self.render(*arrays, view, **scenes.SMOOTH), ("color", "transmittance", "depth")):
            np.testing.assert_allclose(got.array, expected[name], atol=3e-4)
        random = np.random.default_rng(4)
        by_color, by_depth = random.normal(0, 1, (32, 40, 3)), random.normal(0, 1, (32, 40))
        for depth in (np.zeros((32, 40)), by_depth):
            expected = gart.reference(model, view, by_color, depth, **scenes.SMOOTH)["gradients"]
            by = tuple(Lent(g.astype(np.float32)) for g in (by_color, np.zeros((32, 40)), depth))
            images, kept = self.made[-1].forward(*arrays)
            self.assertEqual(len(images), 3)
            for got, name in zip(self.made[-1].backward(kept, by), ("mean", "log_scale", "quaternion", "opacity", "sh")):
                np.testing.assert_allclose(got.array, expected[name], rtol=2e-3, atol=2e-3 * np.abs(expected[name]).max())

    def test_a_renderer_is_lent_jaxs_memory(self):
        arrays = scenes.parameters()
        renderer = gart.Renderer(sh_degree=1, backend="openmp")
        renderer.bind(*map(Lent, arrays))
        before = renderer.render(scenes.camera())["color"]
        arrays[4][:] = 0.5
        self.assertGreater(np.abs(renderer.render(scenes.camera())["color"] - before).max(), 0.05)


@unittest.skipIf(importlib.util.find_spec("jax") is None, "no jax")
class RealJax(unittest.TestCase):
    def setUp(self):
        os.environ.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")
        sys.modules.pop("gart.jax", None)
        import gart.jax
        import jax
        self.jax, self.render = jax, gart.jax.render

    def test_images_and_gradients_are_the_reference(self):
        """By hand and under jit, of colour alone and with depth."""
        model, view, numbers = scenes.model(n=30, degree=1), scenes.camera(), scenes.parameters(n=30, degree=1)
        arrays = [self.jax.numpy.asarray(a) for a in numbers]
        random = np.random.default_rng(4)
        by_color, by_depth = random.normal(0, 1, (32, 40, 3)), random.normal(0, 1, (32, 40))
        expected = gart.reference(model, view, **scenes.SMOOTH)

        def see(*arrays):
            return self.render(*arrays, view, **scenes.SMOOTH)

        for images in (see(*arrays), self.jax.jit(see)(*arrays)):
            for got, name in zip(images, ("color", "transmittance", "depth")):
                np.testing.assert_allclose(got, expected[name], atol=3e-4)
        for share in (0.0, 1.0):
            def loss(*arrays):
                color, _, depth = see(*arrays)
                return (np.float32(by_color) * color).sum() + share * (np.float32(by_depth) * depth).sum()

            expected = gart.reference(model, view, by_color, share * by_depth, **scenes.SMOOTH)["gradients"]
            gradient = self.jax.grad(loss, argnums=tuple(range(5)))
            for got in (gradient(*arrays), self.jax.jit(gradient)(*arrays)):
                for array, name in zip(got, ("mean", "log_scale", "quaternion", "opacity", "sh")):
                    most = np.abs(expected[name]).max()
                    np.testing.assert_allclose(array, expected[name], rtol=2e-3, atol=2e-3 * most)

    def test_a_renderer_is_lent_jaxs_memory(self):
        """On JAX's device where gart was built for it, else on the host."""
        on_device = self.jax.default_backend() == "gpu" and gart.resolve()["backend"] == "cuda"
        device = self.jax.devices("gpu" if on_device else "cpu")[0]
        arrays = [self.jax.device_put(a, device) for a in scenes.parameters()]
        renderer = gart.Renderer(sh_degree=1, backend="cuda" if on_device else "openmp")
        renderer.bind(*arrays)
        expected = gart.Renderer(scenes.model(), backend=renderer.configuration["backend"]).render(scenes.camera())
        np.testing.assert_array_equal(renderer.render(scenes.camera())["color"], expected["color"])


if __name__ == "__main__":
    unittest.main()
