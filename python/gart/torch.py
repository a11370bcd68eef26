"""gart as an operator of torch, on the CPU and on CUDA devices.

``rasterization`` has gsplat's names, so that a program changes one import; ``render`` is one view by gart's own, ``trace``
rays that no image has. All are differentiable by the Gaussians, and by the pose or the rays. Tensors are float32 and are
not copied; work goes to torch's current stream. torch is imported with this module, and gart is linked to no torch: any
version from 1.12 on will do.

A forward pass keeps what its gradients need until its graph goes. Where other Gaussians were rendered in between, the
backward pass makes it again: gradients are the same, the step takes one forward pass more.
"""
import functools
import threading

import torch
from torch.utils.dlpack import to_dlpack as _lend  # without __dlpack__'s waits: all work is in torch's current stream

from . import _gart
from .errors import InvalidArgument

_SH0 = 0.28209479177387814  # the constant basis function: colour = 0.5 + _SH0 * sh
_PARAMETERS = ("mean", "log_scale", "quaternion", "opacity", "sh")


class _Shared:
    """A renderer, and which Gaussians it has."""

    def __init__(self, depth, request):
        self.renderer = _gart.Renderer(depth=depth, **request)
        self.depth = depth
        self.bound = None
        self.lock = threading.RLock()

    def bind(self, parameters):
        # Memory that is bound is kept, so that its address is of nothing else.
        key = [(p.data_ptr(), p.shape) for p in parameters]
        if key != self.bound:
            self.bound = None
            self.renderer.bind(*map(_lend, parameters))
            self.bound = key


_shared = {}
_lock = threading.Lock()


def _shared_of(tensor, sh_degree, kernel_degree, depth=False):
    """The renderer for such tensors; once depth had a gradient, the one that has it."""
    request = {"sh_degree": sh_degree, "kernel_degree": kernel_degree}
    if tensor.is_cuda:
        stream = torch.cuda.current_stream(tensor.device).cuda_stream
        request.update(backend="cuda", device=tensor.device.index, stream=stream)
    elif tensor.device.type == "cpu":
        request.update(backend="openmp")
    else:
        raise InvalidArgument(f"gart.torch: tensors must be on the CPU or on a CUDA device, not on {tensor.device}")
    key = tuple(request.items())
    with _lock:
        if key not in _shared or (depth and not _shared[key].depth):
            _shared[key] = _Shared(depth, request)
        return _shared[key]


def release():
    """Gives back the memory of the renderers that calls share."""
    with _lock:
        _shared.clear()


@functools.lru_cache(maxsize=4096)
def _camera_of(text):
    return _gart.Camera.from_json(text)


def _degree_of(sh):
    return int(round(sh.shape[1] ** 0.5)) - 1


def _shared_for(parameters, kernel_degree, depth=False):
    return _shared_of(parameters[0], _degree_of(parameters[4]), kernel_degree, depth)


def _pass(shared, parameters, seen, options, **images):
    """A forward pass of a camera or of rays, into images where they are given: its context."""
    lent = {name: _lend(image) for name, image in images.items()}
    shared.bind(parameters)
    if isinstance(seen, _gart.Camera):
        return shared.renderer.forward(seen, options, **lent)
    directions, origins, t_max = (None if r is None else _lend(r) for r in seen)
    return shared.renderer.forward_rays(directions, origins, t_max, options=options, **lent)


def _forward(parameters, seen, options, kernel_degree, record):
    """Colour, transmittance and depth, and a context where gradients will be asked for."""
    mean = parameters[0]
    shape = (seen.height, seen.width) if isinstance(seen, _gart.Camera) else (seen[0].shape[0],)
    images = {"color": mean.new_empty((*shape, 3)), "transmittance": mean.new_empty(shape), "depth": mean.new_empty(shape)}
    shared = _shared_for(parameters, kernel_degree)
    with shared.lock:
        if record or not isinstance(seen, _gart.Camera):
            context = _pass(shared, parameters, seen, options, **images)
        else:
            context = None
            shared.bind(parameters)
            shared.renderer.render_to(seen, options, **{name: _lend(image) for name, image in images.items()})
    return tuple(images.values()), (shared, context)


def _backward(parameters, seen, options, kernel_degree, kept, gradients, pose=False, rays=(False, False)):
    """dL/d the parameters; the six numbers of the pose, and the rays' directions and origins, where they are asked for."""
    names = ("color_gradient", "transmittance_gradient", "depth_gradient")
    by = {name: g.contiguous() for name, g in zip(names, gradients) if g is not None}
    shared, context = kept
    depth = isinstance(seen, _gart.Camera) and len(by) > ("color_gradient" in by)
    if shared is None or (depth and not shared.depth):
        shared, context = _shared_for(parameters, kernel_degree, depth), None
    out = [torch.empty_like(p) for p in parameters]
    turned = parameters[0].new_empty(6) if pose else None
    by_rays = [torch.empty_like(r) if wanted else None for r, wanted in zip(seen, rays)] if any(rays) else [None, None]
    to = dict(zip((*_PARAMETERS, "pose", "directions", "origins"), (*out, turned, *by_rays)))

    def go(context):
        context.backward(**{name: _lend(t) for name, t in {**by, **to}.items() if t is not None})

    with shared.lock:
        try:
            go(context or _pass(shared, parameters, seen, options))
        except InvalidArgument:
            if context is None:
                raise
            go(_pass(shared, parameters, seen, options))  # the renderer has had other Gaussians since
    return out, turned, by_rays


def _by_c2w(c2w, turned):
    """dL/d a matrix [4, 4] whose turns by a small w have dL/dw: of all those the one that lies along turns."""
    turned = turned.to(c2w)
    cross = torch.zeros_like(c2w[:3, :3])
    cross[0, 1], cross[0, 2], cross[1, 2] = -turned[5], turned[4], -turned[3]
    out = torch.zeros_like(c2w)
    out[:3, :3] = 0.5 * (cross - cross.T) @ c2w[:3, :3]
    out[:3, 3] = turned[:3]
    return out


class _Render(torch.autograd.Function):
    @staticmethod
    def forward(ctx, mean, log_scale, quaternion, opacity, sh, c2w, camera, options, kernel_degree, record):
        parameters = [p.detach() for p in (mean, log_scale, quaternion, opacity, sh)]
        images, kept = _forward(parameters, camera, options, kernel_degree, record)
        if record:
            ctx.save_for_backward(mean, log_scale, quaternion, opacity, sh, c2w)
            ctx.arguments = camera, options, kernel_degree, kept
            ctx.set_materialize_grads(False)
        return images

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx, *gradients):
        *parameters, c2w = ctx.saved_tensors
        pose = ctx.needs_input_grad[5]
        out, turned, _ = _backward([p.detach() for p in parameters], *ctx.arguments, gradients, pose)
        return (*out, _by_c2w(c2w, turned) if pose else None, None, None, None, None)


class _Trace(torch.autograd.Function):
    @staticmethod
    def forward(ctx, mean, log_scale, quaternion, opacity, sh, directions, origins, t_max, options, kernel_degree):
        tensors = (mean, log_scale, quaternion, opacity, sh, directions, origins, t_max)
        *parameters, directions_, origins_, t_max_ = (None if t is None else t.detach() for t in tensors)
        images, kept = _forward(parameters, (directions_, origins_, t_max_), options, kernel_degree, True)
        ctx.save_for_backward(*tensors)
        ctx.arguments = options, kernel_degree, kept
        ctx.set_materialize_grads(False)
        return images

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx, *gradients):
        *parameters, directions, origins, t_max = (None if t is None else t.detach() for t in ctx.saved_tensors)
        out, _, by_rays = _backward(parameters, (directions, origins, t_max), *ctx.arguments, gradients,
                                    rays=ctx.needs_input_grad[5:7])
        return (*out, *by_rays, None, None, None)


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


def _checked(parameters):
    for name, p in zip(_PARAMETERS, parameters):
        if p.dtype != torch.float32:
            raise InvalidArgument(f"gart.torch: {name} must be float32, not {p.dtype}")
    return [p.contiguous() for p in parameters]


def render(mean, log_scale, quaternion, opacity, sh, camera, *, c2w=None, options=None, kernel_degree=2, **settings):
    """A view of Gaussians, differentiable by all of them and by the pose.

    mean [N, 3], log_scale [N, 3], quaternion [N, 4] (w, x, y, z; any norm), opacity [N] (logits) and sh [N, K, 3], as
    gart.Model has them; camera a gart.Camera. c2w, [4, 4], takes the place of the camera's pose and gets a gradient.
    options is a gart.RenderOptions; settings are its fields by name, as background=(1, 1, 1).

    Returns colour [H, W, 3], transmittance [H, W], and depth [H, W] as the sum of weight * distance along the ray.
    """
    parameters = _checked((mean, log_scale, quaternion, opacity, sh))
    options = _gart.RenderOptions(**settings) if options is None else options
    if c2w is not None:
        camera = _placed(camera, c2w)
    record = torch.is_grad_enabled() and any(t is not None and t.requires_grad for t in (*parameters, c2w))
    # The operators are for compilers: by hand the autograd function costs less a call.
    call = _operators if _operators is not None and torch.compiler.is_compiling() else _Render.apply
    return call(*parameters, c2w, camera, options, kernel_degree, record)


def trace(mean, log_scale, quaternion, opacity, sh, directions, origins=None, t_max=None, *, options=None,
          kernel_degree=2, **settings):
    """What rays see that no image has, differentiable by the Gaussians and by the rays.

    Gaussians as of render; directions [R, 3], of any length but 0; origins [R, 3], world units, or None: all rays begin
    at the origin; t_max [R], where rays end, or None. options and settings as of render, with antialias 0.

    Returns colour [R, 3], transmittance [R], and depth [R] as the sum of weight * distance along the ray.
    """
    parameters = _checked((mean, log_scale, quaternion, opacity, sh))
    options = _gart.RenderOptions(**settings) if options is None else options
    rays = [None if r is None else r.contiguous() for r in (directions, origins, t_max)]
    return _Trace.apply(*parameters, *rays, options, kernel_degree)


def _placed(camera, c2w):
    placed = _gart.Camera.from_json(camera.json())
    placed.c2w = c2w.detach().double().cpu().numpy()
    return placed


_MODELS = {"pinhole": "PINHOLE", "ortho": "ORTHOGRAPHIC", "fisheye": "OPENCV_FISHEYE"}


def rasterization(means, quats, scales, opacities, colors, viewmats, Ks, width, height, near_plane=0.01,
                  far_plane=1e10, radius_clip=0.0, eps2d=0.3, sh_degree=None, packed=True, tile_size=16,
                  backgrounds=None, render_mode="RGB", sparse_grad=False, absgrad=False, rasterize_mode="classic",
                  channel_chunk=32, distributed=False, camera_model="pinhole", segmented=False, covars=None, **lens):
    """gsplat's ``rasterization``, by rays and in exact order.

    means [N, 3], quats [N, 4] (w, x, y, z), scales [N, 3] and opacities [N] in (0, 1); colors [N, K, 3] of spherical
    harmonics where sh_degree says how many bands count, else [N, D] or [C, N, D] of at least 0; viewmats [C, 4, 4],
    world to camera, and Ks [C, 3, 3]. lens: parameters by COLMAP's names, as k1=0.1 with camera_model="fisheye".

    Returns render_colors [C, H, W, D], render_alphas [C, H, W, 1] and a dictionary. render_mode may be "RGB", "D", "ED",
    "RGB+D" or "RGB+ED". Gradients are those of means, quats, scales, opacities, colors, viewmats, backgrounds and Ks.
    Ks gets one with pinhole cameras, without antialiasing: views are then traced as batches of rays, which takes longer.

    The dictionary has width, height and n_cameras, and for pinhole cameras what gsplat's strategies read with
    packed=False: means2d [C, N, 2], whose .grad is the loss's by the means' places in the image, in pixels, and radii
    [C, N, 2] in pixels.

    What is otherwise than there: near_plane is along the ray; depth is that of the point of largest response on the ray,
    where gsplat has the centre's; "antialiased" widens by the filter of math/widened.hpp. far_plane and radius_clip
    must be without effect, and what shows how tiles are kept (packed, tile_size, channel_chunk, segmented, sparse_grad)
    has none.
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
    log_scale, opacity = scales.log(), torch.logit(opacities, eps=1e-7)
    # Poses that nobody learns are looked at on the host alone.
    of_views = viewmats if viewmats.requires_grad else viewmats.detach().cpu()
    poses = _inverted(of_views)
    numbers = Ks.detach()[:, (0, 1, 0, 1), (0, 1, 2, 2)].cpu().tolist()
    behind = [(0.0, 0.0, 0.0)] * views if backgrounds is None else backgrounds.detach().cpu().tolist()
    filter_width = eps2d ** 0.5 if rasterize_mode == "antialiased" else 0.0
    by_rays = Ks.requires_grad and torch.is_grad_enabled()
    if by_rays and (camera_model != "pinhole" or filter_width > 0):
        raise InvalidArgument("gart.torch.rasterization: Ks gets a gradient with camera_model 'pinhole' and "
                              "rasterize_mode 'classic' alone: detach Ks")
    means2d = None
    if camera_model == "pinhole" and means.requires_grad and torch.is_grad_enabled():
        means2d = _places(means, poses, numbers).requires_grad_()
    images, alphas, known = [], [], {}
    for view in range(views):
        fx, fy, cx, cy = numbers[view]
        used = means if means2d is None else _SeenAt.apply(means, means2d[view], poses[view].detach(), fx, fy)
        camera = _gart.Camera(width, height, fx, fy, cx, cy, model=_MODELS[camera_model], **lens)
        learned = poses[view] if viewmats.requires_grad else None
        if learned is None:
            camera.c2w = poses[view].numpy()
        channels = _channels(colors, n, sh_degree)
        parts = []
        for first in range(0, channels, 3):
            wide = min(3, channels - first)
            back = [*behind[view][first:first + wide], 0.0, 0.0][:3]
            # The same coefficients for all views are one tensor, which the renderer knows again.
            of_view = view if colors.dim() > (3 if sh_degree is not None else 2) else 0
            if (of_view, first) not in known:
                known[of_view, first] = _coefficients(colors, view, first, sh_degree)
            sh = known[of_view, first]
            settings = {"near": near_plane, "antialias": filter_width, "background": back}
            gaussians = used, log_scale, quats, opacity, sh
            if by_rays:
                rays = _rays(Ks[view], poses[view].to(means.device), width, height)
                seen = trace(*gaussians, *rays, **settings)
                image, transmittance, depth = (t.reshape(height, width, *t.shape[1:]) for t in seen)
            else:
                image, transmittance, depth = render(*gaussians, camera, c2w=learned, **settings)
            image = image[..., :wide]
            if backgrounds is not None and backgrounds.requires_grad:
                b = backgrounds[view, first:first + wide]
                image = image + transmittance.detach().unsqueeze(-1) * (b - b.detach())
            parts.append(image)
            if "RGB" not in render_mode:
                break
        alpha = (1 - transmittance).unsqueeze(-1)
        shown = parts if "RGB" in render_mode else []
        if "D" in render_mode:
            z = depth.unsqueeze(-1) * _z_of_rays(camera, camera_model, depth).unsqueeze(-1)
            shown = [*shown, z / alpha.clamp(min=1e-10) if "ED" in render_mode else z]
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


def _channels(colors, n, sh_degree):
    """How many channels an image has."""
    if colors.shape[-2 if sh_degree is None else -3] != n:
        raise InvalidArgument("gart.torch.rasterization: colors must be [N, D] or [C, N, D]; [N, K, 3] needs sh_degree")
    channels = colors.shape[-1]
    if channels != 3 and bool((colors < 0).any()):
        raise InvalidArgument("gart.torch.rasterization: features must be at least 0: shift them")
    return channels


def _coefficients(colors, view, first, sh_degree):
    """Spherical harmonics of three channels from the first on."""
    if sh_degree is not None:
        of_view = colors if colors.dim() == 3 else colors[view]
        return of_view[:, :(sh_degree + 1) ** 2].contiguous()
    part = (colors if colors.dim() == 2 else colors[view])[:, first:first + 3]
    part = torch.nn.functional.pad(part, (0, 3 - part.shape[1])) if part.shape[1] < 3 else part
    return ((part - 0.5) / _SH0).unsqueeze(1)


def _z_of_rays(camera, camera_model, like):
    """The third number of each pixel's ray."""
    if camera_model == "ortho":
        return torch.ones_like(like)
    if camera_model != "pinhole":
        raise InvalidArgument("gart.torch.rasterization: depth is there for pinhole and ortho cameras alone")
    x = (torch.arange(camera.width, device=like.device, dtype=like.dtype) + 0.5 - camera.cx) / camera.fx
    y = (torch.arange(camera.height, device=like.device, dtype=like.dtype) + 0.5 - camera.cy) / camera.fy
    return (x[None, :] ** 2 + y[:, None] ** 2 + 1).rsqrt()


def _make_operators():
    """gart::render and gart::render_backward, where torch has torch.library.custom_op: what torch.compile sees whole."""
    if not hasattr(torch.library, "custom_op"):
        return None
    from typing import List, Tuple
    Tensor = torch.Tensor
    fields = ("alpha_min", "transmittance_min", "near", "max_hits", "antialias", "rebuild_every")

    def unpacked(numbers):
        options = dict(zip(fields, numbers))
        options["max_hits"], options["rebuild_every"] = int(numbers[3]), int(numbers[5])
        return _gart.RenderOptions(background=tuple(numbers[6:9]), **options)

    @torch.library.custom_op("gart::render", mutates_args=())
    def op(mean: Tensor, log_scale: Tensor, quaternion: Tensor, opacity: Tensor, sh: Tensor, c2w: Tensor, camera: str,
           options: List[float], kernel_degree: int, height: int, width: int) -> Tuple[Tensor, Tensor, Tensor]:
        images, _ = _forward([mean, log_scale, quaternion, opacity, sh], _camera_of(camera), unpacked(options),
                             kernel_degree, False)
        return images

    @op.register_fake
    def _(mean, log_scale, quaternion, opacity, sh, c2w, camera, options, kernel_degree, height, width):
        return mean.new_empty((height, width, 3)), mean.new_empty((height, width)), mean.new_empty((height, width))

    @torch.library.custom_op("gart::render_backward", mutates_args=())
    def back(mean: Tensor, log_scale: Tensor, quaternion: Tensor, opacity: Tensor, sh: Tensor, c2w: Tensor, camera: str,
             options: List[float], kernel_degree: int, by_color: Tensor, by_transmittance: Tensor, by_depth: Tensor,
             pose: bool) -> Tuple[Tensor, Tensor, Tensor, Tensor, Tensor, Tensor]:
        gradients = [g if g.numel() else None for g in (by_color, by_transmittance, by_depth)]
        out, turned, _ = _backward([mean, log_scale, quaternion, opacity, sh], _camera_of(camera), unpacked(options),
                                   kernel_degree, (None, None), gradients, pose)
        return (*out, _by_c2w(c2w, turned) if pose else torch.zeros_like(c2w))

    @back.register_fake
    def _(mean, log_scale, quaternion, opacity, sh, c2w, camera, options, kernel_degree, by_color, by_transmittance,
          by_depth, pose):
        return tuple(torch.empty_like(p) for p in (mean, log_scale, quaternion, opacity, sh, c2w))

    def setup_context(ctx, inputs, output):
        *tensors, camera, options, kernel_degree, _, _ = inputs
        ctx.save_for_backward(*tensors)
        ctx.arguments = camera, options, kernel_degree
        ctx.set_materialize_grads(False)

    def backward(ctx, *gradients):
        none = ctx.saved_tensors[0].new_empty((0,))
        given = [none if g is None else g for g in gradients]
        return (*back(*ctx.saved_tensors, *ctx.arguments, *given, ctx.needs_input_grad[5]), None, None, None, None, None)

    op.register_autograd(backward, setup_context=setup_context)

    def call(mean, log_scale, quaternion, opacity, sh, c2w, camera, options, kernel_degree, record):
        c2w = torch.from_numpy(camera.c2w) if c2w is None else c2w
        numbers = [float(getattr(options, name)) for name in fields] + [float(b) for b in options.background]
        return op(mean, log_scale, quaternion, opacity, sh, c2w, camera.json(), numbers, kernel_degree, camera.height,
                  camera.width)
    return call


_operators = _make_operators()
