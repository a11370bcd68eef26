"""Captures from arrays and from files, sessions, checkpoints."""
import pathlib
import tempfile
import unittest

import gart
import numpy as np
import scenes


def looking(position, target=(0.0, 0.0, 0.0)):
    """camera to world, z towards the target, y down."""
    z = np.subtract(target, position)
    z = z / np.linalg.norm(z)
    x = np.cross([0.0, 1.0, 0.0], z)
    x = x / np.linalg.norm(x)
    out = np.eye(4)
    out[:3, 0], out[:3, 1], out[:3, 2], out[:3, 3] = x, np.cross(z, x), z, position
    return out


def capture(views=12, size=48):
    """Photographs of a small model from around."""
    model = scenes.model(n=60, degree=0)
    renderer = gart.Renderer(model, backend="openmp")
    out = []
    for k in range(views):
        angle = 2 * np.pi * k / views
        view = gart.Camera(size, size, 50, 50, c2w=looking((4 * np.sin(angle), 0.3, -4 * np.cos(angle))))
        out.append(gart.View(f"view_{k}", view, renderer.render_8bit(view)))
    return gart.Dataset(train=out[1:], test=out[:1], points=model.mean)


OPTIONS = {"iterations": 60, "sh_every": 20, "densify": "none", "check_finite": True,
           "resolution.quarter_until": 0, "resolution.half_until": 0}


class Training(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.data = capture()

    def test_matched_photographs_are_for_sessions_to_start_from(self):
        # Few views of few pixels: what is found depends on them, and is the same again.
        data = capture(views=16, size=96)
        found = data.match_photographs(4000)
        self.assertEqual(found, data.match_photographs(pixels=4000, seed=1))
        self.assertGreater(found, 10)
        options = gart.TrainOptions(**OPTIONS)
        self.assertFalse(options.match)
        options.match = True
        self.assertEqual(len(gart.Session(data, options, backend="openmp", sh_degree=0)), 60 + found)

    def test_a_session_learns_views_of_arrays(self):
        options = gart.TrainOptions(**OPTIONS)
        session = gart.Session(self.data, options, backend="openmp", sh_degree=0)
        before = session.evaluate()["psnr"]
        report = session.step()
        self.assertEqual((report.step, session.steps_done, len(session)), (1, 1, 60))
        report = session.step(59)
        self.assertEqual(report.step, 60)
        scores = session.evaluate()
        self.assertGreater(scores["psnr"], before + 2)
        self.assertEqual([v["name"] for v in scores["views"]], ["view_0"])
        model = session.model()
        self.assertEqual((len(model), model.sh_degree), (60, 0))
        view = self.data.test[0].camera
        image = session.render(view)["color"]
        np.testing.assert_allclose(gart.Renderer(model, backend="openmp").render(view)["color"], image, atol=1e-5)
        again = gart.evaluate(gart.Renderer(model, backend="openmp"), self.data.test)
        self.assertAlmostEqual(again["psnr"], scores["psnr"], 3)

    def test_a_run_goes_on_from_its_checkpoint(self):
        options = gart.TrainOptions(**{**OPTIONS, "iterations": 20})
        seen = []
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "run.checkpoint"
            whole = gart.train(self.data, options, backend="serial", sh_degree=0,
                               progress=lambda r: seen.append(r.step), progress_every=8)
            gart.train(self.data, options, backend="serial", sh_degree=0, checkpoint=path, checkpoint_every=8,
                       progress=lambda r: r.step < 16, progress_every=16)
            resumed = gart.train(self.data, options, backend="serial", sh_degree=0, resume=path)
            whole.save_model(pathlib.Path(folder) / "model.ply")
            read = gart.load_model(pathlib.Path(folder) / "model.ply")
        self.assertEqual(seen, [8, 16, 20])
        self.assertEqual(resumed.steps_done, 20)
        np.testing.assert_array_equal(resumed.model().mean, whole.model().mean)
        np.testing.assert_array_equal(read.mean, whole.model().mean)

    def test_a_model_to_start_from(self):
        start = scenes.model(n=20, degree=1)
        session = gart.Session(self.data, gart.TrainOptions(**OPTIONS), start, backend="serial")
        np.testing.assert_array_equal(session.model().sh, start.sh)

    def test_options_by_name(self):
        options = gart.TrainOptions(densify="mcmc", **{"rates.mean": 0.5, "poses.rate": 0.25})
        self.assertEqual((options.densify, options.rates.mean, options.poses.rate), ("mcmc", 0.5, 0.25))
        options.rates.opacity = 0.125
        options.iterations = 77
        self.assertEqual((options.rates.opacity, options.iterations), (0.125, 77))
        self.assertIn("rates.mean", gart.TrainOptions.fields())
        with self.assertRaisesRegex(TypeError, "no option 'rates.meen': there are .*rates.mean"):
            gart.TrainOptions(**{"rates.meen": 1})
        with self.assertRaisesRegex(AttributeError, "no option 'rates.meen': there are .*mean"):
            options.rates.meen = 1
        with self.assertRaises(AttributeError):
            options.iteration = 1
        with self.assertRaisesRegex(gart.InvalidArgument, "train_options.iterations is -1: from 1 to"):
            options.iterations = -1
        with self.assertRaisesRegex(gart.InvalidArgument, "is none of error, mcmc"):
            gart.TrainOptions(densify="more")

    def test_views_lend_their_images(self):
        view = self.data.train[3]
        self.assertEqual(view.image.shape, (48, 48, 3))
        self.assertEqual(view.image.__array_interface__["data"], self.data.train[3].image.__array_interface__["data"])
        self.assertIsNone(view.mask)
        with self.assertRaisesRegex(gart.InvalidArgument, "image must be of the camera's size"):
            gart.View("wrong", view.camera, view.image[:-1])
        with self.assertRaises(gart.IoError):
            gart.load_dataset("/no/such/capture")


if __name__ == "__main__":
    unittest.main()
