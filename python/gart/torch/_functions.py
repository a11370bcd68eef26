"""render and trace, as functions of torch's autograd."""
import torch

from .. import _gart
from ..errors import InvalidArgument
from . import _operators, _passes


def _once(backward):
    """once_differentiable, which takes time where no graph is made of a backward pass."""
    refusing = torch.autograd.function.once_differentiable(backward)
    return lambda ctx, *gradients: (refusing if torch.is_grad_enabled() else backward)(ctx, *gradients)


def _of_gaussians(needs):
    return needs[0] or needs[1] or needs[2] or needs[3] or needs[4]


class _Render(torch.autograd.Function):
    @staticmethod
    def forward(ctx, mean, log_scale, quaternion, opacity, sh, features, c2w, camera, options, kernel_degree, record):
        gaussians = mean, log_scale, quaternion, opacity, sh, features
        images, kept = _passes.forward(gaussians, camera, options, kernel_degree, record)
        if record:
            ctx.save_for_backward(*gaussians, c2w)
            ctx.rest = camera, options, kernel_degree, kept
            ctx.set_materialize_grads(False)
        return images if features is not None else images[:3]

    @staticmethod
    @_once
    def backward(ctx, *gradients):
        *gaussians, c2w = ctx.saved_tensors
        needs = ctx.needs_input_grad
        wanted = _of_gaussians(needs), needs[5], needs[6], False, False
        *out, turned, _, _ = _passes.backward(gaussians, *ctx.rest, gradients, wanted)
        return (*out, None if turned is None else _passes.by_c2w(c2w, turned), None, None, None, None)


class _Trace(torch.autograd.Function):
    @staticmethod
    def forward(ctx, mean, log_scale, quaternion, opacity, sh, features, directions, origins, t_max, options,
                kernel_degree):
        gaussians, rays = (mean, log_scale, quaternion, opacity, sh, features), (directions, origins, t_max)
        images, kept = _passes.forward(gaussians, rays, options, kernel_degree, True)
        ctx.save_for_backward(*gaussians, *rays)
        ctx.rest = options, kernel_degree, kept
        ctx.set_materialize_grads(False)
        return images if features is not None else images[:3]

    @staticmethod
    @_once
    def backward(ctx, *gradients):
        tensors, needs = ctx.saved_tensors, ctx.needs_input_grad
        wanted = _of_gaussians(needs), needs[5], False, needs[6], needs[7]
        *out, _, directions, origins = _passes.backward(tensors[:6], tensors[6:], *ctx.rest, gradients, wanted)
        return (*out, directions, origins, None, None, None)


def _checked(parameters, features):
    """Tensors of which gart can be lent the memory; the last may be None."""
    tensors = parameters if features is None else (*parameters, features)
    for k, t in enumerate(tensors):
        if t.dtype is not torch.float32:
            raise InvalidArgument(f"gart.torch: {(*_passes.PARAMETERS, 'features')[k]} must be float32, not {t.dtype}")
    if features is not None and (features.dim() != 2 or features.shape[0] != parameters[0].shape[0]):
        raise InvalidArgument(f"gart.torch: features must be [N, F] with the Gaussians' N, {parameters[0].shape[0]}; "
                              f"they are {list(features.shape)}")
    out = [t if t.is_contiguous() else t.contiguous() for t in tensors]
    return out if features is not None else [*out, None]


def render(mean, log_scale, quaternion, opacity, sh, camera, *, features=None, c2w=None, options=None, kernel_degree=2,
           **settings):
    """A view of Gaussians, differentiable by all of them, their features and the pose.

    mean [N, 3], log_scale [N, 3], quaternion [N, 4] (w, x, y, z; any norm), opacity [N] (logits) and sh [N, K, 3], as
    gart.Model has them; features [N, F], 1 to 512 numbers of each, of any sign; camera a gart.Camera, or its json().
    c2w, [4, 4], takes the place of the camera's pose and gets a gradient. options is a gart.RenderOptions; settings are
    its fields by name, as background=(1, 1, 1).

    Returns colour [H, W, 3], transmittance [H, W], depth [H, W] as the sum of weight * distance along the ray, and with
    features their sum [H, W, F] of weight * features.

    torch.compile sees one operator, without a break where the camera is text and options are settings. A camera is a
    constant there: give c2w, so that views share what is compiled.
    """
    gaussians = _checked((mean, log_scale, quaternion, opacity, sh), features)
    # The operator is for compilers: by hand the autograd function costs less a call.
    if _operators.render is not None and torch.compiler.is_compiling():
        text = camera if isinstance(camera, str) else camera.json()
        pose = mean.new_empty((0,)) if c2w is None else c2w
        if gaussians[5] is None:
            gaussians[5] = mean.new_empty((mean.shape[0], 0))  # an operator takes no None in its place
        images = _operators.render(*gaussians, pose, text, _operators.numbers_of(options, settings), kernel_degree)
    else:
        camera = _operators.camera_of(camera) if isinstance(camera, str) else camera
        camera = camera if c2w is None else _passes.placed(camera, c2w)
        options = _gart.RenderOptions(**settings) if options is None else options
        record = torch.is_grad_enabled() and any([t is not None and t.requires_grad for t in (*gaussians, c2w)])
        images = _Render.apply(*gaussians, c2w, camera, options, kernel_degree, record)
    return images[:3] if features is None else images


def trace(mean, log_scale, quaternion, opacity, sh, directions, origins=None, t_max=None, *, features=None, options=None,
          kernel_degree=2, **settings):
    """What rays see that no image has, differentiable by the Gaussians, their features and the rays.

    Gaussians as of render; directions [R, 3], of any length but 0; origins [R, 3], world units, or None: all rays begin
    at the origin; t_max [R], where rays end, or None. options and settings as of render, with antialias 0.

    Returns colour [R, 3], transmittance [R], depth [R] as the sum of weight * distance along the ray, and with features
    their sum [R, F].
    """
    gaussians = _checked((mean, log_scale, quaternion, opacity, sh), features)
    options = _gart.RenderOptions(**settings) if options is None else options
    rays = [None if r is None else r.contiguous() for r in (directions, origins, t_max)]
    images = _Trace.apply(*gaussians, *rays, options, kernel_degree)
    return images[:3] if features is None else images
