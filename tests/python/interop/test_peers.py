"""Other packages with their own Embree and TBB, in one process with isospline, in any order."""

import importlib.util
import itertools
import subprocess
import sys

import pytest

#: Each program traces the ray from (0, 0, -5) along z to a cube or ball of radius 1, and returns t, which is 4.
TRACE = {
    "isospline": """
import isospline, numpy
index = numpy.arange(24) - 11.5
ball = 100 - (index[:, None, None] ** 2 + index[:, None] ** 2 + index**2)
surface = isospline.Isosurface(isospline.Volume(ball, spacing=0.1, origin=(-1.15,) * 3), 0)
return isospline.Scene(surface).cast_rays([(0, 0, -5, 0, 0, 1)]).t_hit[0]
""",
    "embreex": """
import trimesh, trimesh.ray.ray_pyembree
cube = trimesh.creation.box((2, 2, 2))
locations = trimesh.ray.ray_pyembree.RayMeshIntersector(cube).intersects_location(
    [(0.1, 0.2, -5)], [(0, 0, 1)], multiple_hits=False)[0]
return locations[0][2] + 5
""",
    "open3d": """
import open3d
scene = open3d.t.geometry.RaycastingScene()
scene.add_triangles(open3d.t.geometry.TriangleMesh.create_box(2, 2, 2))
ray = open3d.core.Tensor([[1.1, 0.9, -4, 0, 0, 1]], open3d.core.float32)
return scene.cast_rays(ray)["t_hit"].numpy()[0]
""",
    "mitsuba": """
import mitsuba
mitsuba.set_variant("scalar_rgb")
scene = mitsuba.load_dict({"type": "scene", "cube": {"type": "cube"}})
return scene.ray_intersect(mitsuba.Ray3f([0.1, 0.2, -5], [0, 0, 1])).t
""",
}
INSTALLED = [name for name in TRACE if importlib.util.find_spec(name)]


def trace(names):
    """The results of each package in a separate process: imported in this order, then called once more."""
    functions = [f"def {name}_t():{code.replace(chr(10), chr(10) + '    ')}" for name, code in TRACE.items()]
    calls = [f"print({name}_t())" for name in (*names, *reversed(names))]
    program = "\n".join([*functions, *calls])
    result = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, encoding="utf-8", check=False, timeout=900
    )
    assert result.returncode == 0, f"exit code {result.returncode}\n{result.stderr[-2000:]}"
    return [float(line) for line in result.stdout.split()]


@pytest.mark.parametrize("name", TRACE)
def test_each_traces_alone(name):
    if name not in INSTALLED:
        pytest.skip(f"{name} is not installed: pip install isospline[peers]")
    assert trace([name]) == pytest.approx([4, 4], abs=1e-2)


@pytest.mark.skipif(len(INSTALLED) < 2, reason="none of the others is installed")
@pytest.mark.parametrize("names", itertools.permutations(INSTALLED), ids="-".join)
def test_all_trace_in_any_order(names):
    assert trace(names) == pytest.approx([4] * 2 * len(names), abs=1e-2)
