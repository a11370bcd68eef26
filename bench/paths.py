"""The part `paths` of bench/run.py: what a picture of light among many Gaussians takes (docs/light.md).

A mirror ball, a glass ball and a gold teapot stand before the first camera of the first scene, under a sun and a sky, as
in examples/7_light/bonsai.json. Measured are frames of 1280 x 800 from a camera that moved to bytes on the host, one
sample each, and their stages.
"""
import json
import os

SIZE = (1280, 800)
TEAPOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "examples", "7_light", "teapot.obj")
# In units of the camera's distance from the middle of the scene: across, down, ahead, half the size.
PLACES = {"mirror ball": (-0.17, 0.03, 0.45, 0.08), "glass ball": (0, 0.05, 0.42, 0.08), "teapot": (0.17, 0.1, 0.45, 0.1)}


def among(camera):
    """scene.json for a camera in a world whose middle is at zero and whose +z is up."""
    rows = camera["c2w"][:3]
    distance = sum(row[3] ** 2 for row in rows) ** 0.5
    scale = SIZE[1] / camera["height"]
    view = {**camera, "width": SIZE[0], "height": SIZE[1], "fx": camera["fx"] * scale, "fy": camera["fy"] * scale,
            "cx": SIZE[0] / 2, "cy": SIZE[1] / 2}

    def placed(name, **what):
        *at, size = (distance * x for x in PLACES[name])
        return {"name": name, "scale": size, "translation": [sum(a * b for a, b in zip(row, [*at, 1])) for row in rows],
                **what}

    return {
        "up": [0, 0, 1],
        "materials": [{"name": "silver", "kind": "mirror", "base_color": [0.95, 0.95, 0.95]},
                      {"name": "glass", "kind": "dielectric", "ior": 1.5},
                      {"name": "gold", "base_color": [1, 0.77, 0.34], "metallic": 1, "roughness": 0.25}],
        "meshes": [placed("mirror ball", shape="sphere", material="silver"),
                   placed("glass ball", shape="sphere", material="glass"),
                   # An OBJ has the world's axes; the teapot's y goes up.
                   placed("teapot", file=os.path.abspath(TEAPOT), material="gold", rotation=[0.5 ** 0.5, 0.5 ** 0.5, 0, 0])],
        "lights": [{"kind": "directional", "direction": [0.35, 0.37, -0.86], "color": [2.8, 2.6, 2.2], "angle": 4}],
        "environment": {"sky": {"zenith": [0.25, 0.27, 0.3], "horizon": [0.4, 0.4, 0.4], "ground": [0.12, 0.1, 0.09]},
                        "visible": False},
        "cameras": [view],
        "options": {"ambient": 0.4, "firefly": 4}}


class Paths:
    def paths(self):
        name, ply, cameras = self.scene(self.a.counts[0])
        with open(cameras) as f:
            camera = json.load(f)[0]
        scene = os.path.join(self.temporary, "among.json")
        with open(scene, "w") as f:
            json.dump(among(camera), f, indent=1)
        program = "gart_bench_light" + ("_cuda" if self.a.backend == "cuda" else "")
        self.google_benchmark("paths_" + name, program,
                              ["--model", ply, "--scene", scene, "--size", "{}x{}".format(*SIZE)],
                              f"^light/frame/bounces_[0-9]+/{self.a.backend}", scene=name)
