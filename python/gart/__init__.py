"""Training and rendering of ray-traced 3D Gaussians.

    import gart
    model = gart.load_model("scene.ply")
    renderer = gart.Renderer(model)
    image = renderer.render(gart.Camera(640, 480, fx=500, fy=500))["color"]    # numpy, float32 [480, 640, 3]

``gart.torch`` has the same as an operator of torch. Arrays of other libraries are taken by the buffer protocol or by
DLPack and are not copied.
"""
from ._gart import *
from ._gart import __version__
from .errors import Error, InvalidArgument, IoError, NotFinite, OutOfMemory, Unsupported
from .training import train
