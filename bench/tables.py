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
