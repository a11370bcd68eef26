"""Small scenes, the same in every run."""
import gart
import numpy as np

C2W = np.array([[0.96, 0.0, 0.28, 0.3], [0.0, 1.0, 0.0, -0.2], [-0.28, 0.0, 0.96, -4.0], [0.0, 0.0, 0.0, 1.0]])


def parameters(n=40, degree=1, seed=1):
    """Five float32 arrays in Model's order: Gaussians that overlap, before a camera at C2W."""
    random = np.random.default_rng(seed)
    arrays = (random.normal(0, 0.6, (n, 3)), random.normal(-1.4, 0.3, (n, 3)), random.normal(0, 1, (n, 4)),
              random.normal(0, 1, n), random.normal(0, 0.3, (n, (degree + 1) ** 2, 3)))
    return [np.ascontiguousarray(a, np.float32) for a in arrays]


def model(**kinds):
    return gart.Model(*parameters(**kinds))


def camera(width=40, height=32):
    return gart.Camera(width, height, fx=35.0, fy=36.0, cx=0.5 * width + 1, c2w=C2W)


# Without steps where a Gaussian begins to count: what finite differences need.
SMOOTH = {"alpha_min": 1e-9, "transmittance_min": 0.0, "background": (0.2, 0.5, 0.9)}
