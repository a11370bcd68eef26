"""Images and gradients against their definition in double, cameras, files, errors, threads."""
import gc
import pathlib
import tempfile
import threading
import unittest

import gart
import numpy as np
import scenes

NAMES = ["mean", "log_scale", "quaternion", "opacity", "sh"]


class Renderer(unittest.TestCase):
    def test_image_is_the_reference(self):
        model, view = scenes.model(n=60, degree=3), scenes.camera()
        expected = gart.reference(model, view, background=(0.1, 0.2, 0.3))
        for backend in ("serial", "openmp"):
            got = gart.Renderer(model, backend=backend).render(view, background=(0.1, 0.2, 0.3))
            self.assertEqual(got["color"].dtype, np.float32)
            for name in ("color", "transmittance", "depth"):
                np.testing.assert_allclose(got[name], expected[name], atol=2e-4)
            self.assertEqual(got["hits"].dtype, np.uint32)
            self.assertLess((got["hits"] != expected["hits"]).mean(), 0.01)

    def test_gradients_are_the_reference(self):
        model, view = scenes.model(n=60, degree=2), scenes.camera()
        gradient = np.random.default_rng(3).normal(0, 1, (32, 40, 3))
        expected = gart.reference(model, view, gradient, **scenes.SMOOTH)["gradients"]
        got = gart.Renderer(model, backend="serial").backward(view, gradient.astype(np.float32), **scenes.SMOOTH)
        for name in NAMES:
            self.assertEqual(got[name].shape, getattr(model, name).shape)
            np.testing.assert_allclose(got[name], expected[name], rtol=2e-3, atol=2e-3 * np.abs(expected[name]).max())

    def test_contexts_give_the_same_gradients(self):
        arrays, view = scenes.parameters(degree=1), scenes.camera()
        renderer = gart.Renderer(sh_degree=1, backend="serial")
        renderer.bind(*arrays)
        gradient = np.random.default_rng(3).normal(0, 1, (32, 40, 3)).astype(np.float32)
        expected = renderer.backward(view, gradient, pose=True)
        color = np.empty((32, 40, 3), np.float32)
        out = dict(zip(NAMES, [np.full_like(a, np.nan) for a in arrays]))
        pose = np.empty(6, np.float32)
        context = renderer.forward(view, color=color)
        other = renderer.forward(scenes.camera(16, 12))  # another view in between
        np.testing.assert_array_equal(color, renderer.render(view)["color"])
        context.backward(gradient, **out, pose=pose)
        for name in NAMES:
            np.testing.assert_array_equal(out[name], expected[name])
        np.testing.assert_allclose(pose[:3], expected["pose"]["translation"], rtol=1e-5)
        np.testing.assert_allclose(pose[3:], expected["pose"]["rotation"], rtol=1e-5)
        del other
        context.backward(gradient, **out)  # again
        np.testing.assert_array_equal(out["sh"], expected["sh"])
        with self.assertRaisesRegex(gart.InvalidArgument, "Context.backward: color_gradient must be .*32, 40, 3"):
            context.backward(gradient[:-1], **out)
        renderer.bind(*scenes.parameters(degree=1, seed=2))
        with self.assertRaisesRegex(gart.InvalidArgument, "another model was set or bound"):
            context.backward(gradient, **out)

    def test_depth_and_transmittance_have_gradients(self):
        model, view = scenes.model(n=30, degree=0), scenes.camera()
        random = np.random.default_rng(4)
        by_color, by_depth = random.normal(0, 1, (32, 40, 3)), random.normal(0, 1, (32, 40))
        expected = gart.reference(model, view, by_color, by_depth, **scenes.SMOOTH)["gradients"]
        renderer = gart.Renderer(model, depth=True, backend="openmp")
        out = {name: np.empty_like(getattr(model, name)) for name in NAMES}
        context = renderer.forward(view, **scenes.SMOOTH)
        context.backward(by_color.astype(np.float32), depth_gradient=by_depth.astype(np.float32), **out)
        for name, array in out.items():
            np.testing.assert_allclose(array, expected[name], rtol=2e-3, atol=2e-3 * np.abs(expected[name]).max())
        # Without depth=True they come by lists of hits.
        by_lists = {name: np.empty_like(array) for name, array in out.items()}
        plain = gart.Renderer(model, backend="openmp").forward(view, **scenes.SMOOTH)
        plain.backward(by_color.astype(np.float32), depth_gradient=by_depth.astype(np.float32), **by_lists)
        for name, array in out.items():
            np.testing.assert_allclose(by_lists[name], array, rtol=1e-4, atol=1e-4 * np.abs(array).max())

    def rays_of(self, view):
        """The directions of a view's pixels, and where they begin."""
        y, x = np.mgrid[:view.height, :view.width] + 0.5
        of_pixels = np.stack([(x - view.cx) / view.fx, (y - view.cy) / view.fy, np.ones_like(x)], -1)
        directions = of_pixels.reshape(-1, 3) @ view.c2w[:3, :3].T
        return np.ascontiguousarray(directions, np.float32), tuple(view.c2w[:3, 3])

    def test_rays_of_a_view_see_the_view(self):
        view, renderer = scenes.camera(), gart.Renderer(scenes.model(), backend="openmp")
        directions, frame = self.rays_of(view)
        image, seen = renderer.render(view), renderer.trace(directions, frame=frame)
        np.testing.assert_allclose(seen["color"].reshape(32, 40, 3), image["color"], atol=1e-4)
        np.testing.assert_allclose(seen["depth"].reshape(32, 40), image["depth"], atol=1e-3)
        hits = renderer.list_hits(directions, frame=frame)
        np.testing.assert_array_equal(np.diff(hits["offsets"]), seen["hits"])
        some = int(np.argmax(seen["hits"]))
        of_ray = slice(int(hits["offsets"][some]), int(hits["offsets"][some + 1]))
        self.assertEqual(hits["ids"][of_ray][0], seen["first_id"][some])
        self.assertAlmostEqual(float((hits["weight"] * hits["t"])[of_ray].sum()), float(seen["depth"][some]), 3)
        with self.assertRaisesRegex(gart.InvalidArgument, "Renderer.trace: origins must"):
            renderer.trace(directions, origins=directions[:-1])

    def test_cameras(self):
        view = gart.Camera(64, 48, 50, 51)
        self.assertEqual((view.cx, view.cy, view.model), (32, 24, "PINHOLE"))
        np.testing.assert_array_equal(view.c2w, np.eye(4))
        view.c2w = scenes.C2W[:3]
        np.testing.assert_allclose(view.c2w, scenes.C2W, atol=1e-7)
        again = gart.Camera.from_json(view.json())
        np.testing.assert_array_equal(again.c2w, view.c2w)
        wide = gart.Camera(64, 48, 20, 20, model="OPENCV_FISHEYE", k1=0.1, k2=0.0, k3=0.0, k4=0.0, c2w=scenes.C2W)
        self.assertEqual(wide.model, "OPENCV_FISHEYE")
        self.assertAlmostEqual(wide.parameters["k1"], 0.1, 6)
        image = gart.Renderer(scenes.model(), backend="openmp").render(wide)["color"]
        np.testing.assert_allclose(image, gart.reference(scenes.model(), wide)["color"], atol=2e-4)
        with self.assertRaises(gart.Error):
            gart.Camera(64, 48, 20, 20, model="NO_SUCH")
        with self.assertRaisesRegex(gart.InvalidArgument, "fx and fy must be positive"):
            gart.Camera(64, 48, -1, 20)
        with self.assertRaisesRegex(gart.InvalidArgument, "c2w must be a matrix"):
            gart.Camera(64, 48, 20, 20, c2w=[1, 2, 3])

    def test_models_go_to_files_and_back(self):
        model = scenes.model(degree=3)
        model.render = gart.RenderOptions(antialias=0.25, alpha_min=0.01)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "model.ply"
            gart.save_model(path, model)
            again = gart.load_model(str(path))
            for name in NAMES:
                np.testing.assert_array_equal(getattr(again, name), getattr(model, name))
            self.assertAlmostEqual(again.render.antialias, 0.25)
            with self.assertRaises(gart.IoError) as caught:
                gart.load_model(path.with_name("absent.ply"))
        self.assertIsInstance(caught.exception, OSError)
        self.assertTrue(caught.exception.file.endswith("absent.ply"))
        self.assertTrue(caught.exception.remedy)

    def test_errors_name_field_and_remedy(self):
        renderer = gart.Renderer(scenes.model(), backend="serial")
        with self.assertRaises(gart.InvalidArgument) as caught:
            renderer.render(scenes.camera(), near=-1.0)
        self.assertIsInstance(caught.exception, ValueError)
        self.assertEqual(caught.exception.field, "render_options.near")
        with self.assertRaisesRegex(gart.InvalidArgument, "'abacus' is none of auto, serial"):
            gart.Renderer(backend="abacus")
        with self.assertRaisesRegex(gart.Unsupported, "no compiled configuration"):
            gart.Renderer(backend="serial", backward="abacus")
        with self.assertRaisesRegex(TypeError, "no option 'nearr': there are .*near"):
            renderer.render(scenes.camera(), nearr=1.0)
        with self.assertRaisesRegex(TypeError, "no argument 'bakend'"):
            gart.Renderer(bakend="serial")

    def test_threads_share_a_renderer_and_the_lock_is_dropped(self):
        renderer = gart.Renderer(scenes.model(n=400), backend="serial")
        view, small = scenes.camera(400, 320), scenes.camera()
        expected = [renderer.render(view)["color"], renderer.render(small)["color"]]
        failures, ticks, done = [], [], threading.Event()

        def work(which):
            for _ in range(4):
                got = renderer.render([view, small][which])["color"]
                if not np.array_equal(got, expected[which]):
                    failures.append(which)

        def tick():
            while not done.is_set():
                ticks.append(1)
                done.wait(1e-4)

        threads = [threading.Thread(target=work, args=(k % 2,)) for k in range(4)]
        ticking = threading.Thread(target=tick)
        ticking.start()
        for t in threads:
            t.start()
        for t in threads:
            t.join()
        done.set()
        ticking.join()
        self.assertEqual(failures, [])
        self.assertGreater(len(ticks), 10)

    def test_features_are_shown_kept_and_learned(self):
        arrays, view = scenes.parameters(n=60), scenes.camera()
        features = np.ascontiguousarray(np.random.default_rng(2).normal(size=(60, 5)), np.float32)
        model = gart.Model(*arrays, features=features)
        np.testing.assert_array_equal(model.features, features)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "model.ply"
            gart.save_model(path, model)
            np.testing.assert_array_equal(gart.load_model(path).features, features)
        renderer = gart.Renderer(model, backend="openmp")
        image = renderer.render(view, features=True)
        self.assertEqual(image["features"].shape, (32, 40, 5))
        self.assertNotIn("features", renderer.render(view))
        directions = np.array([[0, 0, 1], [0.28, 0, 0.96]], np.float32)
        frame = (0.3, -0.2, -4.0)
        hits = renderer.list_hits(directions, frame=frame)
        expected = np.zeros((2, 5), np.float32)
        for r in range(2):
            a, b = hits["offsets"][r:r + 2]
            expected[r] = hits["weight"][a:b] @ features[hits["ids"][a:b]]
        np.testing.assert_allclose(renderer.trace(directions, frame=frame, features=True)["features"], expected,
                                   atol=1e-5)

        # Toward another image, by features alone.
        learned = np.zeros((60, 5), np.float32)
        renderer.bind_features(learned)
        shown, gradient, losses = np.empty((32, 40, 5), np.float32), np.empty((60, 5), np.float32), []
        for _ in range(20):
            context = renderer.forward(view, features=shown)
            off = np.ascontiguousarray(shown - image["features"])
            losses.append((off ** 2).sum())
            context.backward(features_gradient=off, features=gradient, detached=True)
            learned -= 0.02 * gradient
        self.assertLess(losses[-1], 0.3 * losses[0])
        with self.assertRaisesRegex(gart.InvalidArgument, "Renderer.bind_features: features"):
            renderer.bind_features(learned[:50])
        renderer.bind_features(None)
        self.assertNotIn("features", renderer.render(view, features=True))

    def test_contexts_keep_their_features(self):
        """Also where others were bound since, and nobody else holds those that were shown."""
        view, renderer = scenes.camera(), gart.Renderer(sh_degree=1, backend="serial")
        renderer.bind(*scenes.parameters())
        gradient = np.random.default_rng(3).normal(size=(32, 40, 75)).astype(np.float32)
        got = []
        for others in (False, True):
            renderer.bind_features(np.random.default_rng(4).normal(size=(40, 75)).astype(np.float32))
            context = renderer.forward(view, features=np.empty((32, 40, 75), np.float32))
            if others:
                renderer.bind_features(np.zeros((40, 2), np.float32))
                gc.collect()
                kept = [np.full((40, 75), np.nan, np.float32) for _ in range(8)]  # where those were
            out = {name: np.empty_like(a) for name, a in zip(NAMES, scenes.parameters())}
            context.backward(features_gradient=gradient, **out)
            got.append(out)
        for name in NAMES:
            np.testing.assert_array_equal(got[0][name], got[1][name])

    def test_tracking_finds_the_camera(self):
        model, truth = scenes.model(n=60), scenes.camera(80, 64)
        renderer = gart.Renderer(model, backend="openmp")
        photo = renderer.render(truth)["color"]
        guess = gart.Camera.from_json(truth.json())
        moved = guess.c2w
        moved[:3, 3] += 0.05
        guess.c2w = moved
        found, residuals = gart.track(renderer, photo, guess)
        self.assertLess(np.abs(found.c2w - truth.c2w).max(), 5e-3)
        self.assertLess(residuals[-1], residuals[0])


if __name__ == "__main__":
    unittest.main()
