"""gart as an operator of torch, on the CPU and on CUDA devices.

``rasterization`` has gsplat's names, so that a program changes one import; ``render`` is one view by gart's own,
``trace`` rays that no image has; ``place`` puts models at poses into one scene. All are differentiable by the Gaussians
and their features, and by the pose or the rays. Tensors are float32 and are not copied; work goes to torch's current
stream. torch is imported with this module, and gart is linked to no torch: any version from 1.12 on will do.

A forward pass keeps what its gradients need until its graph goes. Where other Gaussians were rendered in between, the
backward pass makes it again: gradients are the same, the step takes one forward pass more.
"""
from ._functions import render, trace
from ._instances import place
from ._passes import release
from ._rasterization import rasterization
