"""What cpack makes of a build: a .deb and an archive that hold the program, the headers and the Python module, unpacked
and run from there. The archive is a .tar.gz here: to pack the same files as .tar.xz takes a minute of two cores."""
import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

parser = argparse.ArgumentParser()
parser.add_argument("--cpack", required=True)
parser.add_argument("--build", type=pathlib.Path, required=True)
parser.add_argument("--version", required=True)
parser.add_argument("--python", help="the interpreter that the module was built for")
parser.add_argument("--python-folder", default="")
a = parser.parse_args()


def run(*command, env=None, cwd=None):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, env=env, cwd=cwd)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}\nexit code {done.returncode}\n{done.stdout}\n{done.stderr}")
    return done.stdout


def check(prefix):
    told = run(prefix / "bin" / "gart", "info", "--self-test")
    if f"gart       {a.version}" not in told or "configurations agree with the definition, 0 do not" not in told:
        sys.exit(f"{prefix}/bin/gart says:\n{told}")
    for name in ("version.hpp", "gartConfig.cmake", "LICENSE"):
        if not list(prefix.rglob(name)):
            sys.exit(f"{name} is not in {prefix}")
    if a.python:
        run(a.python, "-c", f"import gart; assert gart.__version__ == '{a.version}'; gart.Renderer(backend='serial')",
            env={**os.environ, "PYTHONPATH": str(prefix / a.python_folder)}, cwd=prefix)


kinds = ["TGZ"] + (["DEB"] if shutil.which("dpkg-deb") else [])
with tempfile.TemporaryDirectory() as temporary:
    folder = pathlib.Path(temporary)
    run(a.cpack, "-G", ";".join(kinds), "-B", folder, cwd=a.build)
    archives = sorted(folder.glob("*.tar.gz"))
    assert len(archives) == 1, archives
    (folder / "from_tar").mkdir()
    run("tar", "-xf", archives[0], "-C", folder / "from_tar", "--strip-components=1")
    check(folder / "from_tar")
    if "DEB" in kinds:
        packages = sorted(folder.glob("*.deb"))
        assert len(packages) == 1, packages
        told = run("dpkg-deb", "-f", packages[0])
        if f"Version: {a.version}" not in told or "Package: gart" not in told:
            sys.exit(f"{packages[0]} says:\n{told}")
        run("dpkg-deb", "-x", packages[0], folder / "from_deb")
        check(folder / "from_deb" / "usr")
print("packed, unpacked and run: " + ", ".join(kinds))
