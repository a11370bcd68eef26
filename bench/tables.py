"""Tables of the pages in docs, and where their figures come from."""


def table(header, rows):
    out = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return out + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]


def clock_of(tradeoff):
    return "processor_ms" if tradeoff["clock"] == "processor" else "total_ms"


def source(result):
    machine = result["machine"]
    return f"{machine.get('gpu', machine['cpu'])}, commit {result['commit']}, {result['date']}"


def formats(results):
    """What each format costs, by every formats_NAME.json."""
    rows = []
    for result in results:
        rows += [[result["scene"], r["setting"], f"{r['bytes']:,}", f"{r['bytes'] / r['gaussians']:.1f}",
                  f"1/{1 / r['share']:.1f}", f"{r['psnr']:.2f}", f"{max(r['psnr_lost'], 0):.2f}", f"{r['ssim']:.4f}"]
                 for r in result["runs"]]
        rows.append([f"{result['scene']}: {source(result)}"] + [""] * 7)
    return table(["model", "format", "bytes", "a Gaussian", "of the PLY", "PSNR, dB", "lost, dB", "SSIM"], rows)


def viewer(results):
    """What a viewer reaches while it moves and at rest, by every view_NAME.json."""
    rows = []
    for result in results:
        for r in result["runs"]:
            size = lambda sides: " x ".join(str(round(side)) for side in sides)
            rows.append([r["scene"], f"{r['gaussians']:,}", size(r["canvas"]), f"{r['frames_a_second']:.1f}",
                         size(r["moving_size"]), f"{r['input_to_frame_ms']['median']:.0f}",
                         f"{r['input_to_frame_ms']['share_95']:.0f}", f"{r['motion_to_whole_s']['median']:.2f}",
                         f"{r['rest_ms']:.0f}", source(result)])
    return table(["model", "Gaussians", "canvas", "frames a second", "of", "input to frame, ms", "95 of 100 within",
                  "motion to whole, s", "of it the whole view, ms", ""], rows)


def ranks(results):
    """Steps on several GPUs against one, by every ranks_SCENE.json."""
    rows = []
    for result in results:
        alone = next(r for r in result["runs"] if r["what"] == "steps alone")
        for r in result["runs"]:
            if r["what"].startswith("steps"):
                rows.append([result["scene"].removesuffix(".ply"), r["what"].removeprefix("steps "), r["ranks"],
                             f"{r['step_ms']:.3f}", f"{r['images_a_second']:.1f}",
                             f"{r['images_a_second'] / alone['images_a_second']:.2f}", f"{r['sent_bytes'] / 1e6:.1f}",
                             f"{r['peak_bytes'] / 1e9:.2f}"])
        rows.append([f"{source(result)}"] + [""] * 7)
    return table(["scene", "a step", "GPUs", "ms", "images a second", "against one", "sent by a rank, MB",
                  "peak of a rank, GB"], rows)


def viewed_training(results):
    """What a viewer takes from a training, by every view_training_NAME.json."""
    words = {"without": "no viewer", "nobody": "a viewer that nobody opens", "client": "a page that moves all the time"}
    rows = [[result["scene"], words[r["viewer"]], f"{r['seconds']:.2f}", f"{100 * r['slower']:.2f} %",
             f"{r['processor_seconds']:.2f}", f"{100 * r['slower_processor']:.2f} %", source(result)]
            for result in results for r in result["runs"]]
    return table(["capture", "with", "seconds", "slower", "of the processor", "slower", ""], rows)
