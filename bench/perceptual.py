#!/usr/bin/env python3
"""LPIPS of rendered views beside PSNR and SSIM. Needs torch, Pillow and the package lpips, which loads its networks.

    gart eval RUN/model.ply CAPTURE --exposures RUN/exposures.json --out scores.json --pairs pairs
    python3 bench/perceptual.py pairs --scores scores.json --out lpips.json

Scores depend on the network, on the range of the images and on how photographs were made smaller, so each number has
these beside it. Two networks are used: vgg and alex. The package wants images in [-1, 1]. The script of 3DGS gives it
images in [0, 1] and vgg: compare published figures of splatting with the numbers of that range.

OUT has for each network and range the mean over the views (lower is better), each view's, and PSNR, SSIM, image size
and resize filter from the scores. Exit code: 0, or 1 where an image or a package is missing.
"""
import argparse
import json
import os

from common import command_line, commit_of, machine, now, write_json

RANGES = {"-1..1": lambda x: 2 * x - 1, "0..1": lambda x: x}


def packages():
    try:
        import lpips
        import torch
        from PIL import Image
    except ImportError as missing:
        raise SystemExit(f"bench/perceptual.py: {missing}: pip install lpips torch torchvision pillow")
    return torch, Image, lpips


def pairs(folder, scores):
    """The names of the views, of which both images must be there, and no others."""
    sides = [os.path.join(folder, side) for side in ("render", "truth")]
    for side in sides:
        if not os.path.isdir(side):
            raise SystemExit(f"bench/perceptual.py: {side}: is no folder; gart eval --pairs {folder} writes it")
    names = [view["name"] for view in scores["views"]]
    for side in sides:
        found, wanted = set(os.listdir(side)), {name + ".png" for name in names}
        if found != wanted:
            raise SystemExit(f"bench/perceptual.py: {os.path.join(side, min(found ^ wanted))}: the folder and the scores "
                             "have not the same views; make both by one gart eval")
    return names


def load(torch, image, path, device):
    """[1][3][H][W] in [0, 1]."""
    with image.open(path) as file:
        rgb = file.convert("RGB")
        levels = torch.frombuffer(bytearray(rgb.tobytes()), dtype=torch.uint8)
        return levels.reshape(1, rgb.height, rgb.width, 3).permute(0, 3, 1, 2).to(device).float() / 255


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pairs", help="the folder of gart eval --pairs")
    parser.add_argument("--scores", required=True, help="what the same gart eval wrote")
    parser.add_argument("--nets", default="vgg,alex", help="networks of the package, by commas (default: vgg,alex)")
    parser.add_argument("--out", default="lpips.json")
    parser.add_argument("--commit", help="told in the result; default: of this tree")
    a = parser.parse_args()
    try:
        with open(a.scores) as file:
            scores = json.load(file)
        psnr, ssim, resize, _ = (scores[name] for name in ("psnr", "ssim", "resize_filter", "views"))
    except KeyError as missing:
        raise SystemExit(f"bench/perceptual.py: {a.scores}: has no {missing}; gart eval --out {a.scores} writes it")
    except (OSError, ValueError) as error:
        raise SystemExit(f"bench/perceptual.py: {a.scores}: {error}; gart eval --out {a.scores} writes it")
    names = pairs(a.pairs, scores)
    torch, image, lpips = packages()
    device = "cuda" if torch.cuda.is_available() else "cpu"
    result = {"what": "lpips", "commit": commit_of(a.commit), "machine": machine(), "date": now(),
              "command": command_line(), "resize_filter": resize, "psnr": psnr, "ssim": ssim, "lpips": []}
    sizes = set()
    for net in a.nets.split(","):
        distance = lpips.LPIPS(net=net, verbose=False).to(device).eval()
        views = {of: {} for of in RANGES}
        for name in names:
            render, truth = (load(torch, image, os.path.join(a.pairs, side, name + ".png"), device)
                             for side in ("render", "truth"))
            sizes.add(f"{render.shape[3]} x {render.shape[2]}")
            with torch.no_grad():
                for of, scaled in RANGES.items():
                    views[of][name] = float(distance(scaled(render), scaled(truth)))
        result["image_size"] = ", ".join(sorted(sizes))
        for of, each in views.items():
            mean = sum(each.values()) / len(each)
            result["lpips"].append({"net": net, "range": of, "mean": mean, "views": each})
            print(f"LPIPS {mean:.4f} ({net}, images in {of}, {result['image_size']}, resize {resize})")
    print(f"PSNR {psnr:.2f} dB, SSIM {ssim:.4f} of the same images")
    write_json(a.out, result)


if __name__ == "__main__":
    main()
