"""Draws an MJCF scene as its one camera sees it by MuJoCo's renderer on the CPU (OSMesa, one thread).

    mujoco_camera.py SCENE.xml WIDTH HEIGHT REPEATS DEPTH.f32

Prints the median milliseconds of a depth picture, of a picture of which geom each pixel shows, and of a colour
picture; writes the depths (m, 32-bit floats, row by row from the top left).
"""

import os
import statistics
import sys
import time

os.environ["MUJOCO_GL"] = "osmesa"
os.environ["LP_NUM_THREADS"] = "0"

import mujoco  # noqa: E402 - after the environment is set

scene, width, height, repeats, depths = sys.argv[1:]
model = mujoco.MjModel.from_xml_path(scene)
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
renderer = mujoco.Renderer(model, int(height), int(width), max_geom=10000)


def median_ms():
    def once():
        begun = time.perf_counter()
        renderer.update_scene(data, "camera")
        image = renderer.render()
        return 1e3 * (time.perf_counter() - begun), image

    once()
    taken = [once() for _ in range(int(repeats))]
    return statistics.median(ms for ms, _ in taken), taken[-1][1]


renderer.enable_depth_rendering()
depth_ms, depth = median_ms()
renderer.disable_depth_rendering()
renderer.enable_segmentation_rendering()
bodies_ms, _ = median_ms()
renderer.disable_segmentation_rendering()
rgb_ms, _ = median_ms()
renderer.close()
depth.astype("<f4").tofile(depths)
print(mujoco.__version__, depth_ms, bodies_ms, rgb_ms)
