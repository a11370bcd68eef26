"""gart::render and gart::render_backward, where torch has torch.library.custom_op (2.4): what torch.compile sees whole.

The camera is text and options are numbers, because an operator takes nothing else. A c2w without numbers stands for none,
and so do features.
"""
import functools
from typing import List, Tuple

import torch

from .. import _gart
from ..errors import InvalidArgument
from . import _passes

_usual = _gart.RenderOptions()
_FIELDS = ("alpha_min", "transmittance_min", "near", "max_hits", "antialias", "rebuild_every")
_WHOLE = ("max_hits", "rebuild_every")
_USUAL = {**{name: getattr(_usual, name) for name in _FIELDS}, "background": tuple(_usual.background)}


def numbers_of(options, settings):
    """Options as numbers; where settings alone are given, in Python that torch.compile sees through."""
    if options is not None:
        settings = {name: getattr(options, name) for name in _USUAL}
    for name in settings:
        if name not in _USUAL:
            raise TypeError(f"gart.torch: no option '{name}': there are {', '.join(_USUAL)}")
    of = {**_USUAL, **settings}
    return [float(of[name]) for name in _FIELDS] + [float(b) for b in of["background"]]


def _options_of(numbers):
    named = {name: int(value) if name in _WHOLE else value for name, value in zip(_FIELDS, numbers)}
    return _gart.RenderOptions(background=tuple(numbers[len(_FIELDS):]), **named)


@functools.lru_cache(maxsize=4096)
def camera_of(text):
    return _gart.Camera.from_json(text)


def make(library):
    """The operator of such a torch.library."""
    Tensor = torch.Tensor

    def plain(*gaussians):
        return [t.contiguous() if t.numel() or k < 5 else None for k, t in enumerate(gaussians)]

    def seen_by(camera, c2w):
        view = camera_of(camera)
        return _passes.placed(view, c2w) if c2w.numel() else view

    @library.custom_op("gart::render", mutates_args=())
    def render(mean: Tensor, log_scale: Tensor, quaternion: Tensor, opacity: Tensor, sh: Tensor, features: Tensor,
               c2w: Tensor, camera: str, options: List[float],
               kernel_degree: int) -> Tuple[Tensor, Tensor, Tensor, Tensor]:
        gaussians, view = plain(mean, log_scale, quaternion, opacity, sh, features), seen_by(camera, c2w)
        *images, wide = _passes.forward(gaussians, view, _options_of(options), kernel_degree, False)[0]
        return (*images, mean.new_empty((view.height, view.width, 0)) if wide is None else wide)

    @render.register_fake
    def _(mean, log_scale, quaternion, opacity, sh, features, c2w, camera, options, kernel_degree):
        view = camera_of(camera)
        shape = (view.height, view.width)
        return (mean.new_empty((*shape, 3)), mean.new_empty(shape), mean.new_empty(shape),
                mean.new_empty((*shape, features.shape[1])))

    @library.custom_op("gart::render_backward", mutates_args=())
    def back(mean: Tensor, log_scale: Tensor, quaternion: Tensor, opacity: Tensor, sh: Tensor, features: Tensor,
             c2w: Tensor, camera: str, options: List[float], kernel_degree: int, by_color: Tensor,
             by_transmittance: Tensor, by_depth: Tensor,
             by_features: Tensor) -> Tuple[Tensor, Tensor, Tensor, Tensor, Tensor, Tensor, Tensor]:
        gaussians = plain(mean, log_scale, quaternion, opacity, sh, features)
        view = seen_by(camera, c2w)
        for g, channels in ((by_color, (3,)), (by_transmittance, ()), (by_depth, ()), (by_features, features.shape[1:])):
            if g.numel() and (g.shape, g.dtype, g.device) != ((view.height, view.width, *channels), mean.dtype, mean.device):
                raise InvalidArgument(f"gart::render_backward: gradients must be of the images' shapes, type and device; "
                                      f"one is {g.dtype} {list(g.shape)} on {g.device}")
        *out, turned, _, _ = _passes.backward(gaussians, view, _options_of(options), kernel_degree, (None, None),
                                              (by_color, by_transmittance, by_depth, by_features),
                                              (True, True, c2w.numel() > 0, False, False))
        out[5] = torch.empty_like(features) if out[5] is None else out[5]
        return (*out, torch.empty_like(c2w) if turned is None else _passes.by_c2w(c2w.contiguous(), turned))

    @back.register_fake
    def _(mean, log_scale, quaternion, opacity, sh, features, c2w, camera, options, kernel_degree, by_color,
          by_transmittance, by_depth, by_features):
        tensors = (mean, log_scale, quaternion, opacity, sh, features, c2w)
        return tuple(torch.empty_like(t, memory_format=torch.contiguous_format) for t in tensors)

    def setup_context(ctx, inputs, output):
        *tensors, camera, options, kernel_degree = inputs
        ctx.save_for_backward(*tensors)
        ctx.arguments = camera, options, kernel_degree
        ctx.set_materialize_grads(False)

    def backward(ctx, *gradients):
        none = ctx.saved_tensors[0].new_empty((0,))
        by = back(*ctx.saved_tensors, *ctx.arguments, *(none if g is None else g for g in gradients))
        return (*by, None, None, None)

    render.register_autograd(backward, setup_context=setup_context)
    return render


render = make(torch.library) if hasattr(torch.library, "custom_op") else None
