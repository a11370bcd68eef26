"""The passes forward and backward, without torch's autograd: tensors are lent to renderers that calls share.

Gaussians are six tensors: mean, log_scale, quaternion, opacity, sh, and features [N, F] or None. What sees them is a
gart.Camera, or rays as (directions, origins or None, t_max or None). Tensors that are made here are lent by their address.
"""
import copy
import threading

import torch
from torch.utils.dlpack import to_dlpack as lend  # without __dlpack__'s waits: all work is in torch's current stream

from .. import _gart
from ..errors import InvalidArgument

PARAMETERS = ("mean", "log_scale", "quaternion", "opacity", "sh")
TARGETS = (*PARAMETERS, "features", "pose", "directions", "origins")  # of a backward pass


class _Shared:
    """A renderer, and which Gaussians it has."""

    def __init__(self, depth, request):
        self.renderer = _gart.Renderer(depth=depth, **request)
        self.depth = depth
        self.bound = self.bound_features = None
        self.lock = threading.RLock()

    def bind(self, gaussians):
        # Memory that is bound is kept, so that its address is of nothing else.
        mean, log_scale, quaternion, opacity, sh, features = gaussians
        key = (mean.data_ptr(), log_scale.data_ptr(), quaternion.data_ptr(), opacity.data_ptr(), sh.data_ptr(),
               mean.shape, log_scale.shape, quaternion.shape, opacity.shape, sh.shape)
        if key != self.bound:
            self.bound = self.bound_features = None
            self.renderer.bind(*(lend(p.detach()) for p in gaussians[:5]))
            self.bound = key
        key = None if features is None else (features.data_ptr(), features.shape)
        if key != self.bound_features:
            self.bound_features = None
            self.renderer.bind_features(None if features is None else lend(features.detach()))
            self.bound_features = key


_shared = {}
_lock = threading.Lock()
_stream_of = getattr(torch._C, "_cuda_getCurrentRawStream",
                     lambda index: torch.cuda.current_stream(index).cuda_stream)


def _shared_for(gaussians, kernel_degree, depth=False):
    """The renderer for such Gaussians; once depth had a gradient, the one that has it."""
    mean, coefficients = gaussians[0], gaussians[4].shape[1]
    place = None
    if mean.is_cuda:
        index = mean.get_device()
        place = index, _stream_of(index)
    elif mean.device.type != "cpu":
        raise InvalidArgument(f"gart.torch: tensors must be on the CPU or on a CUDA device, not on {mean.device}")
    key = coefficients, kernel_degree, place
    shared = _shared.get(key)
    if shared is None or (depth and not shared.depth):
        request = {"sh_degree": int(round(coefficients ** 0.5)) - 1, "kernel_degree": kernel_degree}
        request.update({"backend": "openmp"} if place is None else
                       {"backend": "cuda", "device": place[0], "stream": place[1]})
        with _lock:
            shared = _shared.get(key)
            if shared is None or (depth and not shared.depth):
                shared = _shared[key] = _Shared(depth, request)
    return shared


def release():
    """Gives back the memory of the renderers that calls share."""
    with _lock:
        _shared.clear()


def _addresses(tensors):
    return [0 if t is None else t.data_ptr() for t in tensors]


def _context(shared, gaussians, seen, options, images=(None,) * 4, record=True):
    """A forward pass, into images where they are given: its context."""
    shared.bind(gaussians)
    if isinstance(seen, _gart.Camera):
        return shared.renderer._forward_at(seen, options, _addresses(images), record)
    directions, origins, t_max = (None if r is None else lend(r.detach()) for r in seen)
    color, transmittance, depth, features = (None if i is None else lend(i) for i in images)
    return shared.renderer.forward_rays(directions, origins, t_max, options=options, color=color,
                                        transmittance=transmittance, depth=depth, features=features)


def forward(gaussians, seen, options, kernel_degree, record):
    """Colour, transmittance, depth and features [..., F] or None, and what backward wants where `record` is true."""
    make, features = gaussians[0].new_empty, gaussians[5]
    shape = (seen.height, seen.width) if isinstance(seen, _gart.Camera) else (seen[0].shape[0],)
    images = (make((*shape, 3)), make(shape), make(shape),
              None if features is None else make((*shape, features.shape[1])))
    shared = _shared_for(gaussians, kernel_degree)
    with shared.lock:
        return images, (shared, _context(shared, gaussians, seen, options, images, record))


def backward(gaussians, seen, options, kernel_degree, kept, gradients, wanted):
    """From dL/d the images, each of them a tensor or None, to dL/d what is wanted, as tensors or None in the order
    of TARGETS. wanted: whether the Gaussians, features, the pose, directions, origins are. kept: of forward, or
    (None, None)."""
    by = [None if g is None or not g.numel() else g.contiguous() for g in gradients]
    by += [None] * (4 - len(by))
    shared, context = kept
    is_view = isinstance(seen, _gart.Camera)
    # By lists of hits, which features have anyway, or by a renderer that has depth's gradient.
    depth = is_view and by[3] is None and not (by[1] is None and by[2] is None)
    if shared is None or (depth and not shared.depth):
        shared, context = _shared_for(gaussians, kernel_degree, depth), None
    make = torch.empty_like
    out = [make(p) for p in gaussians[:5]] if wanted[0] else [None] * 5
    out += (make(gaussians[5]) if wanted[1] and gaussians[5] is not None else None,
            gaussians[0].new_empty(6) if wanted[2] else None,
            make(seen[0]) if wanted[3] else None, make(seen[1]) if wanted[4] else None)
    from_, to = _addresses(by), _addresses(out)
    with shared.lock:
        try:
            (context or _context(shared, gaussians, seen, options))._backward_at(from_, to)
        except InvalidArgument:
            if context is None:
                raise
            # The renderer has had other Gaussians since.
            _context(shared, gaussians, seen, options)._backward_at(from_, to)
    return out


def placed(camera, c2w):
    """The camera at another pose."""
    out = copy.copy(camera)
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
