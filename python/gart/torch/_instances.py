"""Models at poses in one world, in torch alone: differentiable by models and poses on any device."""
import functools

import torch

from ..errors import InvalidArgument
from ._rasterization import _rotations


def _bands(d):
    """The functions of math/sh.hpp at unit directions [M, 3], by degree: [M, 1], [M, 3], [M, 5], [M, 7]. A band's common
    factor is left out: its rotation does not know it."""
    x, y, z = d.unbind(-1)
    xx, yy, zz = x * x, y * y, z * z
    third, fifteenth, two_fifths = 3 ** 0.5, 15 ** 0.5, 0.4 ** 0.5
    return (torch.ones_like(x).unsqueeze(-1),
            torch.stack((-y, z, -x), -1),
            torch.stack((x * y, -y * z, (2 * zz - xx - yy) / (2 * third), -x * z, (xx - yy) / 2), -1),
            torch.stack((-y * (3 * xx - yy), 2 * 6 ** 0.5 * x * y * z, -y * (4 * zz - xx - yy) * (0.6 ** 0.5),
                         z * (2 * zz - 3 * xx - 3 * yy) * two_fifths, -x * (4 * zz - xx - yy) * (0.6 ** 0.5),
                         6 ** 0.5 * z * (xx - yy), -x * (xx - 3 * yy)), -1))


@functools.lru_cache(maxsize=None)
def _seen_from():
    """Directions [24, 3] in double, and for each degree the matrix that makes coefficients from values there."""
    k = torch.arange(24, dtype=torch.float64) + 0.5
    z, turn = 1 - k / 12, 2.399963229728653 * k
    d = torch.stack(((1 - z * z).sqrt() * turn.cos(), (1 - z * z).sqrt() * turn.sin(), z), -1)
    return d, [torch.linalg.pinv(band) for band in _bands(d)]


def place(mean, log_scale, quaternion, opacity, sh, rotation, position, scale=1.0):
    """Gaussians of a model as an instance shows them: x of the model is scale * rotation x + position of the world.

    The model as of render; rotation [4], a quaternion (w, x, y, z; any norm), position [3], scale a number or a tensor of
    one, more than 0. Returns five new tensors, differentiable by all inputs. A scene of instances is their concatenation,
    in exact order over all of them:

        parts = [place(*street, still, origin), place(*car, turn, where)]
        color, _, _ = render(*(torch.cat(arrays) for arrays in zip(*parts)), camera)
    """
    if rotation.shape != (4,) or position.shape != (3,):
        raise InvalidArgument(f"gart.torch.place: rotation must be [4] and position [3]; they are {list(rotation.shape)} "
                              f"and {list(position.shape)}")
    degree = int(round(sh.shape[1] ** 0.5)) - 1
    if degree not in (0, 1, 2, 3) or (degree + 1) ** 2 != sh.shape[1]:
        raise InvalidArgument(f"gart.torch.place: sh must have 1, 4, 9 or 16 coefficients a channel, not {sh.shape[1]}")
    turn = _rotations(rotation.double().unsqueeze(0))[0]
    w, x, y, z = (rotation / rotation.norm()).to(mean).unbind(-1)
    by_quaternion = torch.stack((w, -x, -y, -z, x, w, -z, y, y, z, w, -x, z, -y, x, w)).reshape(4, 4)
    scale = torch.as_tensor(scale, dtype=mean.dtype, device=mean.device)
    directions, solve = _seen_from()
    turned = _bands(directions.to(turn.device) @ turn)  # a direction in the model's axes
    bands = [(solve[k].to(turn.device) @ turned[k]).to(sh) @ sh[:, k * k:(k + 1) ** 2] for k in range(1, degree + 1)]
    return (scale * (mean @ turn.to(mean).T) + position.to(mean), log_scale + scale.log(), quaternion @ by_quaternion.T,
            opacity, torch.cat((sh[:, :1], *bands), 1))
