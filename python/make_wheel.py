"""Packs a built module into a wheel for this machine: make_wheel.py BUILD/python/gart FOLDER.

The wheel is for this interpreter, or by the stable ABI for CPython from 3.12 on.

pip install . makes the same where scikit-build-core is; this needs nothing but Python. The libraries that the module links
(libpng, Embree and others) stay the machine's: such a wheel is for machines like this one.
"""
import base64
import hashlib
import importlib.machinery
import pathlib
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile

package, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
root = pathlib.Path(__file__).resolve().parent.parent
version = re.search(r'version\[\] = "([0-9.]+)"', (root / "include/gart/core/version.hpp").read_text())[1]
suffixes = importlib.machinery.EXTENSION_SUFFIXES  # this interpreter's own, then the stable ABI's
suffix = next((s for s in suffixes if (package / f"_gart{s}").exists()), None)
if suffix is None:
    sys.exit(f"{package} has no _gart{suffixes[0]}: build the target gart_python, and run this by the Python it was built for")
if b"libgart_runtime.so" in (package / f"_gart{suffix}").read_bytes():
    sys.exit(f"{package} links gart's shared libraries, which a wheel has not: configure with BUILD_SHARED_LIBS=OFF")
python = f"cp{sys.version_info.major}{sys.version_info.minor}"
python = f"{python}-{python}" if suffix == suffixes[0] else "cp312-abi3"  # nanobind's stable ABI is that of 3.12
tag = f"{python}-{re.sub('[^a-z0-9]', '_', sysconfig.get_platform().lower())}"
info = f"gart-{version}.dist-info"
files = {f"gart/{p.relative_to(package).as_posix()}": p.read_bytes() for p in sorted(package.rglob("*"))
         if p.name in (f"_gart{suffix}", "py.typed") or p.suffix in (".py", ".pyi")}
if shutil.which("strip"):
    with tempfile.TemporaryDirectory() as folder:
        stripped = pathlib.Path(folder) / "stripped"
        subprocess.run(["strip", "-o", stripped, package / f"_gart{suffix}"], check=True)
        files[f"gart/_gart{suffix}"] = stripped.read_bytes()
files[f"{info}/METADATA"] = (f"Metadata-Version: 2.1\nName: gart\nVersion: {version}\n"
                             "Summary: Ray-traced 3D Gaussians: training and rendering\n"
                             "Requires-Python: >=3.8\nRequires-Dist: numpy>=1.22\n").encode()
files[f"{info}/WHEEL"] = f"Wheel-Version: 1.0\nGenerator: gart\nRoot-Is-Purelib: false\nTag: {tag}\n".encode()
files[f"{info}/LICENSE"] = (root / "LICENSE").read_bytes()
record = "".join(f"{name},sha256={base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b'=').decode()},{len(data)}\n"
                 for name, data in files.items())
files[f"{info}/RECORD"] = f"{record}{info}/RECORD,,\n".encode()

out.mkdir(parents=True, exist_ok=True)
wheel = out / f"gart-{version}-{tag}.whl"
temporary = wheel.with_suffix(".part")
with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
    for name, data in files.items():
        entry = zipfile.ZipInfo(name, (2020, 1, 1, 0, 0, 0))
        entry.external_attr, entry.compress_type = (0o755 if name.endswith(suffix) else 0o644) << 16, zipfile.ZIP_DEFLATED
        archive.writestr(entry, data)
temporary.replace(wheel)
print(wheel)
