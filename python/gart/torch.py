"""gart as an operator of torch, on the CPU and on CUDA devices.

``rasterization`` has gsplat's names, so that a program changes one import; ``render`` is one view by gart's own. Both are
differentiable by the Gaussians and by the pose. Tensors are float32 and are not copied; work goes to torch's current
stream. torch is imported with this module, and gart is linked to no torch: any version from 1.12 on will do.

A forward pass leaves what its gradients need in a renderer that calls share. Where another view comes in between, the
backward pass renders its own again: gradients are the same, the step takes one forward pass more.
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
    """A renderer, and which image it holds what gradients need of."""

    def __init__(self, depth, request):
        self.renderer = _gart.Renderer(depth=depth, **request)
        self.depth = depth
        self.recorded = None
        self.lock = threading.RLock()


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


def _forward(parameters, camera, options, kernel_degree, record):
    """Colour, transmittance and depth of a view, recorded where gradients will be asked for."""
    mean, sh = parameters[0], parameters[4]
    shape = (camera.height, camera.width)
    color = mean.new_empty((*shape, 3))
    transmittance, depth = mean.new_empty(shape), mean.new_empty(shape)
    shared = _shared_of(mean, _degree_of(sh), kernel_degree)
    with shared.lock:
        shared.renderer.bind(*map(_lend, parameters))
        go = shared.renderer.record if record else shared.renderer.render_to
        shared.recorded = None
        go(camera, options, color=_lend(color), transmittance=_lend(transmittance), depth=_lend(depth))
        if record:
            shared.recorded = color.data_ptr()
    return color, transmittance, depth


def _backward(parameters, camera, options, kernel_degree, color, gradients, pose):
    """dL/d the parameters, and by the pose where it is asked for: its position, and a small turn about it."""
    by_color, by_transmittance, by_depth = gradients
    of_depth = by_transmittance is not None or by_depth is not None
    mean, sh = parameters[0], parameters[4]
    shared = _shared_of(mean, _degree_of(sh), kernel_degree, of_depth)
    out = [torch.empty_like(p) for p in parameters]
    with shared.lock:
        if shared.recorded is None or shared.recorded != color.data_ptr():
            shared.renderer.bind(*map(_lend, parameters))
            shared.recorded = None
            shared.renderer.record(camera, options)
        by_color = torch.zeros_like(color) if by_color is None else by_color
        more = {}
        if by_transmittance is not None:
            more["transmittance_gradient"] = _lend(by_transmittance.contiguous())
        if by_depth is not None:
            more["depth_gradient"] = _lend(by_depth.contiguous())
        turned = mean.new_empty(6) if pose else None
        if pose:
            more["pose"] = _lend(turned)
        shared.renderer.backward_to(_lend(by_color.contiguous()), *map(_lend, out), **more)
    return (*out, turned[:3], turned[3:]) if pose else (*out, None, None)


def _by_c2w(c2w, translation, rotation):
    """dL/d a matrix [4, 4] whose turns by a small w have dL/dw: of all those the one that lies along turns."""
    g = rotation.to(c2w)
    cross = torch.zeros_like(c2w[:3, :3])
    cross[0, 1], cross[0, 2], cross[1, 2] = -g[2], g[1], -g[0]
    out = torch.zeros_like(c2w)
    out[:3, :3] = 0.5 * (cross - cross.T) @ c2w[:3, :3]
    out[:3, 3] = translation.to(c2w)
    return out


class _Render(torch.autograd.Function):
    @staticmethod
    def forward(ctx, mean, log_scale, quaternion, opacity, sh, c2w, camera, options, kernel_degree, record):
        parameters = [p.detach() for p in (mean, log_scale, quaternion, opacity, sh)]
        images = _forward(parameters, camera, options, kernel_degree, record)
        if record:
            ctx.save_for_backward(mean, log_scale, quaternion, opacity, sh, c2w, images[0])
            ctx.camera, ctx.options, ctx.kernel_degree = camera, options, kernel_degree
            ctx.set_materialize_grads(False)
        return images

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx, *gradients):
        *parameters, c2w, color = ctx.saved_tensors
        pose = ctx.needs_input_grad[5]
        parameters = [p.detach() for p in parameters]
        *out, translation, rotation = _backward(parameters, ctx.camera, ctx.options, ctx.kernel_degree, color,
                                                gradients, pose)
        by_pose = _by_c2w(c2w, translation, rotation) if pose else None
        return (*out, by_pose, None, None, None, None)


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
    "RGB+D" or "RGB+ED". Gradients are those of means, quats, scales, opacities, colors, viewmats and backgrounds.

    What is otherwise than there: near_plane is along the ray; depth is that of the point of largest response on the ray,
    where gsplat has the centre's; "antialiased" widens by the filter of math/widened.hpp. far_plane and radius_clip
    must be without effect, and what shows how tiles are kept (packed, tile_size, channel_chunk, segmented, sparse_grad)
    has none. There is no image of means, so that strategies that read means2d or radii have nothing to go by:
    gsplat's MCMCStrategy, which reads none, works.
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
    images, alphas = [], []
    for view in range(views):
        fx, fy, cx, cy = numbers[view]
        camera = _gart.Camera(width, height, fx, fy, cx, cy, model=_MODELS[camera_model], **lens)
        learned = poses[view] if viewmats.requires_grad else None
        if learned is None:
            camera.c2w = poses[view].numpy()
        color, channels = _coefficients(colors, view, n, sh_degree)
        parts = []
        for first in range(0, channels, 3):
            wide = min(3, channels - first)
            back = [*behind[view][first:first + wide], 0.0, 0.0][:3]
            image, transmittance, depth = render(means, log_scale, quats, opacity, color(first), camera, c2w=learned,
                                                 near=near_plane, antialias=filter_width, background=back)
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
    meta = {"width": width, "height": height, "n_cameras": views}
    return torch.stack(images), torch.stack(alphas), meta


def _inverted(viewmats):
    """World to camera, [C, 4, 4], as camera to world; in double, since a pose may lie far from the origin."""
    rotation = viewmats[:, :3, :3].double().transpose(1, 2)
    position = -(rotation @ viewmats[:, :3, 3:].double())
    last = torch.tensor([0.0, 0.0, 0.0, 1.0], dtype=torch.float64, device=viewmats.device).expand(len(viewmats), 1, 4)
    return torch.cat((torch.cat((rotation, position), 2), last), 1)


def _coefficients(colors, view, n, sh_degree):
    """Coefficients of three channels, by the first of them, and how many channels there are."""
    if sh_degree is not None:
        of_view = colors if colors.dim() == 3 else colors[view]
        return (lambda first: of_view[:, :(sh_degree + 1) ** 2]), 3
    of_view = colors if colors.dim() == 2 else colors[view]
    if of_view.shape[0] != n:
        raise InvalidArgument("gart.torch.rasterization: colors must be [N, D] or [C, N, D]; [N, K, 3] needs sh_degree")
    channels = of_view.shape[1]
    if channels != 3 and bool((of_view < 0).any()):
        raise InvalidArgument("gart.torch.rasterization: features must be at least 0: shift them")

    def three(first):
        part = of_view[:, first:first + 3]
        part = torch.nn.functional.pad(part, (0, 3 - part.shape[1])) if part.shape[1] < 3 else part
        return ((part - 0.5) / _SH0).unsqueeze(1)
    return three, channels


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
           options: List[float], kernel_degree: int, record: bool, height: int,
           width: int) -> Tuple[Tensor, Tensor, Tensor]:
        return _forward([mean, log_scale, quaternion, opacity, sh], _camera_of(camera), unpacked(options),
                        kernel_degree, record)

    @op.register_fake
    def _(mean, log_scale, quaternion, opacity, sh, c2w, camera, options, kernel_degree, record, height, width):
        return mean.new_empty((height, width, 3)), mean.new_empty((height, width)), mean.new_empty((height, width))

    @torch.library.custom_op("gart::render_backward", mutates_args=())
    def back(mean: Tensor, log_scale: Tensor, quaternion: Tensor, opacity: Tensor, sh: Tensor, c2w: Tensor, camera: str,
             options: List[float], kernel_degree: int, color: Tensor, by_color: Tensor, by_transmittance: Tensor,
             by_depth: Tensor, pose: bool) -> Tuple[Tensor, Tensor, Tensor, Tensor, Tensor, Tensor]:
        gradients = [g if g.numel() else None for g in (by_color, by_transmittance, by_depth)]
        *out, translation, rotation = _backward([mean, log_scale, quaternion, opacity, sh], _camera_of(camera),
                                                unpacked(options), kernel_degree, color, gradients, pose)
        return (*out, _by_c2w(c2w, translation, rotation) if pose else torch.zeros_like(c2w))

    @back.register_fake
    def _(mean, log_scale, quaternion, opacity, sh, c2w, camera, options, kernel_degree, color, by_color,
          by_transmittance, by_depth, pose):
        return tuple(torch.empty_like(p) for p in (mean, log_scale, quaternion, opacity, sh, c2w))

    def setup_context(ctx, inputs, output):
        *tensors, camera, options, kernel_degree, _, _, _ = inputs
        ctx.save_for_backward(*tensors, output[0])
        ctx.arguments = camera, options, kernel_degree
        ctx.set_materialize_grads(False)

    def backward(ctx, by_color, by_transmittance, by_depth):
        *tensors, color = ctx.saved_tensors
        none = color.new_empty((0,))
        given = [none if g is None else g for g in (by_color, by_transmittance, by_depth)]
        out = back(*tensors, *ctx.arguments, color, *given, ctx.needs_input_grad[5])
        return (*out, None, None, None, None, None, None)

    op.register_autograd(backward, setup_context=setup_context)

    def call(mean, log_scale, quaternion, opacity, sh, c2w, camera, options, kernel_degree, record):
        c2w = torch.from_numpy(camera.c2w) if c2w is None else c2w
        numbers = [float(getattr(options, name)) for name in fields] + [float(b) for b in options.background]
        return op(mean, log_scale, quaternion, opacity, sh, c2w, camera.json(), numbers, kernel_degree, record,
                  camera.height, camera.width)
    return call


_operators = _make_operators()
