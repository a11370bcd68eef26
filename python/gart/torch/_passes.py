"""The passes forward and backward, without torch's autograd: tensors are lent to renderers that calls share.

Gaussians are six tensors: mean, log_scale, quaternion, opacity, sh, and features [N, F], where F may be 0. What sees them
is a gart.Camera, or rays as (directions, origins or None, t_max or None).
"""
import threading

import torch
from torch.utils.dlpack import to_dlpack as lend  # without __dlpack__'s waits: all work is in torch's current stream

from .. import _gart
from ..errors import InvalidArgument

PARAMETERS = ("mean", "log_scale", "quaternion", "opacity", "sh")
IMAGES = ("color", "transmittance", "depth", "features")


class _Shared:
    """A renderer, and which Gaussians it has."""

    def __init__(self, depth, request):
        self.renderer = _gart.Renderer(depth=depth, **request)
        self.depth = depth
        self.bound = self.bound_features = None
        self.lock = threading.RLock()

    def bind(self, gaussians):
        # Memory that is bound is kept, so that its address is of nothing else.
        *parameters, features = gaussians
        key = [(p.data_ptr(), p.shape) for p in parameters]
        if key != self.bound:
            self.bound = self.bound_features = None
            self.renderer.bind(*map(lend, parameters))
            self.bound = key
        key = (features.data_ptr(), features.shape) if features.shape[1] else None
        if key != self.bound_features:
            self.bound_features = None
            self.renderer.bind_features(lend(features) if key else None)
            self.bound_features = key


_shared = {}
_lock = threading.Lock()


def _shared_for(gaussians, kernel_degree, depth=False):
    """The renderer for such Gaussians; once depth had a gradient, the one that has it."""
    mean = gaussians[0]
    request = {"sh_degree": int(round(gaussians[4].shape[1] ** 0.5)) - 1, "kernel_degree": kernel_degree}
    if mean.is_cuda:
        stream = torch.cuda.current_stream(mean.device).cuda_stream
        request.update(backend="cuda", device=mean.device.index, stream=stream)
    elif mean.device.type == "cpu":
        request.update(backend="openmp")
    else:
        raise InvalidArgument(f"gart.torch: tensors must be on the CPU or on a CUDA device, not on {mean.device}")
    key = tuple(request.items())
    with _lock:
        if key not in _shared or (depth and not _shared[key].depth):
            _shared[key] = _Shared(depth, request)
        return _shared[key]


def release():
    """Gives back the memory of the renderers that calls share."""
    with _lock:
        _shared.clear()


def _is_view(seen):
    return isinstance(seen, _gart.Camera)


def _context(shared, gaussians, seen, options, images={}):
    """A forward pass, into images where they are given: its context."""
    lent = {name: lend(image) for name, image in images.items()}
    shared.bind(gaussians)
    if _is_view(seen):
        return shared.renderer.forward(seen, options, **lent)
    directions, origins, t_max = (None if r is None else lend(r) for r in seen)
    return shared.renderer.forward_rays(directions, origins, t_max, options=options, **lent)


def forward(gaussians, seen, options, kernel_degree, record):
    """The tensors of IMAGES, of features [..., F], and what backward wants where `record` is true."""
    mean, width = gaussians[0], gaussians[5].shape[1]
    shape = (seen.height, seen.width) if _is_view(seen) else (seen[0].shape[0],)
    images = [mean.new_empty(s) for s in ((*shape, 3), shape, shape, (*shape, width))]
    to = dict(zip(IMAGES, images if width else images[:3]))
    shared = _shared_for(gaussians, kernel_degree)
    with shared.lock:
        if record or not _is_view(seen):
            context = _context(shared, gaussians, seen, options, to)
        else:
            context = None
            shared.bind(gaussians)
            shared.renderer.render_to(seen, options, **{name: lend(image) for name, image in to.items()})
    return tuple(images), (shared, context)


def backward(gaussians, seen, options, kernel_degree, kept, gradients, wanted):
    """From dL/d the images, each of them a tensor or None, to dL/d what is wanted, by name: "gaussians" for all five of
    PARAMETERS, "features", "pose" (six numbers), "directions", "origins". kept: of forward, or (None, None)."""
    by = {f"{name}_gradient": g.contiguous() for name, g in zip(IMAGES, gradients) if g is not None and g.numel()}
    shared, context = kept
    # By lists of hits, which features have anyway, or by a renderer that has depth's gradient.
    depth = _is_view(seen) and "features_gradient" not in by and len(by) > ("color_gradient" in by)
    if shared is None or (depth and not shared.depth):
        shared, context = _shared_for(gaussians, kernel_degree, depth), None
    out = {}
    if "gaussians" in wanted:
        out.update((name, torch.empty_like(p)) for name, p in zip(PARAMETERS, gaussians))
    if "features" in wanted and gaussians[5].shape[1]:
        out["features"] = torch.empty_like(gaussians[5])
    if "pose" in wanted:
        out["pose"] = gaussians[0].new_empty(6)
    if not _is_view(seen):
        out.update((name, torch.empty_like(r)) for name, r in zip(("directions", "origins"), seen) if name in wanted)

    def go(context):
        context.backward(**{name: lend(t) for name, t in {**by, **out}.items()})

    with shared.lock:
        try:
            go(context or _context(shared, gaussians, seen, options))
        except InvalidArgument:
            if context is None:
                raise
            go(_context(shared, gaussians, seen, options))  # the renderer has had other Gaussians since
    return out


def placed(camera, c2w):
    """The camera at another pose."""
    out = _gart.Camera.from_json(camera.json())
    out.c2w = c2w.detach().double().cpu().numpy()
    return out


def by_c2w(c2w, turned):
    """dL/d a matrix [4, 4] whose turns by a small w have dL/dw: of all those the one that lies along turns."""
    turned = turned.to(c2w)
    cross = torch.zeros_like(c2w[:3, :3])
    cross[0, 1], cross[0, 2], cross[1, 2] = -turned[5], turned[4], -turned[3]
    out = torch.zeros_like(c2w)
    out[:3, :3] = 0.5 * (cross - cross.T) @ c2w[:3, :3]
    out[:3, 3] = turned[:3]
    return out
