"""Trains a capture in torch by gart's operator: python3 train_lego.py CAPTURE [STEPS [MODEL.ply]]."""
import sys

import gart
import gart.torch
import torch

steps = int(sys.argv[2]) if len(sys.argv) > 2 else 2000
device = "cuda" if torch.cuda.is_available() and gart.resolve()["backend"] == "cuda" else "cpu"
data = gart.load_dataset(sys.argv[1], downscale=1 if device == "cuda" else 4)
white = {"background": (1.0, 1.0, 1.0)}


def photo(view):
    pixels = torch.from_numpy(view.image).to(device).float() / 255
    return pixels[..., :3] * pixels[..., 3:] + 1 - pixels[..., 3:] if pixels.shape[2] == 4 else pixels


torch.manual_seed(1)
n = 100_000 if device == "cuda" else 10_000
start = {  # the arrays of gart.Model, and Adam's rate of each
    "mean": (torch.rand(n, 3) * 2.6 - 1.3, 2e-3),
    "log_scale": (torch.full((n, 3), 2.6 / n ** (1 / 3) / 3).log(), 5e-3),
    "quaternion": (torch.tensor([1.0, 0.0, 0.0, 0.0]).repeat(n, 1), 1e-3),
    "opacity": (torch.full((n,), -2.2), 5e-2),
    "sh": (torch.cat((torch.rand(n, 1, 3) - 0.5, torch.zeros(n, 3, 3)), 1), 5e-3),
}
gaussians = [values.to(device).requires_grad_() for values, _ in start.values()]
adam = torch.optim.Adam([{"params": [p], "lr": rate} for p, (_, rate) in zip(gaussians, start.values())], eps=1e-15)
for step in range(steps + 1):
    if step % max(steps // 10, 1) == 0:
        model = gart.Model(*[p.detach().cpu() for p in gaussians])
        print(f"step {step}: test PSNR {gart.evaluate(gart.Renderer(model), data.test[::20], **white)['psnr']:.2f} dB", flush=True)
    view = data.train[int(torch.randint(len(data.train), ()))]
    image, transmittance, depth = gart.torch.render(*gaussians, view.camera, **white)
    adam.zero_grad()
    (image - photo(view)).abs().mean().backward()
    adam.step()
gart.save_model(sys.argv[3] if len(sys.argv) > 3 else "model.ply", model)
