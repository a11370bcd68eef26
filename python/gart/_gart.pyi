"""Types of the compiled part. Docstrings, with shapes and units, are in the module: help(gart.Renderer)."""
import os
from typing import Any, Callable, Dict, List, Optional, Protocol, Sequence, Tuple, TypedDict, Union

import numpy as np
from numpy.typing import NDArray

__version__: str

class _Dlpack(Protocol):
    def __dlpack__(self) -> Any: ...
    def __dlpack_device__(self) -> Tuple[int, int]: ...

Array = Union[NDArray[Any], memoryview, _Dlpack]
Path = Union[str, "os.PathLike[str]"]
Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
Rgb = Tuple[float, float, float]

class Image(TypedDict):
    color: Float32  # [H, W, 3]
    transmittance: Float32  # [H, W]
    depth: Float32  # [H, W]
    hits: NDArray[np.uint32]  # [H, W]

class PoseGradient(TypedDict):
    translation: Float64  # [3]
    rotation: Float64  # [3]

class Gradients(TypedDict, total=False):
    mean: Float32
    log_scale: Float32
    quaternion: Float32
    opacity: Float32
    sh: Float32
    pose: PoseGradient

class ViewScore(TypedDict):
    name: str
    psnr: float
    ssim: float
    milliseconds: float

class Scores(TypedDict):
    psnr: float
    ssim: float
    views: List[ViewScore]

class Camera:
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    def __init__(self, width: int, height: int, fx: float, fy: float, cx: Optional[float] = None,
                 cy: Optional[float] = None, c2w: Any = None, model: str = "PINHOLE", **lens: float) -> None: ...
    @property
    def c2w(self) -> Float64: ...
    @c2w.setter
    def c2w(self, matrix: Any) -> None: ...
    @property
    def model(self) -> str: ...
    @property
    def parameters(self) -> Dict[str, float]: ...
    def resized(self, width: int, height: int) -> Camera: ...
    def json(self) -> str: ...
    @staticmethod
    def from_json(text: str) -> Camera: ...

class Model:
    render: RenderOptions
    def __init__(self, mean: Array, log_scale: Array, quaternion: Array, opacity: Array, sh: Array,
                 kernel_degree: int = 2) -> None: ...
    def __len__(self) -> int: ...
    @property
    def mean(self) -> Float32: ...
    @property
    def log_scale(self) -> Float32: ...
    @property
    def quaternion(self) -> Float32: ...
    @property
    def opacity(self) -> Float32: ...
    @property
    def sh(self) -> Float32: ...
    @property
    def sh_degree(self) -> int: ...
    @property
    def kernel_degree(self) -> int: ...
    @property
    def notes(self) -> List[str]: ...
    def with_sh_degree(self, degree: int) -> Model: ...

def load_model(path: Path) -> Model: ...
def save_model(path: Path, model: Model) -> None: ...

class View:
    def __init__(self, name: str, camera: Camera, image: Array) -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def camera(self) -> Camera: ...
    @property
    def image(self) -> Optional[NDArray[np.uint8]]: ...
    @property
    def mask(self) -> Optional[NDArray[np.uint8]]: ...
    @property
    def depth(self) -> Optional[Float32]: ...

class Dataset:
    def __init__(self, train: Sequence[View], test: Sequence[View] = ..., points: Optional[Array] = None,
                 colors: Optional[Array] = None) -> None: ...
    @property
    def train(self) -> List[View]: ...
    @property
    def test(self) -> List[View]: ...
    @property
    def points(self) -> Float32: ...
    @property
    def colors(self) -> NDArray[np.uint8]: ...
    @property
    def format(self) -> str: ...
    @property
    def split(self) -> str: ...
    @property
    def notes(self) -> List[str]: ...
    @property
    def extent(self) -> float: ...
    @property
    def alpha(self) -> bool: ...

def load_dataset(path: Path, *, downscale: int = 1, test_every: int = 8, test_split: str = "nth",
                 photos: Optional[Path] = None, masks: bool = True, load_images: bool = True, depth: bool = False,
                 progress: Optional[Callable[[int, int], None]] = None) -> Dataset: ...

class RenderOptions:
    alpha_min: float
    transmittance_min: float
    near: float
    max_hits: int
    antialias: float
    rebuild_every: int
    background: Rgb
    def __init__(self, **fields: Any) -> None: ...

class ApproximationOptions:
    alpha_min: float
    transmittance_min: float
    max_hits: int
    antialias: float
    rebuild_every: int
    def __init__(self, **fields: Any) -> None: ...

class ResolutionOptions:
    quarter_until: float
    half_until: float
    least: int
    long_run: int
    def __init__(self, **fields: Any) -> None: ...

class LearningRates:
    mean: float
    mean_final: float
    log_scale: float
    quaternion: float
    opacity: float
    sh_dc: float
    sh_rest: float
    settled: float
    long_run: int
    settle_late: float
    exposure: float
    vignetting: float
    vignetting_final: float
    def __init__(self, **fields: Any) -> None: ...

class AdamOptions:
    sparse: bool
    def __init__(self, **fields: Any) -> None: ...

class PoseOptions:
    warm_up: float
    until: float
    rate: float
    rate_final: float
    damping: float
    damping_final: float
    prior: float
    def __init__(self, **fields: Any) -> None: ...

class LensOptions:
    warm_up: float
    until: float
    rate: float
    rate_final: float
    def __init__(self, **fields: Any) -> None: ...

class SplitShape:
    share: float
    opacity: float
    def __init__(self, **fields: Any) -> None: ...

class ErrorGrowthOptions:
    every: int
    fill: float
    until: float
    dead_opacity: float
    opacity_penalty: float
    split: SplitShape
    pixels_each: float
    least_budget: int
    def __init__(self, **fields: Any) -> None: ...

class McmcOptions:
    every: int
    until: float
    growth: float
    dead_opacity: float
    noise: float
    opacity_penalty: float
    scale_penalty: float
    def __init__(self, **fields: Any) -> None: ...

class AdcOptions:
    every: int
    opacity_reset_every: int
    until: float
    gradient: float
    dense: float
    prune_opacity: float
    def __init__(self, **fields: Any) -> None: ...

class TrainOptions:
    iterations: int
    max_gaussians: int
    random_points: int
    densify: str  # "error", "mcmc", "adc", "none"
    sh_every: int
    held_out: List[int]
    background: str  # "white", "black", "random"
    initial_opacity: float
    initial_scale: float
    ssim_weight: float
    dropout: float
    dropout_until: float
    depth_weight: float
    exposure: bool
    vignetting: bool
    refine_poses: bool
    refine_lens: bool
    lt_budget: int
    check_finite: bool
    batch: int
    seed: int
    near: float
    resolution: ResolutionOptions
    render: ApproximationOptions
    rates: LearningRates
    adam: AdamOptions
    poses: PoseOptions
    lens: LensOptions
    error: ErrorGrowthOptions
    mcmc: McmcOptions
    adc: AdcOptions
    def __init__(self, **fields: Any) -> None: ...

class Renderer:
    def __init__(self, model: Optional[Model] = None, *, backend: str = "auto", tracer: str = "auto",
                 backward: str = "auto", sh_degree: int = 3, kernel_degree: int = 2, lt_format: str = "auto",
                 depth: bool = False, threads: int = 0, device: int = 0, stream: Optional[int] = None) -> None: ...
    def __len__(self) -> int: ...
    def set_model(self, model: Model) -> None: ...
    def bind(self, mean: Array, log_scale: Array, quaternion: Array, opacity: Array, sh: Array) -> None: ...
    def render(self, camera: Camera, options: Optional[RenderOptions] = None, **settings: Any) -> Image: ...
    def render_8bit(self, camera: Camera, options: Optional[RenderOptions] = None,
                    **settings: Any) -> NDArray[np.uint8]: ...
    def render_to(self, camera: Camera, options: Optional[RenderOptions] = None, *, color: Optional[Array] = None,
                  transmittance: Optional[Array] = None, depth: Optional[Array] = None, hits: Optional[Array] = None,
                  rgba: Optional[Array] = None, **settings: Any) -> None: ...
    def record(self, camera: Camera, options: Optional[RenderOptions] = None, *, color: Optional[Array] = None,
               transmittance: Optional[Array] = None, depth: Optional[Array] = None, hits: Optional[Array] = None,
               rgba: Optional[Array] = None, **settings: Any) -> None: ...
    def backward_to(self, color_gradient: Array, mean: Array, log_scale: Array, quaternion: Array, opacity: Array,
                    sh: Array, *, depth_gradient: Optional[Array] = None,
                    transmittance_gradient: Optional[Array] = None, pose: Optional[Array] = None) -> None: ...
    def backward(self, camera: Camera, color_gradient: Array, options: Optional[RenderOptions] = None, *,
                 pose: bool = False, **settings: Any) -> Gradients: ...
    def pose_gradient(self) -> PoseGradient: ...
    def wait(self) -> None: ...
    def profile(self, enable: bool = True) -> Dict[str, Tuple[float, int]]: ...
    @property
    def configuration(self) -> Dict[str, Any]: ...
    @property
    def peak_bytes(self) -> int: ...

class StepReport:
    step: int
    loss: float
    psnr: float
    gaussians: int
    view: str
    backward: str
    skipped: int

class Session:
    def __init__(self, dataset: Dataset, options: Optional[TrainOptions] = None, start: Optional[Model] = None,
                 **request: Any) -> None: ...
    def __len__(self) -> int: ...
    def step(self, steps: int = 1) -> StepReport: ...
    @property
    def steps_done(self) -> int: ...
    def set_iterations(self, iterations: int) -> None: ...
    def model(self) -> Model: ...
    def save_model(self, path: Path) -> None: ...
    def save(self, path: Path) -> None: ...
    def load(self, path: Path) -> None: ...
    def render(self, camera: Camera, background: Rgb = ...) -> Image: ...
    def evaluate(self, test: bool = True, background: Rgb = ...) -> Scores: ...
    def cameras(self) -> List[Tuple[str, Camera]]: ...
    @property
    def options(self) -> TrainOptions: ...
    @property
    def dataset(self) -> Dataset: ...
    @property
    def configuration(self) -> Dict[str, Any]: ...
    @property
    def peak_bytes(self) -> int: ...

def track(renderer: Renderer, photo: Array, guess: Camera, options: Optional[RenderOptions] = None, *, steps: int = 60,
          blur: float = 0.05, mask: Optional[Array] = None, **settings: Any) -> Tuple[Camera, List[float]]: ...
def evaluate(renderer: Renderer, views: Sequence[View], options: Optional[RenderOptions] = None,
             **settings: Any) -> Scores: ...
def recommended(dataset: Dataset, options: Optional[TrainOptions] = None,
                **request: Any) -> Tuple[TrainOptions, Dict[str, Any]]: ...
def reference(model: Model, camera: Camera, color_gradient: Optional[Float64] = None,
              depth_gradient: Optional[Float64] = None, options: Optional[RenderOptions] = None,
              **settings: Any) -> Dict[str, Any]: ...
def resolve(**request: Any) -> Dict[str, Any]: ...
def configurations() -> List[Dict[str, Any]]: ...
