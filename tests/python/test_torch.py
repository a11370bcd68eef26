"""gart.torch against finite differences and against the renderer; skipped without torch."""
import importlib.util
import os
import pathlib
import subprocess
import sys
import unittest
from typing import List

import gart
import numpy as np
import scenes

if importlib.util.find_spec("torch") is None:
    raise unittest.SkipTest("no torch (python3-torch)")
import gart.torch
import torch
from gart.torch import _rasterization



def tensors(**kinds):
    return [torch.from_numpy(a).requires_grad_() for a in scenes.parameters(**kinds)]


def finite_differences(loss, values, step):
    """d loss / d values, a float64 tensor, by central differences."""
    out = torch.empty(values.shape, dtype=torch.float64)
    flat, to = values.detach().clone().reshape(-1), out.reshape(-1)
    for k in range(flat.numel()):
        at = flat[k].item()
        both = []
        for sign in (1, -1):
            flat[k] = at + sign * step
            both.append((flat[k].double().item(), loss(flat.reshape(values.shape))))
        flat[k] = at
        to[k] = (both[0][1] - both[1][1]) / (both[0][0] - both[1][0])
    return out


class OperatorsByHand:
    """torch.library.custom_op as it is documented: of annotated arguments to new tensors, which the fake describes."""

    def __init__(self, function):
        self.function = function
        for name, kind in function.__annotations__.items():
            parts = kind.__args__ if name == "return" else (kind,)
            assert all(part in (torch.Tensor, int, bool, float, str, List[float]) for part in parts), (name, kind)

    @classmethod
    def custom_op(cls, name, *, mutates_args):
        assert name.startswith("gart::") and mutates_args == ()
        return cls

    def register_fake(self, fake):
        self.fake = fake

    def register_autograd(self, backward, *, setup_context):
        class Function(torch.autograd.Function):
            @staticmethod
            def forward(ctx, *inputs):
                output = self.of(inputs)
                setup_context(ctx=ctx, inputs=inputs, output=output)
                return output
        Function.backward = staticmethod(backward)
        self.of_autograd = Function.apply

    of_autograd = None

    def of(self, inputs):
        with torch.no_grad():
            output, fake = self.function(*inputs), self.fake(*inputs)
        seen = {t.storage().data_ptr() for t in inputs if isinstance(t, torch.Tensor) and t.numel()}
        for t, expected in zip(output, fake):
            assert (t.shape, t.stride(), t.dtype) == (expected.shape, expected.stride(), expected.dtype)
            assert t.storage().data_ptr() not in seen
            seen |= {t.storage().data_ptr()} if t.numel() else set()
        assert len(output) == len(fake)
        return output

    def __call__(self, *inputs):
        return self.of_autograd(*inputs) if self.of_autograd else self.of(inputs)


class Torch(unittest.TestCase):
    def assert_close(self, got, expected, share=0.02):
        error = (got.double() - expected).abs().max().item()
        self.assertLess(error, share * expected.abs().max().item())

    def test_images_are_the_renderers(self):
        arrays, view = tensors(), scenes.camera()
        expected = gart.Renderer(scenes.model(), backend="openmp").render(view, background=(1, 0.5, 0))
        color, transmittance, depth = gart.torch.render(*arrays, view, background=(1, 0.5, 0))
        self.assertTrue(color.requires_grad)
        np.testing.assert_array_equal(color.detach().numpy(), expected["color"])
        np.testing.assert_array_equal(transmittance.detach().numpy(), expected["transmittance"])
        np.testing.assert_array_equal(depth.detach().numpy(), expected["depth"])

    def test_gradients_are_finite_differences(self):
        """Of colour, transmittance and depth at once, by every input. The differences are of the definition in double."""
        arrays, view = tensors(n=4, degree=1), scenes.camera(24, 20)
        with torch.no_grad():  # behind each other: where two change places, gradients know nothing of the step
            arrays[0][:, 2] = torch.tensor([2.0, -1.5, 0.5, 4.0])
            arrays[1] -= 0.3
        random = np.random.default_rng(5)
        weights = [random.normal(0, 1, s) for s in ((20, 24, 3), (20, 24), (20, 24))]

        def loss(images):
            return sum((torch.from_numpy(w) * image.double()).sum() for w, image in zip(weights, images))

        def by_definition(values, at, placed=view):
            numbers = [a.detach() for a in arrays]
            if at is not None:
                numbers[at] = values
            got = gart.reference(gart.Model(*numbers), placed, **scenes.SMOOTH)
            return sum((w * got[name]).sum() for w, name in zip(weights, ("color", "transmittance", "depth")))

        c2w = torch.from_numpy(scenes.C2W).requires_grad_()
        loss(gart.torch.render(*arrays, view, c2w=c2w, **scenes.SMOOTH)).backward()
        for k, array in enumerate(arrays):
            self.assert_close(array.grad, finite_differences(lambda v: by_definition(v, k), array, 2e-3))

        def moved(numbers):
            w = numbers[3:]
            cross = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
            placed, pose = gart.Camera.from_json(view.json()), scenes.C2W.copy()
            pose[:3, :3] = (np.eye(3) + cross + cross @ cross / 2) @ pose[:3, :3]
            pose[:3, 3] += numbers[:3]
            placed.c2w = pose
            return placed

        six = finite_differences(lambda v: by_definition(None, None, moved(v.numpy())),
                                 torch.zeros(6, dtype=torch.float64), 1e-3)
        self.assert_close(c2w.grad[:3, 3], six[:3])
        rows = c2w.grad[:3, :3] @ c2w.detach()[:3, :3].T  # dL/dw from the matrix's gradient
        turned = torch.stack([rows[2, 1] - rows[1, 2], rows[0, 2] - rows[2, 0], rows[1, 0] - rows[0, 1]])
        self.assert_close(turned, six[3:])

    def test_views_in_between_change_no_gradient(self):
        view, other = scenes.camera(), scenes.camera(24, 20)
        weight = torch.from_numpy(np.random.default_rng(5).normal(0, 1, (32, 40, 3)).astype(np.float32))
        alone, between = tensors(), tensors()
        (weight * gart.torch.render(*alone, view)[0]).sum().backward()
        image = gart.torch.render(*between, view)[0]
        gart.torch.render(*tensors(seed=9), other)[0].sum().backward()
        (weight * image).sum().backward()
        for a, b in zip(alone, between):
            np.testing.assert_allclose(a.grad, b.grad, rtol=1e-4, atol=1e-5 * float(a.grad.abs().max()))

    def test_gradients_of_rays_are_finite_differences(self):
        """Of a batch that no image has, by its directions and origins."""
        arrays = tensors(n=4, degree=1)
        with torch.no_grad():
            arrays[0][:, 2] = torch.tensor([2.0, -1.5, 0.5, 4.0])
            arrays[1] += 0.5  # wide, so that numbers of a float tell the differences
        random = np.random.default_rng(6)
        origins = torch.tensor(random.normal(0, 0.3, (12, 3)) - [0, 0, 5], dtype=torch.float32)
        directions = torch.tensor(random.normal(0, 0.1, (12, 3)) + [0, 0, 1.3], dtype=torch.float32)
        weight = torch.from_numpy(random.normal(0, 1, (12, 3)))

        def loss(directions, origins):
            return (weight * gart.torch.trace(*arrays, directions, origins, **scenes.SMOOTH)[0].double()).sum()

        rays = [directions.requires_grad_(), origins.requires_grad_()]
        loss(*rays).backward()
        self.assertGreater(arrays[0].grad.abs().max(), 0)
        for k in range(2):
            def moved(values):
                with torch.no_grad():
                    return loss(*[values if j == k else r.detach() for j, r in enumerate(rays)]).item()
            self.assert_close(rays[k].grad, finite_differences(moved, rays[k], 5e-3), 0.05)

    def test_gradients_of_features_are_finite_differences(self):
        """Of features of any sign beside colour, transmittance and depth, by every input. By definition features are
        colours of degree 0 that were shifted to be positive."""
        arrays, view, wide = tensors(n=4, degree=0), scenes.camera(24, 20), 5
        with torch.no_grad():
            arrays[0][:, 2] = torch.tensor([2.0, -1.5, 0.5, 4.0])
            arrays[1] -= 0.3
        random = np.random.default_rng(8)
        arrays.append(torch.from_numpy(random.uniform(-1, 1, (4, wide)).astype(np.float32)).requires_grad_())
        weights = [random.normal(0, 1, s) for s in ((20, 24, 3), (20, 24), (20, 24), (20, 24, wide))]

        def loss(images):
            return sum((torch.from_numpy(w) * image.double()).sum() for w, image in zip(weights, images))

        def by_definition(values=None, at=None):
            *numbers, features = [values if k == at else a.detach() for k, a in enumerate(arrays)]
            got = gart.reference(gart.Model(*numbers), view, **scenes.SMOOTH)
            out = sum((w * got[name]).sum() for w, name in zip(weights, ("color", "transmittance", "depth")))
            for first in (0, wide - 3):
                shifted = (features[:, first:first + 3] + 2 - 0.5) / 0.28209479177387814
                numbers[4] = shifted.unsqueeze(1).contiguous()
                seen = gart.reference(gart.Model(*numbers), view, **{**scenes.SMOOTH, "background": (0, 0, 0)})
                image = seen["color"] - 2 * (1 - seen["transmittance"][..., None])
                part = weights[3][..., first:first + 3] * ([1, 1, 1] if first == 0 else [0, 1, 1])
                out += (part * image).sum()
            return out

        images = gart.torch.render(*arrays[:5], view, features=arrays[5], **scenes.SMOOTH)
        self.assertEqual(images[3].shape, (20, 24, wide))
        self.assertAlmostEqual(loss(images).item(), float(by_definition()), delta=2e-3)
        loss(images).backward()
        for k, array in enumerate(arrays):
            self.assert_close(array.grad, finite_differences(lambda v: by_definition(v, k), array, 2e-3))

        # The same rays as a batch, and features alone.
        whole = [a.grad.double() for a in arrays]
        for a in arrays:
            a.grad = None
        rays = _rasterization._rays(self.matrix_and_pose(view)[0], torch.from_numpy(scenes.C2W), 24, 20)
        seen = gart.torch.trace(*arrays[:5], *rays, features=arrays[5], **scenes.SMOOTH)
        loss([s.reshape(20, 24, *s.shape[1:]) for s in seen]).backward()
        for array, expected in zip(arrays, whole):
            self.assert_close(array.grad, expected, 2e-3)
        alone = arrays[5].detach().clone().requires_grad_()
        loss(gart.torch.render(*[a.detach() for a in arrays[:5]], view, features=alone, **scenes.SMOOTH)).backward()
        self.assert_close(alone.grad, whole[5], 1e-4)

    def test_what_needs_no_gradient_changes_none(self):
        """Each input alone gets what it gets beside all others."""
        view = scenes.camera(24, 20)
        directions, origins = _rasterization._rays(self.matrix_and_pose(view)[0], torch.from_numpy(scenes.C2W), 24, 20)
        features = torch.randn(40, 4, generator=torch.Generator().manual_seed(1))
        given = [*[t.detach() for t in tensors()], features, torch.from_numpy(scenes.C2W), directions, origins]

        def gradients(learned):
            (*arrays, f, c2w, d, o) = [t.clone().requires_grad_(k in learned) for k, t in enumerate(given)]
            seen = (*gart.torch.render(*arrays, view, features=f, c2w=c2w), *gart.torch.trace(*arrays, d, o, features=f))
            sum(image.square().sum() for image in seen if image.requires_grad).backward()
            return [t.grad for t in (*arrays, f, c2w, d, o)]

        expected = gradients(set(range(9)))
        for k in range(9):
            got = gradients({k})
            self.assertEqual([g is None for g in got], [j != k for j in range(9)])
            self.assert_close(got[k], expected[k].double(), 1e-3)

    def test_rays_have_gradients_by_features(self):
        arrays = tensors(n=4, degree=0)
        with torch.no_grad():
            arrays[0][:, 2] = torch.tensor([2.0, -1.5, 0.5, 4.0])
            arrays[1] += 0.5
        random = np.random.default_rng(6)
        origins = torch.tensor(random.normal(0, 0.3, (12, 3)) - [0, 0, 5], dtype=torch.float32)
        directions = torch.tensor(random.normal(0, 0.1, (12, 3)) + [0, 0, 1.3], dtype=torch.float32)
        weight = torch.from_numpy(random.normal(0, 1, (12, 7)))
        features = torch.from_numpy(random.normal(0, 1, (4, 7)).astype(np.float32))

        def loss(directions, origins):
            seen = gart.torch.trace(*arrays, directions, origins, features=features, **scenes.SMOOTH)
            return (weight * seen[3].double()).sum()

        rays = [directions.requires_grad_(), origins.requires_grad_()]
        loss(*rays).backward()
        for k in range(2):
            def moved(values):
                with torch.no_grad():
                    return loss(*[values if j == k else r.detach() for j, r in enumerate(rays)]).item()
            self.assert_close(rays[k].grad, finite_differences(moved, rays[k], 5e-3), 0.05)

    def test_placed_models_are_seen_as_from_elsewhere(self):
        """A model at a pose is, by definition, what a camera moved the other way sees; so are its gradients."""
        arrays, view, scale = tensors(n=12, degree=3), scenes.camera(), 1.7
        rotation = torch.tensor([0.9, -0.7, 0.4, 1.1], dtype=torch.float64).requires_grad_()
        position = torch.tensor([0.3, -1.2, 2.0], dtype=torch.float64).requires_grad_()

        def moved(rotation, position):
            """The camera in the model's axes, with lengths of the world."""
            turn = _rasterization._rotations(rotation[None])[0]
            w2c = torch.eye(4, dtype=torch.float64)
            w2c[:3, :3], w2c[:3, 3] = turn, position
            return torch.linalg.inv(w2c) @ pose
        with torch.no_grad():  # a camera that sees the model where it stands
            pose = torch.from_numpy(scenes.C2W).clone()
            turn = _rasterization._rotations(rotation[None])[0]
            pose[:3, :3], pose[:3, 3] = turn @ pose[:3, :3], turn @ (scale * pose[:3, 3]) + position
        placed = gart.torch.place(*arrays, rotation, position, scale)
        color, transmittance, depth = gart.torch.render(*placed, view, c2w=pose)
        model = [arrays[0] * scale, arrays[1] + np.log(scale), *arrays[2:]]
        expected = gart.torch.render(*model, view, c2w=moved(rotation.detach(), position.detach()))
        self.assertGreater(1 - transmittance.min(), 0.5)
        for got, image in zip((color, transmittance, depth), expected):
            torch.testing.assert_close(got, image, rtol=1e-3, atol=1e-3)

        weight = torch.from_numpy(np.random.default_rng(3).normal(0, 1, (32, 40, 3)).astype(np.float32))
        inputs = (*arrays, rotation, position)
        got = torch.autograd.grad((weight * color).sum(), inputs)
        c2w = moved(rotation, position)
        whole = torch.autograd.grad((weight * gart.torch.render(*model, view, c2w=c2w)[0]).sum(), inputs)
        for a, b in zip(got, whole):
            self.assert_close(a, b.double())
        with self.assertRaisesRegex(gart.InvalidArgument, r"rotation must be \[4\] and position \[3\]"):
            gart.torch.place(*arrays, torch.eye(3), position)

    def test_tensors_are_refused_by_name(self):
        arrays = tensors()
        with self.assertRaisesRegex(gart.InvalidArgument, "log_scale must be float32"):
            gart.torch.render(arrays[0], arrays[1].double(), *arrays[2:], scenes.camera())
        with self.assertRaisesRegex(gart.InvalidArgument, r"features must be \[N, F\] with the Gaussians' N, 40; they are"):
            gart.torch.render(*arrays, scenes.camera(), features=torch.zeros(41, 4))
        views, k = torch.eye(4).expand(2, 4, 4), torch.eye(3).expand(2, 3, 3)
        gaussians = arrays[0], arrays[2], arrays[1].exp(), torch.sigmoid(arrays[3])
        for shape in ((41, 4), (3, 40, 4), (40,)):
            with self.assertRaisesRegex(gart.InvalidArgument, r"colors must be \[N, D\] or \[C, N, D\]"):
                gart.torch.rasterization(*gaussians, torch.zeros(shape), views, k, 8, 8)
        with self.assertRaisesRegex(gart.InvalidArgument, "sh_degree 2 needs colors of 9 coefficients"):
            gart.torch.rasterization(*gaussians, arrays[4], views, k, 8, 8, sh_degree=2)

    def test_rasterization_is_render(self):
        mean, log_scale, quaternion, opacity, sh = tensors()
        view = scenes.camera()
        w2c = torch.from_numpy(np.linalg.inv(scenes.C2W)).float()[None].requires_grad_()
        k = torch.tensor([[[view.fx, 0, view.cx], [0, view.fy, view.cy], [0, 0, 1]]])
        colors, alphas, meta = gart.torch.rasterization(mean, quaternion, log_scale.exp(), torch.sigmoid(opacity), sh,
                                                        w2c, k, 40, 32, sh_degree=1, render_mode="RGB+ED")
        self.assertEqual((colors.shape, alphas.shape), ((1, 32, 40, 4), (1, 32, 40, 1)))
        self.assertEqual(meta["width"], 40)
        expected = gart.reference(scenes.model(), view)
        np.testing.assert_allclose(colors[0, ..., :3].detach(), expected["color"], atol=5e-4)
        np.testing.assert_allclose(alphas[0, ..., 0].detach(), 1 - expected["transmittance"], atol=5e-4)
        colors.sum().backward()
        for tensor in (mean, log_scale, quaternion, opacity, sh, w2c):
            self.assertTrue(torch.isfinite(tensor.grad).all())
            self.assertGreater(tensor.grad.abs().max(), 0)

    def test_rasterization_of_plain_colours_and_features(self):
        mean, log_scale, quaternion, opacity, _ = tensors()
        features = torch.rand(40, 5, generator=torch.Generator().manual_seed(1)).requires_grad_()
        backgrounds = torch.rand(2, 5, generator=torch.Generator().manual_seed(2)).requires_grad_()
        view = scenes.camera()
        w2c = torch.from_numpy(np.linalg.inv(scenes.C2W)).float().expand(2, 4, 4)
        k = torch.tensor([[view.fx, 0, view.cx], [0, view.fy, view.cy], [0, 0, 1]]).expand(2, 3, 3)
        gaussians = (mean, quaternion, log_scale.exp(), torch.sigmoid(opacity))
        many, alphas, _ = gart.torch.rasterization(*gaussians, features, w2c, k, 40, 32, backgrounds=backgrounds)
        self.assertEqual(many.shape, (2, 32, 40, 5))
        last, _, _ = gart.torch.rasterization(*gaussians, features[:, 2:5], w2c, k, 40, 32,
                                              backgrounds=backgrounds[:, 2:5])
        np.testing.assert_allclose(many[..., 2:5].detach(), last.detach(), atol=2e-5)
        many.sum().backward()
        np.testing.assert_allclose(backgrounds.grad, (1 - alphas.detach()).sum((1, 2)).expand(2, 5), rtol=1e-4)
        # A feature's gradient is the sum of its weights, alike for all of them.
        np.testing.assert_allclose(features.grad[:, 0], features.grad[:, 4], rtol=1e-3, atol=1e-3)

        # Of any sign, of each view, and in more than one pass: all of them are linear in the features.
        with torch.no_grad():
            one = gart.torch.rasterization(*gaussians, features, w2c, k, 40, 32)[0]
            shifts = torch.tensor([-3.0, 0.5])
            each = torch.stack([features + shift for shift in shifts])
            seen = gart.torch.rasterization(*gaussians, each, w2c, k, 40, 32, render_mode="RGB+D")[0]
            self.assertEqual(seen.shape, (2, 32, 40, 6))
            np.testing.assert_allclose(seen[..., :5], one + shifts[:, None, None, None] * alphas, atol=2e-5)
            wide = torch.randn(40, 515, generator=torch.Generator().manual_seed(3))
            seen = gart.torch.rasterization(*gaussians, wide, w2c[:1], k[:1], 40, 32)[0]
            for channel in (0, 511, 514):
                alone = gart.torch.rasterization(*gaussians, wide[:, channel:channel + 1], w2c[:1], k[:1], 40, 32)[0]
                np.testing.assert_allclose(seen[..., channel:channel + 1], alone, atol=1e-6)

    def matrix_and_pose(self, view):
        k = torch.tensor([[view.fx, 0, view.cx], [0, view.fy, view.cy], [0, 0, 1]], dtype=torch.float64)
        return k, torch.from_numpy(np.linalg.inv(scenes.C2W))

    def test_gradients_of_intrinsics_are_finite_differences(self):
        arrays, view = tensors(n=4, degree=1), scenes.camera(24, 20)
        with torch.no_grad():
            arrays[0][:, 2] = torch.tensor([2.0, -1.5, 0.5, 4.0])
            arrays[1] += 0.3
        weight = torch.from_numpy(np.random.default_rng(7).normal(0, 1, (20, 24, 3)))
        k, _ = self.matrix_and_pose(view)
        k.requires_grad_()
        rays = _rasterization._rays(k, torch.from_numpy(scenes.C2W), 24, 20)
        color = gart.torch.trace(*arrays, *rays, **scenes.SMOOTH)[0].reshape(20, 24, 3)
        np.testing.assert_allclose(color.detach(), gart.torch.render(*arrays, view, **scenes.SMOOTH)[0].detach(), atol=1e-4)
        (weight * color.double()).sum().backward()

        def by_definition(numbers):
            moved = gart.Camera(24, 20, *numbers.tolist(), c2w=scenes.C2W)
            seen = gart.reference(gart.Model(*[a.detach() for a in arrays]), moved, **scenes.SMOOTH)
            return (weight * seen["color"]).sum()

        numbers = torch.tensor([view.fx, view.fy, view.cx, view.cy], dtype=torch.float64)
        self.assert_close(k.grad[(0, 1, 0, 1), (0, 1, 2, 2)], finite_differences(by_definition, numbers, 1e-2))

    def test_rasterization_has_gradients_by_intrinsics(self):
        mean, log_scale, quaternion, opacity, sh = tensors()
        view = scenes.camera()
        k, w2c = (t.float()[None] for t in self.matrix_and_pose(view))
        gaussians = (mean, quaternion, log_scale.exp(), torch.sigmoid(opacity), sh)
        expected = gart.torch.rasterization(*gaussians, w2c, k, 40, 32, sh_degree=1)[0].detach()
        k.requires_grad_(), w2c.requires_grad_()
        colors, _, _ = gart.torch.rasterization(*gaussians, w2c, k, 40, 32, sh_degree=1)
        np.testing.assert_allclose(colors.detach(), expected, atol=2e-4)
        colors.square().sum().backward()
        by_rays, k.grad, w2c.grad = (k.grad.clone(), w2c.grad.clone(), mean.grad.clone()), None, None
        self.assertTrue((by_rays[0][0, (0, 1, 0, 1), (0, 1, 2, 2)] != 0).all())
        mean.grad = None
        gaussians = (mean, quaternion, log_scale.exp(), torch.sigmoid(opacity), sh)
        gart.torch.rasterization(*gaussians, w2c, k.detach(), 40, 32, sh_degree=1)[0].square().sum().backward()
        self.assert_close(by_rays[2], mean.grad.double())
        self.assert_close(by_rays[1][0, :3, 3], w2c.grad[0, :3, 3].double())
        with self.assertRaisesRegex(gart.InvalidArgument, "detach Ks"):
            gart.torch.rasterization(*gaussians, w2c, k, 40, 32, sh_degree=1, rasterize_mode="antialiased")

    def test_strategies_get_what_they_read(self):
        """means2d's gradient is the loss's by a mean that moves sideways; radii are those of the images."""
        mean, log_scale, quaternion, opacity, sh = tensors(n=12)
        view = scenes.camera()
        k, w2c = (t.float() for t in self.matrix_and_pose(view))
        turned = w2c.clone()
        turned[0, 3] += 0.2
        views, ks = torch.stack((w2c, turned)), k.expand(2, 3, 3)

        def seen(mean):
            return gart.torch.rasterization(mean, quaternion, log_scale.exp(), torch.sigmoid(opacity), sh, views, ks, 40, 32,
                                            sh_degree=1)

        colors, _, info = seen(mean)
        self.assertEqual(info["means2d"].shape, (2, 12, 2))
        info["means2d"].retain_grad()  # as strategies do before the backward pass
        weight = torch.linspace(-1, 1, 40)[None, None, :, None]
        (weight * colors).sum().backward()
        by_places = info["means2d"].grad
        camera_means = mean.detach() @ w2c[:3, :3].T + w2c[:3, 3]
        projected = camera_means @ k.T
        np.testing.assert_allclose(info["means2d"][0].detach(), projected[:, :2] / projected[:, 2:], rtol=1e-4, atol=1e-3)
        # Both views move by about the same pixels: the sum of their gradients is the loss's.
        for axis in range(2):
            step = torch.zeros(3)
            step[axis] = 1
            sideways = (step @ w2c[:3, :3])[None] * (camera_means[:, 2:] / k[axis, axis])
            along = (mean.grad * sideways).sum(-1)  # the whole gradient, by a pixel
            np.testing.assert_allclose(by_places.sum(0)[:, axis], along, rtol=2e-3, atol=2e-4 * along.abs().max())
        radii = info["radii"]
        self.assertEqual((radii.shape, radii.dtype), ((2, 12, 2), torch.int32))
        self.assertTrue((radii > 0).all())
        with torch.no_grad():
            away = mean.clone()
            away[0] += 100 * (step @ w2c[:3, :3])
            self.assertTrue((seen(away)[2]["radii"][:, 0] == 0).all())
            self.assertIsNone(seen(away)[2]["means2d"])
        # A round one on the axis has 3 f s / z pixels, rounded up with the filter's 0.3.
        one = [t.detach()[:1].clone() for t in (mean, quaternion, log_scale, opacity, sh)]
        one[0][:] = torch.tensor([0, 0, 5.0]) @ w2c[:3, :3] - w2c[:3, 3] @ w2c[:3, :3]
        info = gart.torch.rasterization(one[0], one[1], torch.full((1, 3), 0.5), torch.sigmoid(one[3]), one[4], views[:1],
                                        ks[:1], 40, 32, sh_degree=1)[2]
        expected = [np.ceil(3 * np.sqrt((f * 0.5 / 5) ** 2 + 0.3)) for f in (view.fx, view.fy)]
        np.testing.assert_array_equal(info["radii"][0, 0], expected)
        with self.assertRaises(KeyError):
            info["conics"]

    def test_a_scene_is_learned_by_torch(self):
        view = scenes.camera()
        truth = gart.torch.render(*[a.detach() for a in tensors(degree=0)], view)[0]
        arrays = tensors(degree=0)
        with torch.no_grad():
            arrays[4] += 0.5
            arrays[0] += 0.05
        adam = torch.optim.Adam(arrays, lr=0.02)
        losses = []
        for _ in range(60):
            loss = (gart.torch.render(*arrays, view)[0] - truth).square().mean()
            adam.zero_grad()
            loss.backward()
            adam.step()
            losses.append(loss.item())
        self.assertLess(losses[-1], losses[0] / 20)

    def test_gradients_have_no_gradients(self):
        arrays = tensors(n=4)
        image = gart.torch.render(*arrays, scenes.camera(8, 8))[0]
        by_mean, = torch.autograd.grad(image.square().sum(), arrays[:1], create_graph=True)
        with self.assertRaisesRegex(RuntimeError, "once_differentiable"):
            by_mean.sum().backward()

    def test_calls_cost_little(self):
        """In the time of one thread of the processor: about 20 us, of which 9 us are the renderer's; 57 us were seen on a
        busy machine."""
        program = f"""import sys, time, timeit
sys.path.insert(0, {str(pathlib.Path(__file__).parent)!r})
import gart.torch, scenes, torch
arrays = [torch.from_numpy(a) for a in scenes.parameters(n=1, degree=0)]
view = gart.Camera(1, 1, 1, 1)
call = lambda: gart.torch.render(*arrays, view)
print(min(timeit.repeat(call, number=200, repeat=7, timer=time.process_time)) / 200)"""
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True,
                              env={**os.environ, "OMP_NUM_THREADS": "1"})
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertLess(float(done.stdout), 100e-6)

    def test_no_tensor_is_copied(self):
        """The renderer is lent torch's own memory: it sees what is written there."""
        arrays = [a.detach() for a in tensors()]
        renderer = gart.Renderer(sh_degree=1, backend="serial")
        renderer.bind(*arrays)
        color = torch.empty(32, 40, 3)
        renderer.render_to(scenes.camera(), color=color)
        before = color.clone()
        arrays[4].fill_(0.5)
        renderer.render_to(scenes.camera(), color=color)
        self.assertGreater((color - before).abs().max(), 0.05)

    @unittest.skipUnless(torch.cuda.is_available() and gart.resolve()["backend"] == "cuda", "no CUDA in torch or in gart")
    def test_a_device_gives_what_the_host_does(self):
        """Images and gradients of a view, of rays and by gsplat's names, on the default stream and on another."""
        view = scenes.camera()
        rays = _rasterization._rays(self.matrix_and_pose(view)[0], torch.from_numpy(scenes.C2W), 40, 32)
        k, w2c = (t.float()[None] for t in self.matrix_and_pose(view))
        features = torch.randn(40, 20, generator=torch.Generator().manual_seed(1))
        given = [*[t.detach() for t in tensors()], features, torch.from_numpy(scenes.C2W), *rays]

        def everything(device):
            (*arrays, f, c2w, d, o) = learned = [t.clone().to(device).requires_grad_() for t in given]
            mean, log_scale, quaternion, opacity, _ = arrays
            seen = (*gart.torch.render(*arrays, view, features=f, c2w=c2w), *gart.torch.trace(*arrays, d, o, features=f),
                    *gart.torch.rasterization(mean, quaternion, log_scale.exp(), torch.sigmoid(opacity), f, w2c.to(device),
                                              k.to(device), 40, 32, render_mode="RGB+D")[:2])
            placed = gart.torch.place(*arrays, torch.tensor([0.9, 0.1, 0.2, 0.0], device=device), c2w[:3, 3] * 0.1, 0.8)
            seen = (*seen, gart.torch.render(*placed, view)[0])
            sum(image.square().sum() for image in seen).backward()
            return [t.detach().cpu() for t in seen], [t.grad.cpu() for t in learned]

        images, gradients = everything("cpu")
        for stream in (torch.cuda.current_stream(), torch.cuda.Stream()):
            with torch.cuda.stream(stream):
                got_images, got_gradients = everything("cuda")
            for got, expected in zip(got_images, images):
                np.testing.assert_allclose(got, expected, atol=1e-4 * max(1, float(expected.abs().max())))
            for got, expected in zip(got_gradients, gradients):
                self.assert_close(got, expected.double(), 2e-3)

    def test_the_operator_is_the_function(self):
        """With torch.library's part played by a stand-in, which any torch can run."""
        from gart.torch import _operators
        operator, view = _operators.make(OperatorsByHand), scenes.camera(16, 12)
        features = torch.randn(6, 4, generator=torch.Generator().manual_seed(1))
        numbers = _operators.numbers_of(None, {"near": 0.02, "background": (0.2, 0.5, 0.9)})
        given = gart.RenderOptions(near=0.02, background=(0.2, 0.5, 0.9))
        np.testing.assert_array_equal(np.float32(numbers), _operators.numbers_of(given, {}))
        with self.assertRaisesRegex(TypeError, "no option 'nearr': there are .*near"):
            _operators.numbers_of(None, {"nearr": 1})
        for with_features, with_pose in ((False, False), (True, True)):
            given = [[*tensors(n=6, degree=1), features.clone().requires_grad_(),
                      torch.from_numpy(scenes.C2W.T.copy()).T.requires_grad_()] for _ in range(2)]
            (*one, f, pose), (*other, g, same_pose) = given
            expected = gart.torch.render(*one, view, features=f if with_features else None,
                                         c2w=pose if with_pose else None, near=0.02, background=(0.2, 0.5, 0.9))
            got = operator(*other, g if with_features else torch.empty(6, 0), same_pose if with_pose else torch.empty(0),
                           view.json(), numbers, 2)
            for a, b in zip(expected, got):
                np.testing.assert_array_equal(a.detach(), b.detach())
            for images in (expected, got):
                sum((k + 1) * image.square().sum() for k, image in enumerate(images) if k != 1).backward()
            for a, b in zip(*given):
                self.assertEqual(a.grad is None, b.grad is None)
                if a.grad is not None:
                    np.testing.assert_allclose(a.grad, b.grad, rtol=1e-4, atol=1e-5 * float(a.grad.abs().max()))

    @unittest.skipUnless(hasattr(torch.library, "custom_op"), "torch has no custom_op: the operators are not there")
    def test_operators_pass_torchs_own_check(self):
        from gart.torch import _operators
        arrays, view = tensors(n=6, degree=0), scenes.camera(16, 12)
        features = torch.randn(6, 4, generator=torch.Generator().manual_seed(1)).requires_grad_()
        pose = torch.from_numpy(scenes.C2W).requires_grad_()
        for f, c2w in ((features, pose), (torch.empty(6, 0), torch.empty(0))):
            torch.library.opcheck(torch.ops.gart.render.default,
                                  (*arrays, f, c2w, view.json(), _operators.numbers_of(None, {}), 2))
        text = view.json()
        compiled = torch.compile(lambda *a: gart.torch.render(*a[:5], text, features=a[5], near=0.02), fullgraph=True,
                                 backend="aot_eager")
        expected = gart.torch.render(*arrays, view, features=features, near=0.02)
        for a, b in zip(compiled(*arrays, features), expected):
            torch.testing.assert_close(a, b)
        broken = torch.compile(lambda *a: gart.torch.render(*a, view, c2w=pose)[0], backend="aot_eager")
        torch.testing.assert_close(broken(*arrays), gart.torch.render(*arrays, view, c2w=pose)[0])


if __name__ == "__main__":
    unittest.main()
