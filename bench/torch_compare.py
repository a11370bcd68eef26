#!/usr/bin/env python3
"""Trains and times Gaussians in torch by gart's operator and, where it is installed, by gsplat's, in one process.

usage: torch_compare.py --out FILE.json [--capture DIR] [--scene FILE.ply] [--steps N] [--gaussians N] [--seconds N]

--capture  the loop of examples/python/train_lego.py, once by each: the same start, views, loss and Adam. A step's time, and
           the test views' PSNR, each by what trained it.
--scene    a million Gaussians or so, with FILE.json beside it (docs/performance.md): a forward pass, and forward and
           backward, mean of cameras 0..3; what a call of gart.torch costs beyond its renderer, and with one Gaussian, where
           little else is to do; whether tensors are copied; memory over 1,000 calls.

A part that fails leaves its error in the file. --seconds bounds each training; what was done until then is told.
"""
import argparse
import importlib.util
import json
import os
import resource
import statistics
import time
import traceback

import gart
import gart.torch
import numpy as np
import torch
from common import command_line, commit_of, machine, now
from gart.torch import _passes

NAMES = ("mean", "log_scale", "quaternion", "opacity", "sh")


class View:
    """A camera as gart has it and as gsplat has it, and its photograph on white."""

    def __init__(self, camera, device, image=None):
        self.camera, self.photo = camera, None
        self.w2c = torch.from_numpy(np.linalg.inv(camera.c2w)).float()[None].to(device)
        self.k = torch.tensor([[[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]]], device=device)
        if image is not None:
            pixels = torch.from_numpy(np.array(image)).to(device).float() / 255
            alpha = pixels[..., 3:] if pixels.shape[2] == 4 else torch.ones_like(pixels[..., :1])
            self.photo = pixels[..., :3] * alpha + 1 - alpha


def by_rasterization(rasterization):
    """gsplat's function, called as a training program does: what is learned are logarithms and logits."""
    def show(gaussians, view, background):
        mean, log_scale, quaternion, opacity, sh = gaussians
        degree = int(round(sh.shape[1] ** 0.5)) - 1
        colors, _, _ = rasterization(mean, quaternion, log_scale.exp(), torch.sigmoid(opacity), sh, view.w2c, view.k,
                                     view.camera.width, view.camera.height, sh_degree=degree, packed=False,
                                     backgrounds=torch.full((1, 3), background, device=mean.device))
        return colors[0]
    return show


def by_render(gaussians, view, background):
    return gart.torch.render(*gaussians, view.camera, background=(background,) * 3)[0]


def operators():
    out = {"gart.torch.render": by_render, "gart.torch.rasterization": by_rasterization(gart.torch.rasterization)}
    if importlib.util.find_spec("gsplat"):
        import gsplat
        out["gsplat.rasterization"] = by_rasterization(gsplat.rasterization)
    return out


def synchronize(device):
    if device == "cuda":
        torch.cuda.synchronize()


def clock(device, call, times):
    """Milliseconds of a call among so many, one after the other."""
    synchronize(device)
    begin = time.perf_counter()
    for _ in range(times):
        call()
    synchronize(device)
    return 1e3 * (time.perf_counter() - begin) / times


@torch.no_grad()
def psnr(show, gaussians, views):
    errors = [(show(gaussians, v, 1.0).clamp(0, 1) - v.photo).square().mean() for v in views]
    return float(torch.stack([-10 * e.log10() for e in errors]).mean())


def start(n, device):
    """That of examples/python/train_lego.py, and Adam's rates."""
    torch.manual_seed(1)
    values = {"mean": (torch.rand(n, 3) * 2.6 - 1.3, 2e-3),
              "log_scale": (torch.full((n, 3), 2.6 / n ** (1 / 3) / 3).log(), 5e-3),
              "quaternion": (torch.tensor([1.0, 0.0, 0.0, 0.0]).repeat(n, 1), 1e-3),
              "opacity": (torch.full((n,), -2.2), 5e-2),
              "sh": (torch.cat((torch.rand(n, 1, 3) - 0.5, torch.zeros(n, 3, 3)), 1), 5e-3)}
    gaussians = [v.to(device).requires_grad_() for v, _ in values.values()]
    groups = [{"params": [p], "lr": rate} for p, (_, rate) in zip(gaussians, values.values())]
    return gaussians, torch.optim.Adam(groups, eps=1e-15)


def train(show, data, args, device):
    train_views, test_views = data
    gaussians, adam = start(args.gaussians, device)
    order = torch.randint(len(train_views), (args.steps,), generator=torch.Generator().manual_seed(2)).tolist()
    curve, spent, done, every = [], 0.0, 0, max(args.steps // 10, 1)
    while True:
        curve.append({"step": done, "seconds": round(spent, 3), "psnr": round(psnr(show, gaussians, test_views), 3)})
        if done == args.steps or spent > args.seconds:
            break
        synchronize(device)
        begin, last = time.perf_counter(), min(done + every, args.steps)
        for step in range(done, last):
            view = train_views[order[step]]
            loss = (show(gaussians, view, 1.0) - view.photo).abs().mean()
            adam.zero_grad()
            loss.backward()
            adam.step()
        synchronize(device)
        spent, done = spent + time.perf_counter() - begin, last
    at_end = gaussians, test_views[0]
    return {"steps": done, "seconds": spent, "step_ms": 1e3 * spent / max(done, 1), "psnr": curve[-1]["psnr"],
            "curve": curve, "at_end": passes(show, *at_end, torch.randn_like(test_views[0].photo), 1.0, device)}


def passes(show, gaussians, view, gradient, background, device, times=20):
    """Medians of a forward pass without gradients, and of one with its backward pass, in milliseconds."""
    def forward():
        with torch.no_grad():
            show(gaussians, view, background)

    def both():
        for p in gaussians:
            p.grad = None
        show(gaussians, view, background).backward(gradient)

    out = {}
    for name, call in (("forward_ms", forward), ("forward_backward_ms", both)):
        for _ in range(3):
            call()
        out[name] = statistics.median(clock(device, call, 1) for _ in range(times))
        out[name + "_in_a_row"] = clock(device, call, times)
    return out


def compare_training(args, device, save):
    data = gart.load_dataset(args.capture, downscale=args.downscale)
    views = [[View(v.camera, device, v.image) for v in part] for part in (data.train, data.test)]
    out = {"capture": os.path.basename(args.capture.rstrip("/")), "gaussians": args.gaussians,
           "views": [len(v) for v in views], "width": views[0][0].camera.width, "height": views[0][0].camera.height}
    for name, show in operators().items():
        out[name] = tried(lambda: train(show, views, args, device))
        save("training", out)  # a time limit from outside may come in the next
        gart.torch.release()
        print(name, {k: v for k, v in out[name].items() if k != "curve"}, flush=True)
    return out


def load_scene(args, device):
    model = gart.load_model(args.scene)
    gaussians = [torch.from_numpy(np.array(getattr(model, n))).to(device).requires_grad_() for n in NAMES]
    with open(os.path.splitext(args.scene)[0] + ".json") as f:
        cameras = json.load(f)[:4]
    return gaussians, [View(gart.Camera(*(c[n] for n in ("width", "height", "fx", "fy", "cx", "cy")), c2w=np.array(c["c2w"])), device)
                       for c in cameras]


def compare_steps(gaussians, views, device):
    generator, out, images = torch.Generator().manual_seed(3), {"gaussians": len(gaussians[0])}, {}
    gradient = torch.randn((views[0].camera.height, views[0].camera.width, 3), generator=generator).to(device)

    def timed(name, show):
        with torch.no_grad():
            images[name] = show(gaussians, views[0], 0.0)
        each = [passes(show, gaussians, v, gradient, 0.0, device) for v in views]
        return {key: statistics.mean(e[key] for e in each) for key in each[0]}

    for name, show in operators().items():
        out[name] = tried(lambda: timed(name, show))
        for p in gaussians:
            p.grad = None
        print(name, out[name], flush=True)
    for name, image in images.items():
        if name != "gart.torch.render" and "gart.torch.render" in images:
            off = (image - images["gart.torch.render"]).square().mean()
            out[name]["psnr_to_gart.torch.render"] = float(-10 * off.clamp(min=1e-12).log10())
    return out


def cost_of_calls(gaussians, view, device, times=50, rounds=7):
    """gart.torch.render beside the renderer that it calls, with images and gradients at the same addresses each time."""
    shape = view.camera.height, view.camera.width
    images = [torch.empty(s, device=device) for s in ((*shape, 3), shape, shape)]
    gradient, to = torch.randn((*shape, 3), device=device), [torch.empty_like(p) for p in gaussians]
    options, detached = gart.RenderOptions(), [p.detach() for p in gaussians]
    shared = _passes._shared_for((*detached, None), 2)
    shared.bind((*detached, None))
    at = _passes._addresses([*images, None])
    by, into = _passes._addresses([gradient, None, None, None]), _passes._addresses([*to, None, None, None, None])

    def operator():
        with torch.no_grad():
            gart.torch.render(*gaussians, view.camera)

    def operator_both():
        for p in gaussians:
            p.grad = None
        gart.torch.render(*gaussians, view.camera)[0].backward(gradient)

    def renderer():
        shared.renderer._forward_at(view.camera, options, at, False)

    def renderer_both():
        shared.renderer._forward_at(view.camera, options, at, True)._backward_at(by, into)

    def by_events(call):
        if device != "cuda":
            return 1e3 * clock(device, call, times)
        begin, end = (torch.cuda.Event(enable_timing=True) for _ in range(2))
        torch.cuda.synchronize()
        begin.record()
        for _ in range(times):
            call()
        end.record()
        torch.cuda.synchronize()
        return 1e3 * begin.elapsed_time(end) / times

    out = {}
    for name, mine, its in (("forward", operator, renderer), ("forward_backward", operator_both, renderer_both)):
        pairs = [(by_events(mine), by_events(its)) for _ in range(rounds + 1)][1:]
        out[name] = {"operator_us": statistics.median(a for a, _ in pairs), "renderer_us": statistics.median(b for _, b in pairs),
                     "more_us": statistics.median(a - b for a, b in pairs), "more_us_of_rounds": [a - b for a, b in pairs]}
    return out


def lent_addresses(gaussians, view, device):
    """Whether what the renderer reads and writes lies where torch's tensors do, and what torch allocates for a call."""
    lent, plain = [], _passes._addresses
    _passes._addresses = lambda tensors: lent.append(plain(tensors)) or lent[-1]
    try:
        for p in gaussians:
            p.grad = None
        gradient = torch.randn((view.camera.height, view.camera.width, 3), device=device)
        if device == "cuda":
            torch.cuda.synchronize()
            torch.cuda.reset_peak_memory_stats()
            before = torch.cuda.memory_allocated()
        color = gart.torch.render(*gaussians, view.camera)[0]
        color.backward(gradient)
    finally:
        _passes._addresses = plain
    written = {a for some in lent for a in some}
    out = {"parameters": all(torch.utils.dlpack.from_dlpack(_passes.lend(p.detach())).data_ptr() == p.data_ptr() for p in gaussians),
           "image": color.data_ptr() in written, "image_gradient": gradient.data_ptr() in written,
           "gradients": all(p.grad.data_ptr() in written for p in gaussians)}
    if device == "cuda":
        out["model_bytes"] = sum(4 * p.numel() for p in gaussians)
        out["allocated_bytes"] = torch.cuda.max_memory_allocated() - before
    with torch.no_grad():
        before = color.detach().clone()
        kept = gaussians[4].clone()
        gaussians[4] += 0.5
        out["writes_are_seen"] = bool((gart.torch.render(*gaussians, view.camera)[0] - before).abs().max() > 0.01)
        gaussians[4].copy_(kept)
    return out


def memory_of_calls(gaussians, view, device, calls=1000):
    gradient = torch.ones((view.camera.height, view.camera.width, 3), device=device)

    def used_after(n):
        for _ in range(n):
            for p in gaussians:
                p.grad = None
            gart.torch.render(*gaussians, view.camera)[0].backward(gradient)
        synchronize(device)
        out = {"resident_kib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss}
        if device == "cuda":
            free, total = torch.cuda.mem_get_info()
            out.update(device_bytes=total - free, torch_bytes=torch.cuda.memory_allocated())
        return out

    before = used_after(max(calls // 10, 1))
    after = used_after(calls)
    return {"calls": calls, "before": before, "after": after, "grown": {k: after[k] - before[k] for k in before}}


def tried(part):
    try:
        return part()
    except Exception as e:  # one part's failure is told beside the others' results
        traceback.print_exc()
        return {"error": f"{type(e).__name__}: {e}"}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True)
    parser.add_argument("--capture"), parser.add_argument("--scene"), parser.add_argument("--commit")
    parser.add_argument("--steps", type=int, default=5000), parser.add_argument("--gaussians", type=int, default=100_000)
    parser.add_argument("--seconds", type=float, default=1e9), parser.add_argument("--downscale", type=int, default=1)
    parser.add_argument("--calls", type=int, default=1000)
    args = parser.parse_args()
    device = "cuda" if torch.cuda.is_available() and gart.resolve()["backend"] == "cuda" else "cpu"
    result = {"date": now(), "commit": commit_of(args.commit), "command": command_line(), "machine": machine(), "device": device,
              "versions": {"torch": torch.__version__, "cuda": torch.version.cuda}}
    if importlib.util.find_spec("gsplat"):
        result["versions"]["gsplat"] = tried(lambda: importlib.import_module("gsplat").__version__)

    def part(name, call):
        begin = time.perf_counter()
        out = tried(call)
        out["part_seconds"] = round(time.perf_counter() - begin, 1)
        save(name, out)

    def save(name, out):
        result[name] = out
        with open(args.out + ".part", "w") as f:
            json.dump(result, f, indent=1)
            f.write("\n")
        os.replace(args.out + ".part", args.out)

    if args.scene:
        gaussians, views = load_scene(args, device)
        part("step", lambda: compare_steps(gaussians, views, device))
        part("calls", lambda: cost_of_calls(gaussians, views[0], device))
        one = [p.detach()[:1].clone().requires_grad_() for p in gaussians]
        part("calls_of_one", lambda: cost_of_calls(one, View(gart.Camera(1, 1, 1.0, 1.0), device), device, times=200))
        part("lent", lambda: lent_addresses(gaussians, views[0], device))
        part("memory", lambda: memory_of_calls(gaussians, views[0], device, args.calls))
        del gaussians
        gart.torch.release()
    if args.capture:
        part("training", lambda: compare_training(args, device, save))


if __name__ == "__main__":
    main()
