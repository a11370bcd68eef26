"""Installs gart, moves the prefix away from where it was installed, and builds and runs from there: a project of g++ alone
that is allowed no package which only gart itself needs, with no nvcc on the path; a plugin that a program without gart
loads; every numbered example; the program; and one kernel compiled by nvcc where there is one. A component that is not
there has to be refused by name.

Then gart as part of another project, by add_subdirectory and by FetchContent, and the headers alone, on a machine that has
none of the packages which only the libraries need.
"""
import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

parser = argparse.ArgumentParser()
parser.add_argument("--cmake", required=True)
parser.add_argument("--source", type=pathlib.Path, required=True)
parser.add_argument("--build", type=pathlib.Path, required=True)
parser.add_argument("--generator", required=True)
parser.add_argument("--version", required=True)
parser.add_argument("--cxx", required=True)
parser.add_argument("--nvcc")
parser.add_argument("--jobs", default="1")
parser.add_argument("--component", action="append", default=[], help="cuda, embree, view: what was built beside cpu")
parser.add_argument("--program", action="store_true")
a = parser.parse_args()
here = pathlib.Path(__file__).resolve().parent


def run(*command, env=None, fails=False):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, env=env)
    if (done.returncode != 0) != fails:
        sys.exit(f"{' '.join(map(str, command))}\nexit code {done.returncode}"
                 f"{', a failure was expected' if fails else ''}\n{done.stdout}\n{done.stderr}")
    return done.stdout + done.stderr


def expect(text, *words):
    for word in words:
        if word not in text:
            sys.exit(f"`{word}` should be in:\n{text}")
    return text


def path_without_nvcc(folder):
    """PATH, with every folder that holds an nvcc replaced by one of links to all else in it."""
    parts = []
    for i, part in enumerate(os.environ["PATH"].split(os.pathsep)):
        if not part or not pathlib.Path(part, "nvcc").exists():
            parts.append(part)
            continue
        links = folder / f"path{i}"
        links.mkdir()
        for tool in pathlib.Path(part).iterdir():
            if tool.name != "nvcc":
                (links / tool.name).symlink_to(tool)
        parts.append(str(links))
    path = os.pathsep.join(parts)
    assert shutil.which("nvcc", path=path) is None
    return path


with tempfile.TemporaryDirectory() as temporary:
    folder = pathlib.Path(temporary)
    prefix = folder / "prefix"
    environment = {k: v for k, v in os.environ.items() if k not in ("DESTDIR", "CUDACXX", "CUDAToolkit_ROOT")}
    bare = {**environment, "PATH": path_without_nvcc(folder)}

    run(a.cmake, "--install", a.build, "--prefix", folder / "staging", env=environment)
    (folder / "staging").rename(prefix)
    for name in ("LICENSE", "version.hpp", "gartConfig.cmake"):
        if not list(prefix.rglob(name)):
            sys.exit(f"{name} was not installed")

    def configure(project, *options, env=bare, fails=False):
        binary = folder / project.name
        return run(a.cmake, "-S", project, "-B", binary, "-G", a.generator, f"-DCMAKE_PREFIX_PATH={prefix}",
                   f"-DCMAKE_CXX_COMPILER={a.cxx}", "-DCMAKE_BUILD_TYPE=Release",
                   "-DCMAKE_CXX_FLAGS_RELEASE=-O0 -DNDEBUG", *options, env=env, fails=fails)

    def build(project, *options, env=bare):
        configure(project, *options, env=env)
        run(a.cmake, "--build", folder / project.name, "--parallel", a.jobs, env=env)
        return folder / project.name

    # Neither what only gart's own sources include, nor what components that were not asked for link.
    never = [f"-DCMAKE_DISABLE_FIND_PACKAGE_{name}=ON" for name in
             ("nlohmann_json", "Eigen3", "doctest", "CLI11", "embree", "MPI", "CUDAToolkit")]
    host = build(here / "downstream", f"-DVERSION={a.version}", *never)
    capture, model = folder / "capture", folder / "model.ply"
    expect(run(host / "use_headers"), f"version {a.version}")
    expect(run(host / "use_cpu", capture, model), "serial", "openmp")
    tiles = host / "use_tiles"
    if tiles.exists():
        expect(run(tiles, model, folder / "tiles.png"), "Gaussians on openmp")
        if tiles.stat().st_size > 0.6 * (host / "use_cpu").stat().st_size:
            sys.exit("use_tiles should have the configurations of one tracer, and is about as large as use_cpu")

    expect(run(build(here / "downstream" / "shared") / "use_shared"), "a plugin rendered")

    for component in a.component:
        binary = build(here / "downstream" / component)
        expect(run(binary / f"use_{component}"), component)
    told = configure(here / "downstream" / "missing", fails=True)
    expect(" ".join(told.split()), "has no component levitation, telepathy", "it has: headers, io, runtime, reference, cpu")

    examples = {path.name: build(path) for path in sorted((a.source / "examples").glob("[0-9]_*"))}
    image = folder / "image.png"
    expect(run(examples["1_render_ply"] / "render_ply", model, image), "Gaussians")
    assert image.read_bytes().startswith(b"\x89PNG")
    for name in ("2_train_scene/train_scene", "3_own_loss/own_loss"):
        trained = folder / "trained.ply"
        trained.unlink(missing_ok=True)
        run(examples[name.split("/")[0]] / name.split("/")[1], capture, trained, 3)
        assert trained.read_bytes().startswith(b"ply\n")
    expect(run(examples["4_bvh_query"] / "bvh_query", 1000), "1000 boxes")
    points = folder / "points.ply"
    expect(run(examples["6_lidar_scan"] / "lidar_scan", model, 0, 0, 0, points), "65536 rays")
    assert points.read_bytes().startswith(b"ply\n")
    picture = folder / "light.png"
    expect(run(examples["7_light"] / "light", model, capture, 0, 0, 0, 0.5, picture), "64 samples a pixel")
    assert picture.read_bytes().startswith(b"\x89PNG")
    own = folder / "own.ply"
    expect(run(examples["5_own_configuration"] / "own_configuration", capture, own, 3), "openmp, tiles, primitive: kernel degree 4")
    expect(own.read_bytes()[:400].decode("latin-1"), "comment gart kernel_degree 4\n")

    if a.program:
        expect(run(prefix / "bin" / "gart", "--help", env=bare), "train", "render")
    if a.nvcc:
        binary = build(here / "downstream" / "nvcc", f"-DCMAKE_CUDA_COMPILER={a.nvcc}", env=environment)
        run(binary / "use_nvcc")

    # As part of another project: its build type stays, gart's install rules and programs stay out.
    part = here / "downstream" / "subproject"

    def build_part(name, *options):
        binary = folder / name
        run(a.cmake, "-S", part, "-B", binary, "-G", a.generator, f"-DCMAKE_CXX_COMPILER={a.cxx}",
            f"-DGART={a.source}", "-DGART_CUDA=OFF", *options, env=bare)
        run(a.cmake, "--build", binary, "--parallel", a.jobs, "--target", "use_headers", env=bare)
        expect(run(binary / "use_headers"), f"version {a.version}")
        return binary

    # With unity builds, which a parent may set. That sources of gart_io compile alone is shown by what was installed above.
    added = build_part("added", "-DCMAKE_UNITY_BUILD=ON")
    cache = (added / "CMakeCache.txt").read_text()
    expect(cache, "CMAKE_BUILD_TYPE:STRING=\n", "GART_INSTALL:BOOL=OFF", "GART_BUILD_TESTS:BOOL=OFF")
    run(a.cmake, "--build", added, "--parallel", a.jobs, "--target", "use_io", env=bare)
    run(added / "use_io", folder / "grey.png")
    run(a.cmake, "--install", added, "--prefix", folder / "parent", env=bare)
    installed = sorted(str(p.relative_to(folder / "parent")) for p in (folder / "parent").rglob("*") if p.is_file())
    if installed != ["bin/use_headers"]:
        sys.exit(f"a parent's install should hold what is its own, bin/use_headers, and holds {installed}")

    codecs = [f"-DCMAKE_DISABLE_FIND_PACKAGE_{name}=ON" for name in ("PNG", "TurboJPEG", "nlohmann_json")]
    headers_alone = [*codecs, *never, "-DGART_BUILD_BACKENDS=OFF"]
    build_part("fetched", "-DFETCH=ON", "-DCMAKE_BUILD_TYPE=Debug", *headers_alone)

    # The headers alone, configured, installed and found; and what is said where the libraries' packages are missing.
    alone = folder / "alone"
    top = (a.cmake, "-S", a.source, "-G", a.generator, f"-DCMAKE_CXX_COMPILER={a.cxx}")
    run(*top, "-B", alone, *headers_alone, env=bare)
    expect((alone / "CMakeCache.txt").read_text(), "CMAKE_BUILD_TYPE:STRING=Release\n", "GART_INSTALL:BOOL=ON")
    run(a.cmake, "--install", alone, "--prefix", folder / "headers", env=bare)
    told = configure(here / "downstream" / "missing", f"-DCMAKE_PREFIX_PATH={folder / 'headers'}",
                     f"-Dgart_DIR={next((folder / 'headers').rglob('gartConfig.cmake')).parent}", fails=True)
    expect(" ".join(told.split()), "it has: headers.")
    told = run(*top, "-B", folder / "no_codecs", "-DGART_CUDA=OFF", *codecs, env=bare, fails=True)
    expect(" ".join(told.split()), "libpng-dev", "libturbojpeg0-dev", "nlohmann-json3-dev", "-DGART_BUILD_BACKENDS=OFF")
    told = run(*top, "-B", folder / "no_libraries", "-DGART_BUILD_BACKENDS=OFF", "-DGART_BUILD_TESTS=ON", env=bare, fails=True)
    expect(" ".join(told.split()), "GART_BUILD_TESTS is ON and needs the libraries")
print("installed, moved, and used: host" + "".join(f", {c}" for c in a.component) + (", nvcc" if a.nvcc else ""))
