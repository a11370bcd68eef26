"""What the checks of gart on several ranks share: a capture that a training takes a moment for, and how it is trained."""
import json
import struct
import subprocess
import sys
import zlib


def run(*command, **options):
    return subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=120, **options)


def expect(condition, what):
    if not condition:
        sys.exit(f"FAILED: {what}")


def write_capture(capture):
    """Four views of nothing much, as transforms.json with PNGs that python alone can write."""
    (capture / "images").mkdir(parents=True)

    def png(width, height, value):
        rows = b"".join(b"\0" + bytes((value + 3 * x + 5 * y) % 256 for x in range(width) for _ in range(3))
                        for y in range(height))
        chunk = lambda kind, data: (struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)))
        return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
                chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))

    frames = []
    for i in range(4):
        name = f"images/{i}.png"
        (capture / name).write_bytes(png(48, 40, 40 * i))
        frames.append({"file_path": name, "transform_matrix": [[1, 0, 0, 0.3 * i], [0, 1, 0, 0], [0, 0, 1, 4], [0, 0, 0, 1]]})
    (capture / "transforms.json").write_text(json.dumps(
        {"fl_x": 50, "fl_y": 50, "cx": 24, "cy": 20, "w": 48, "h": 40, "frames": frames}))


def options_of(capture, out, steps, exposure="off", test_every=0):
    return ["train", capture, "--out", out, "--iterations", steps, "--max-gaussians", 300, "--points", 200,
            "--test-every", test_every, "--sh-degree", 1, "--no-auto", "--background", "black", "--exposure", exposure,
            "--threads", 1]
