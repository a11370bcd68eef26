"""gart as a function of JAX, in host memory: differentiable by the Gaussians, under jit too.

jax is imported with this module. Arrays of JAX on the CPU are lent by the buffer protocol or DLPack; from a device they
come as JAX's callbacks bring them.
"""
import threading

import jax
import numpy as np

from . import _gart

_PARAMETERS = ("mean", "log_scale", "quaternion", "opacity", "sh")
_IMAGES = ("color", "transmittance", "depth")
_renderers = {}
_lock = threading.RLock()


def _bound(arrays, kernel_degree):
    """A renderer that has these Gaussians; the caller holds the lock."""
    plain = [np.ascontiguousarray(a, np.float32) for a in arrays]
    key = plain[4].shape[1], kernel_degree
    if key not in _renderers:
        degree = int(round(key[0] ** 0.5)) - 1
        _renderers[key] = _gart.Renderer(backend="openmp", sh_degree=degree, kernel_degree=kernel_degree)
    _renderers[key].bind(*plain)
    return _renderers[key], plain


def render(mean, log_scale, quaternion, opacity, sh, camera, *, options=None, kernel_degree=2, **settings):
    """A view of Gaussians: colour [H, W, 3], transmittance [H, W], and depth [H, W] as gart.torch.render has them.

    mean [N, 3], log_scale [N, 3], quaternion [N, 4], opacity [N] and sh [N, K, 3], float32, as gart.Model has them; camera a
    gart.Camera, a constant under jit; options a gart.RenderOptions, settings its fields by name.
    """
    options = _gart.RenderOptions(**settings) if options is None else options
    gaussians = mean, log_scale, quaternion, opacity, sh
    shape = camera.height, camera.width
    images = tuple(jax.ShapeDtypeStruct(s, np.float32) for s in ((*shape, 3), shape, shape))
    gradients = tuple(jax.ShapeDtypeStruct(a.shape, np.float32) for a in gaussians)

    def see(*arrays):
        with _lock:
            renderer, _ = _bound(arrays, kernel_degree)
            seen = renderer.render(camera, options)
        return tuple(seen[name] for name in _IMAGES)

    def pull(by, *arrays):
        # JAX has zeros where there is no gradient. Depth's costs lists of hits.
        by = {f"{name}_gradient": np.ascontiguousarray(g, np.float32) for name, g in zip(_IMAGES, by)}
        by = {name: g for name, g in by.items() if g.any()}
        with _lock:
            renderer, plain = _bound(arrays, kernel_degree)
            out = {name: np.empty_like(a) for name, a in zip(_PARAMETERS, plain)}
            renderer.forward(camera, options).backward(**by, **out)
        return tuple(out.values())

    @jax.custom_vjp
    def view(*arrays):
        return jax.pure_callback(see, images, *arrays)

    view.defvjp(lambda *arrays: (view(*arrays), arrays),
                lambda arrays, by: jax.pure_callback(pull, gradients, by, *arrays))
    return view(*gaussians)
