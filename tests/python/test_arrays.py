"""Memory that is lent, not copied, and what is refused."""
import gc
import time
import timeit
import unittest

import gart
import numpy as np
import scenes


def address(array):
    return array.__array_interface__["data"][0]


class Arrays(unittest.TestCase):
    def test_model_shows_its_own_memory(self):
        model = scenes.model(n=7, degree=2)
        self.assertEqual([model.mean.shape, model.log_scale.shape, model.quaternion.shape, model.opacity.shape,
                          model.sh.shape], [(7, 3), (7, 3), (7, 4), (7,), (7, 9, 3)])
        self.assertEqual(address(model.mean), address(model.mean))
        model.mean[3, 1] = 42
        self.assertEqual(model.mean[3, 1], 42)
        mean = model.mean
        del model
        gc.collect()
        self.assertEqual(mean[3, 1], 42)

    def test_what_is_bound_is_not_copied(self):
        arrays = scenes.parameters()
        renderer = gart.Renderer(sh_degree=1, backend="serial")
        renderer.bind(*arrays)
        before = renderer.render(scenes.camera())["color"]
        arrays[4][:] = 0.5  # written to the memory that was lent
        after = renderer.render(scenes.camera())["color"]
        self.assertGreater(np.abs(after - before).max(), 0.05)
        own = gart.Renderer(gart.Model(*arrays), backend="serial")
        np.testing.assert_array_equal(after, own.render(scenes.camera())["color"])

    def test_what_is_bound_is_kept(self):
        renderer = gart.Renderer(sh_degree=1, backend="serial")
        renderer.bind(*scenes.parameters())
        gc.collect()
        expected = gart.Renderer(scenes.model(), backend="serial").render(scenes.camera())["color"]
        np.testing.assert_array_equal(renderer.render(scenes.camera())["color"], expected)

    def test_images_go_where_they_are_asked_to(self):
        renderer = gart.Renderer(scenes.model(), backend="serial")
        view = scenes.camera()
        expected = renderer.render(view)
        color, depth = np.full((32, 40, 3), 7, np.float32), np.empty((32, 40), np.float32)
        hits, rgba = np.empty((32, 40), np.uint32), np.empty((32, 40, 4), np.uint8)
        renderer.render_to(view, color=color, depth=depth, hits=hits, rgba=rgba)
        np.testing.assert_array_equal(color, expected["color"])
        np.testing.assert_array_equal(depth, expected["depth"])
        np.testing.assert_array_equal(hits, expected["hits"])
        np.testing.assert_array_equal(rgba[..., :3], renderer.render_8bit(view))

    def test_refusals_name_the_argument(self):
        good = scenes.parameters()
        renderer = gart.Renderer(sh_degree=1, backend="serial")

        class Foreign:  # an array of DLPack that is not contiguous
            def __init__(self, array):
                self.array = array

            def __dlpack__(self, **_):
                return self.array.__dlpack__()

            def __dlpack_device__(self):
                return self.array.__dlpack_device__()

        wrong = {
            0: [good[0][:, :2], good[0].astype(np.float64), np.asfortranarray(good[0]), "text", Foreign(good[0].T)],
            3: [good[3][:-1], good[3][:, None]],
            4: [good[4][:, :2], good[4].reshape(40, 12)],
        }
        names = ["mean", "log_scale", "quaternion", "opacity", "sh"]
        for k, arrays in wrong.items():
            for array in arrays:
                given = list(good)
                given[k] = array
                with self.assertRaisesRegex(gart.InvalidArgument, f"Renderer.bind: {names[k]} must"):
                    renderer.bind(*given)
        with self.assertRaisesRegex(gart.InvalidArgument, "another SH degree"):
            renderer.bind(*scenes.parameters(degree=2))
        image = np.empty((32, 40, 3), np.float32)
        image.flags.writeable = False
        renderer.bind(*good)
        with self.assertRaisesRegex(gart.InvalidArgument, "color must be .*writable; it is .*read only"):
            renderer.render_to(scenes.camera(), color=image)

    def test_dlpack_is_taken(self):
        class Foreign:
            def __init__(self, array):
                self.array = array

            def __buffer__(self, flags):  # from Python 3.12 on: arrays of a device have it, and refuse
                raise BufferError("on a device")

            def __dlpack__(self, **_):
                return self.array.__dlpack__()

            def __dlpack_device__(self):
                return self.array.__dlpack_device__()

        arrays = scenes.parameters()
        renderer = gart.Renderer(sh_degree=1, backend="serial")
        renderer.bind(*[Foreign(a) for a in arrays])
        expected = gart.Renderer(gart.Model(*arrays), backend="serial").render(scenes.camera())["color"]
        np.testing.assert_array_equal(renderer.render(scenes.camera())["color"], expected)
        color = np.empty((32, 40, 3), np.float32)
        renderer.render_to(scenes.camera(), color=Foreign(color))
        np.testing.assert_array_equal(color, expected)

    def test_memory_is_flat_over_many_calls(self):
        import resource
        arrays = scenes.parameters(n=100)
        renderer = gart.Renderer(sh_degree=1, backend="openmp", threads=1)
        view = scenes.camera(8, 8)
        color = np.empty((8, 8, 3), np.float32)
        gradient = np.ones_like(color)
        names = ("mean", "log_scale", "quaternion", "opacity", "sh")
        out = {name: np.empty_like(a) for name, a in zip(names, arrays)}

        def calls(n):
            for _ in range(n):
                renderer.bind(*arrays)
                renderer.forward(view, color=color).backward(gradient, **out)
                renderer.render(view)
            gc.collect()
            return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

        before = calls(100)
        self.assertLess(calls(10_000) - before, 4096)  # KiB

    def test_calls_cost_little(self):
        """In the time of the processor, which other programs leave alone: about 8 us here, and a fifth of it to bind."""
        arrays = scenes.parameters(n=1)
        renderer = gart.Renderer(sh_degree=1, backend="openmp", threads=1)
        view, color = scenes.camera(1, 1), np.empty((1, 1, 3), np.float32)
        for call in (lambda: renderer.bind(*arrays), lambda: renderer.render_to(view, color=color)):
            least = min(timeit.repeat(call, number=200, repeat=5, timer=time.process_time)) / 200
            self.assertLess(least, 50e-6)


if __name__ == "__main__":
    unittest.main()
