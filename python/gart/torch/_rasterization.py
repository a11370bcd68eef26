"""gsplat's rasterization, by rays and in exact order, and what its strategies read."""
import torch

from .. import _gart
from ..errors import InvalidArgument
from ._functions import render, trace

_SH0 = 0.28209479177387814  # the constant basis function: colour = 0.5 + _SH0 * sh
_MOST_FEATURES = 512  # of a Gaussian in one pass


class _SeenAt(torch.autograd.Function):
    """The means as a view uses them: what their gradient says of their places in the image goes to means2d too."""

    @staticmethod
    def forward(ctx, means, means2d, c2w, fx, fy):
        ctx.save_for_backward(means.detach(), c2w)
        ctx.focal = fx, fy
        return means.view_as(means)

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx, by_means):
        means, c2w = ctx.saved_tensors
        rotation = c2w[:3, :3].to(by_means)
        x, y, z = ((means - c2w[:3, 3].to(means)) @ rotation).unbind(-1)
        sideways = by_means @ rotation[:, :2]  # the image moves by f / z as a mean moves along an axis of the camera
        by_places = torch.stack((sideways[:, 0] * z / ctx.focal[0], sideways[:, 1] * z / ctx.focal[1]), -1)
        return by_means, by_places, None, None, None


class _Meta(dict):
    """What views say besides their images. "radii" is computed when it is read."""

    radii = None

    def __missing__(self, name):
        if name != "radii" or self.radii is None:
            raise KeyError(name)
        self[name] = self.radii()
        return self[name]


def _rotations(quats):
    w, x, y, z = torch.nn.functional.normalize(quats, dim=-1).unbind(-1)
    rows = (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y))
    return torch.stack(rows, -1).reshape(-1, 3, 3)


def _radii(means, quats, scales, poses, numbers, width, height, near, eps2d):
    """Radii [C, N, 2] in pixels, as gsplat has them: three standard deviations of the Gaussian's linearised image,
    rounded up; 0 where the image shows none of that, or it is nearer than `near`."""
    axes = _rotations(quats.detach()) * scales.detach()[:, None, :]
    out = []
    for c2w, (fx, fy, cx, cy) in zip(poses, numbers):
        rotation = c2w[:3, :3].to(means)
        x, y, z = ((means.detach() - c2w[:3, 3].to(means)) @ rotation).unbind(-1)
        along = rotation.T @ axes  # [N, 3, 3]: the axes in the camera
        inverse = 1 / z.clamp(min=near)
        sides = []
        for f, at, centre, size, row in ((fx, x, cx, width, 0), (fy, y, cy, height, 1)):
            slope = at * inverse
            deviation = f * inverse[:, None] * (along[:, row] - slope[:, None] * along[:, 2])
            radius = (3 * (deviation.square().sum(-1) + eps2d).sqrt()).ceil()
            place = f * slope + centre
            sides.append((radius, (place + radius > 0) & (place - radius < size)))
        seen = sides[0][1] & sides[1][1] & (z > near)
        out.append(torch.stack([torch.where(seen, radius, torch.zeros_like(radius)) for radius, _ in sides], -1))
    return torch.stack(out).to(torch.int32)


_MODELS = {"pinhole": "PINHOLE", "ortho": "ORTHOGRAPHIC", "fisheye": "OPENCV_FISHEYE"}


def rasterization(means, quats, scales, opacities, colors, viewmats, Ks, width, height, near_plane=0.01,
                  far_plane=1e10, radius_clip=0.0, eps2d=0.3, sh_degree=None, packed=True, tile_size=16,
                  backgrounds=None, render_mode="RGB", sparse_grad=False, absgrad=False, rasterize_mode="classic",
                  channel_chunk=32, distributed=False, camera_model="pinhole", segmented=False, covars=None, **lens):
    """gsplat's ``rasterization``, by rays and in exact order.

    means [N, 3], quats [N, 4] (w, x, y, z), scales [N, 3] and opacities [N] in (0, 1); colors [N, K, 3] or [C, N, K, 3] of
    spherical harmonics where sh_degree says how many bands count, else [N, D] or [C, N, D]; viewmats [C, 4, 4], world to
    camera, and Ks [C, 3, 3]. lens: parameters by COLMAP's names, as k1=0.1 with camera_model="fisheye".

    Returns render_colors [C, H, W, D], render_alphas [C, H, W, 1] and a dictionary. render_mode may be "RGB", "D", "ED",
    "RGB+D" or "RGB+ED". Gradients are those of means, quats, scales, opacities, colors, viewmats, backgrounds and Ks.
    Ks gets one with pinhole cameras, without antialiasing: views are then traced as batches of rays, which takes longer.

    The dictionary has width, height and n_cameras, and for pinhole cameras what gsplat's strategies read with
    packed=False: means2d [C, N, 2], whose .grad is the loss's by the means' places in the image, in pixels, and radii
    [C, N, 2] in pixels.

    What is otherwise than there: near_plane is along the ray; depth is that of the point of largest response on the ray,
    where gsplat has the centre's; "antialiased" widens by the filter of math/widened.hpp. Three channels are colours, of
    which less than 0 counts as 0; any other number are features, of any sign. far_plane and radius_clip must be without
    effect, and what shows how tiles are kept (packed, tile_size, channel_chunk, segmented, sparse_grad) has none.
    """
    if covars is not None or distributed or absgrad:
        raise InvalidArgument("gart.torch.rasterization: covars, distributed and absgrad are not there: give quats and "
                              "scales, and leave the others False")
    if radius_clip != 0.0:
        raise InvalidArgument("gart.torch.rasterization: radius_clip must be 0: nothing is left out for its size")
    if render_mode not in ("RGB", "D", "ED", "RGB+D", "RGB+ED"):
        raise InvalidArgument(f"gart.torch.rasterization: render_mode '{render_mode}' is none of RGB, D, ED, RGB+D, RGB+ED")
    if camera_model not in _MODELS:
        raise InvalidArgument(f"gart.torch.rasterization: camera_model '{camera_model}' is none of {', '.join(_MODELS)}")
    n, views = means.shape[0], viewmats.shape[0]
    of_views, plain = _check_colors(colors, n, views, sh_degree)
    log_scale, opacity = scales.log(), torch.logit(opacities, eps=1e-7)
    # Poses that nobody learns are looked at on the host alone.
    poses = _inverted(viewmats if viewmats.requires_grad else viewmats.detach().cpu())
    numbers = Ks.detach()[:, (0, 1, 0, 1), (0, 1, 2, 2)].cpu().tolist()
    behind = [(0.0, 0.0, 0.0)] * views if plain or backgrounds is None else backgrounds.detach().cpu().tolist()
    filter_width = eps2d ** 0.5 if rasterize_mode == "antialiased" else 0.0
    by_rays = Ks.requires_grad and torch.is_grad_enabled()
    if by_rays and (camera_model != "pinhole" or filter_width > 0):
        raise InvalidArgument("gart.torch.rasterization: Ks gets a gradient with camera_model 'pinhole' and "
                              "rasterize_mode 'classic' alone: detach Ks")
    means2d = None
    if camera_model == "pinhole" and means.requires_grad and torch.is_grad_enabled():
        means2d = _places(means, poses, numbers).requires_grad_()
    images, alphas = [], []
    shared = None if of_views else _channels(colors, n, sh_degree)
    for view in range(views):
        fx, fy, cx, cy = numbers[view]
        used = means if means2d is None else _SeenAt.apply(means, means2d[view], poses[view].detach(), fx, fy)
        camera = _gart.Camera(width, height, fx, fy, cx, cy, model=_MODELS[camera_model], **lens)
        learned = poses[view] if viewmats.requires_grad else None
        if learned is None:
            camera.c2w = poses[view].numpy()
        # The same coefficients for all views are one tensor, which the renderer knows again.
        sh, chunks = shared or _channels(colors[view], n, sh_degree)
        gaussians = used, log_scale, quats, opacity, sh
        settings = {"near": near_plane, "antialias": filter_width, "background": behind[view]}
        parts = []
        for chunk in chunks if "RGB" in render_mode else chunks[:1]:
            if by_rays:
                rays = _rays(Ks[view], poses[view].to(means.device), width, height)
                seen = trace(*gaussians, *rays, features=chunk, **settings)
                seen = [t.reshape(height, width, *t.shape[1:]) for t in seen]
            else:
                seen = render(*gaussians, camera, features=chunk, c2w=learned, **settings)
            parts.append(seen[0] if chunk is None else seen[3])
        transmittance, depth = seen[1:3]
        shown = [_before(parts, transmittance, backgrounds, view, plain)] if "RGB" in render_mode else []
        alpha = (1 - transmittance).unsqueeze(-1)
        if "D" in render_mode:
            z = depth.unsqueeze(-1) * _z_of_rays(camera, camera_model, depth).unsqueeze(-1)
            shown.append(z / alpha.clamp(min=1e-10) if "ED" in render_mode else z)
        images.append(torch.cat(shown, -1) if len(shown) > 1 else shown[0])
        alphas.append(alpha)
    meta = _Meta(width=width, height=height, n_cameras=views)
    if camera_model == "pinhole":
        meta["means2d"] = means2d
        meta.radii = lambda: _radii(means, quats, scales, poses.detach(), numbers, width, height, near_plane, eps2d)
    return torch.stack(images), torch.stack(alphas), meta


def _inverted(viewmats):
    """World to camera, [C, 4, 4], as camera to world; in double, since a pose may lie far from the origin."""
    rotation = viewmats[:, :3, :3].double().transpose(1, 2)
    position = -(rotation @ viewmats[:, :3, 3:].double())
    last = torch.tensor([0.0, 0.0, 0.0, 1.0], dtype=torch.float64, device=viewmats.device).expand(len(viewmats), 1, 4)
    return torch.cat((torch.cat((rotation, position), 2), last), 1)


def _places(means, poses, numbers):
    """Where views show the means, [C, N, 2] in pixels."""
    out = []
    for c2w, (fx, fy, cx, cy) in zip(poses.detach(), numbers):
        x, y, z = ((means.detach() - c2w[:3, 3].to(means)) @ c2w[:3, :3].to(means)).unbind(-1)
        out.append(torch.stack((fx * x / z + cx, fy * y / z + cy), -1))
    return torch.stack(out)


def _rays(k, c2w, width, height):
    """Directions and origins [H W, 3] of a pinhole's pixels, differentiable by its matrix and its pose."""
    like = {"device": c2w.device, "dtype": torch.float64}
    k = k.to(c2w)
    x = (torch.arange(width, **like) + 0.5 - k[0, 2]) / k[0, 0]
    y = (torch.arange(height, **like) + 0.5 - k[1, 2]) / k[1, 1]
    in_camera = torch.stack((x.expand(height, width), y[:, None].expand(height, width), torch.ones(height, width, **like)), -1)
    directions = in_camera.reshape(-1, 3) @ c2w[:3, :3].T
    return directions.float(), c2w[:3, 3].expand_as(directions).float()


def _check_colors(colors, n, views, sh_degree):
    """Whether colors are of each view, and whether they are features."""
    last = 2 if sh_degree is None else 3
    of_views = colors.dim() == last + 1
    if colors.shape[of_views:][:1] != (n,) or colors.dim() - of_views != last or (of_views and len(colors) != views):
        raise InvalidArgument(f"gart.torch.rasterization: colors must be [N, D] or [C, N, D], and with sh_degree [N, K, 3] "
                              f"or [C, N, K, 3], where N is {n} and C is {views}; they are {list(colors.shape)}")
    if sh_degree is not None and (colors.shape[-1] != 3 or colors.shape[-2] < (sh_degree + 1) ** 2):
        raise InvalidArgument(f"gart.torch.rasterization: sh_degree {sh_degree} needs colors of {(sh_degree + 1) ** 2} "
                              f"coefficients for 3 channels; they are {list(colors.shape)}")
    return of_views, colors.shape[-1] != 3


def _channels(colors, n, sh_degree):
    """Spherical harmonics, and features in as many tensors as there are passes; None: the pass is of colours."""
    if sh_degree is not None:
        return colors[:, :(sh_degree + 1) ** 2].contiguous(), [None]
    if colors.shape[1] == 3:
        return ((colors - 0.5) / _SH0).unsqueeze(1), [None]
    return colors.new_zeros((n, 1, 3)), list(colors.split(_MOST_FEATURES, 1))


def _before(parts, transmittance, backgrounds, view, plain):
    """The channels of an image before their background, which colours have but for its gradient."""
    image = torch.cat(parts, -1) if len(parts) > 1 else parts[0]
    if backgrounds is None or not (plain or backgrounds.requires_grad):
        return image
    left, b = transmittance.unsqueeze(-1), backgrounds[view]
    return image + left * b if plain else image + left.detach() * (b - b.detach())


def _z_of_rays(camera, camera_model, like):
    """The third number of each pixel's ray."""
    if camera_model == "ortho":
        return torch.ones_like(like)
    if camera_model != "pinhole":
        raise InvalidArgument("gart.torch.rasterization: depth is there for pinhole and ortho cameras alone")
    x = (torch.arange(camera.width, device=like.device, dtype=like.dtype) + 0.5 - camera.cx) / camera.fx
    y = (torch.arange(camera.height, device=like.device, dtype=like.dtype) + 0.5 - camera.cy) / camera.fy
    return (x[None, :] ** 2 + y[:, None] ** 2 + 1).rsqrt()
