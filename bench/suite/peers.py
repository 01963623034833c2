"""Other tools to compare with. Each is first tried in a process of its own, because some end the process on failure."""

import os
import re
import subprocess
import sys
from pathlib import Path

TRY_VTK = """
from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D
"""

TRY_GL = """
import vtkmodules.vtkRenderingOpenGL2, vtkmodules.vtkRenderingVolumeOpenGL2
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow, vtkWindowToImageFilter
window = vtkRenderWindow()
window.SetOffScreenRendering(1)
window.SetSize(8, 8)
renderer = vtkRenderer()
renderer.SetBackground(1, 1, 1)
window.AddRenderer(renderer)
window.Render()
grab = vtkWindowToImageFilter()
grab.SetInput(window)
grab.ReadFrontBufferOff()
grab.Update()
if grab.GetOutput().GetScalarRange()[1] != 255:
    raise SystemExit("an offscreen window of VTK stays black: is there Mesa's EGL or OSMesa?")
"""

TRY_MITSUBA = """
import mitsuba as mi
mi.set_variant("llvm_ad_rgb")
import drjit as dr
import numpy as np
grid = (np.linalg.norm(np.mgrid[-3:4, -3:4, -3:4], axis=0) - 2.2).astype(np.float32)[..., None]
scene = mi.load_dict({"type": "scene", "shape": {"type": "sdfgrid", "grid": mi.TensorXf(grid)}})
hit = scene.ray_intersect_preliminary(mi.Ray3f(mi.Point3f(0.5, 0.5, -1), mi.Vector3f(0, 0, 1)), coherent=True)
dr.eval(hit.t)
"""

TRY_OPEN3D = """
import open3d
open3d.t.geometry.RaycastingScene()
"""


class Skipped(Exception):
    """A peer cannot run here; the text says why."""


def require(name, code):
    """Run the code in a process of its own; raises `Skipped` with the reason if that fails."""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, encoding="utf-8", check=False)
    if result.returncode != 0:
        lines = [line.strip() for line in result.stderr.splitlines() if line.strip()]
        errors = [line for line in lines if re.match(r"LLVM ERROR|\w*Error:", line)]
        said = (errors or lines[-1:] or [f"status {result.returncode}"])[0]
        raise Skipped(f"{name} does not run here: {re.sub(r' 0x[0-9a-f]+', '', said)[:160]}")


def require_vtk():
    require("VTK", TRY_VTK)


def require_vtk_rendering():
    require("VTK's offscreen rendering", TRY_GL)


def require_mitsuba():
    """Show Mitsuba the newest libLLVM, with which it compiles its kernels; old ones lack what it needs."""
    if "DRJIT_LIBLLVM_PATH" not in os.environ and (library := newest_llvm()):
        os.environ["DRJIT_LIBLLVM_PATH"] = str(library)
    require("Mitsuba 3 (llvm_ad_rgb)", TRY_MITSUBA)


def has_open3d():
    """Whether Open3D runs here; prints the reason if it does not."""
    try:
        require("Open3D", TRY_OPEN3D)
    except Skipped as reason:
        print(f"  {reason}")
        return False
    return True


def newest_llvm():
    found = [
        (int(version.group(1)), path)
        for path in Path("/usr/lib").glob("*/libLLVM*.so*")
        if (version := re.search(r"libLLVM(?:-|\.so\.)(\d+)", path.name))
    ]
    return max(found)[1] if found else None
