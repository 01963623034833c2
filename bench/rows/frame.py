"""Time to one frame: from a level to a picture, against VTK's two ways, and the stages of isospline's own."""

import numpy as np

import isospline
from suite import peers, vtk_frames
from suite.clock import median_seconds, timed
from suite.goal import at_least
from suite.tables import markdown_table
from suite.views import whole_camera

TITLE = "Time to the first picture"
ABOUT = """From a level to a shaded picture of the whole object, with all cores. isospline: shell, BVH, render with
Phong, for each depth of pruning; the headline is the default depth. VTK, mesh: FlyingEdges3D with normals, and an
offscreen window; VTK, volume: the isosurface mode of vtkGPUVolumeRayCastMapper, and for comparison
vtkFixedPointVolumeRayCastMapper with an opacity that steps at the level, both with two samples a voxel and one ray a
pixel. OpenGL runs in software here (Mesa's llvmpipe). The window is opened before the clock starts; the prefilter,
which isospline runs once a volume, is apart. All pictures must cover the same part of the image, but for the
fixed-point mapper's, which shows the solid and so covers more where the volume's border cuts it."""
GOALS = [("one frame against VTK's FlyingEdges3D + software rendering", "at least 3 times"),
         ("one frame against VTK's volume mapper, isosurface mode", "at least 100 times")]  # fmt: skip
DEPTHS = (0, 1, 2, 3, 4)
DEFAULT_DEPTH = 2


def measure(settings):
    peers.require_vtk_rendering()
    isospline.set_thread_count(0)
    for subject in settings.subjects():
        prefilter, volume = timed(lambda s=subject: isospline.Volume(s.data, **s.grid))
        depths = {depth: stages(volume, subject.level, depth, settings) for depth in DEPTHS}
        scene = isospline.Scene([isospline.Isosurface(volume, subject.level)])
        camera = whole_camera(scene, settings.size)
        covered = np.isfinite(isospline.render(scene, camera, size=settings.size).depth).mean()
        frames = vtk_frames.measure(subject, volume.affine, camera, settings)
        for name, frame in frames.items():
            more = frame["covered"] - covered
            right = more > -0.02 if name == "fixed point" else abs(more) < 0.02
            assert right, f"VTK's {name} covers {frame['covered']:.1%}, not {covered:.1%}"
        yield {
            "subject": subject.name, "pixels": list(settings.size), "threads": isospline.thread_count(),
            "covered": float(covered), "prefilter_seconds": prefilter,
            "isospline": [{"prune_depth": depth} | result for depth, result in depths.items()], "vtk": frames,
        }  # fmt: skip


def stages(volume, level, depth, settings):
    """Median seconds of shell, BVH and render."""
    camera = whole_camera(isospline.Scene([isospline.Isosurface(volume, level, prune_depth=depth)]), settings.size)
    runs = []
    for _ in range(settings.repetitions):
        shell, surface = timed(lambda: isospline.Isosurface(volume, level, prune_depth=depth))
        scene = isospline.Scene([surface])
        bvh, _ = timed(lambda s=scene: s.memory)  # a scene builds itself when first asked
        runs.append((shell, bvh, median_seconds(lambda s=scene: isospline.render(s, camera, size=settings.size), 1)))
    return dict(zip(("shell", "bvh", "render"), map(float, np.median(runs, axis=0))))


def seconds(result, depth=DEFAULT_DEPTH):
    found = next(stage for stage in result["isospline"] if stage["prune_depth"] == depth)
    return found["shell"] + found["bvh"] + found["render"]


def ratios(results, name):
    return {
        result["subject"]: sum(result["vtk"][name]["seconds"].values()) / seconds(result)
        for result in results if name in result["vtk"]
    }  # fmt: skip


def goals(results):
    return [
        at_least(GOALS[0][0], 3, ratios(results, "mesh")),
        at_least(GOALS[1][0], 100, ratios(results, "isosurface")),
    ]


def table(results):
    rows = []
    for result in results:
        for stage in result["isospline"]:
            parts = ", ".join(f"{name} {1e3 * stage[name]:.0f}" for name in ("shell", "bvh", "render"))
            total = seconds(result, stage["prune_depth"])
            rows.append((result["subject"], f"isospline, pruned {stage['prune_depth']} deep", 1e3 * total, parts,
                         total / seconds(result)))  # fmt: skip
        for name, frame in result["vtk"].items():
            total = sum(frame["seconds"].values())
            parts = ", ".join(f"{part} {1e3 * value:.0f}" for part, value in frame["seconds"].items())
            rows.append((result["subject"], f"VTK, {name}", 1e3 * total, parts, total / seconds(result)))
    return markdown_table(("volume", "way", "ms", "of which, ms", "times as long"), rows)
