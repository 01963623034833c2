"""Mitsuba 3's `sdfgrid`, the nearest relative: a trilinear model traced exactly, also by Embree over its cells."""

import numpy as np
from suite import peers, subjects
from suite.clock import rates, take_turns
from suite.goal import at_least
from suite.tables import markdown_table, with_spread
from suite.views import CAMERAS, in_tiles

import isospline

TITLE = "Mitsuba 3 sdfgrid"
ABOUT = """The same primary rays in the same order and on the same number of threads. Mitsuba (llvm_ad_rgb,
`ray_intersect_preliminary(coherent=True)`) has its rays in its own arrays before the clock starts, and returns t alone.
isospline's time is that of the whole call from Python, with exact normals. `sdfgrid` of Mitsuba 3.9 finds nothing on
grids that are not cubes, so volumes are padded to cubes for both. Its model is trilinear, which is isospline's degree
1: that surface serves to check Mitsuba's answer (median distance, in voxels, and rays where only one of the two
hits)."""
SETTINGS = ("size", "repetitions", "threads")
GOALS = [("packets against Mitsuba 3 sdfgrid (trilinear)", "at least 4 times")]


class SdfGrid:
    """The subject in Mitsuba, in index space: `sdfgrid` does not support rotation or mirroring."""

    def __init__(self, subject, affine, threads):
        import drjit
        import mitsuba

        self.drjit, self.mitsuba = drjit, mitsuba
        mitsuba.set_variant("llvm_ad_rgb")
        drjit.set_thread_count(threads)
        data = np.asarray(subject.data, dtype=np.float32)
        values = (np.float32(subject.level) - data) / np.ptp(data)  # below 0 inside
        self.to_index = np.linalg.inv(affine)
        shape = {
            "type": "sdfgrid",
            "grid": mitsuba.TensorXf(values[..., None]),
            "to_world": mitsuba.ScalarTransform4f().scale([count - 1 for count in data.shape[::-1]]),
        }
        self.scene = mitsuba.load_dict({"type": "scene", "shape": shape})

    def rays(self, rays):
        """World rays in Mitsuba's arrays; an affine map does not change their t."""
        linear = self.to_index[:3, :3].T
        columns = np.concatenate([rays[:, :3] @ linear + self.to_index[:3, 3], rays[:, 3:] @ linear], axis=1)
        columns = np.ascontiguousarray(columns.T, dtype=np.float32)
        ray = self.mitsuba.Ray3f(self.mitsuba.Point3f(columns[:3]), self.mitsuba.Vector3f(columns[3:]))
        self.drjit.eval(ray)
        self.drjit.sync_thread()
        return ray

    def cast(self, ray):
        t = self.scene.ray_intersect_preliminary(ray, coherent=True).t
        self.drjit.eval(t)
        self.drjit.sync_thread()
        return t


def measure(settings):
    peers.require_mitsuba()
    isospline.set_thread_count(settings.threads)
    threads = isospline.thread_count()
    for subject in map(subjects.cubic, settings.subjects()):
        volume = isospline.Volume(subject.data, **subject.grid)
        trilinear = isospline.Volume(subject.data, degree=1, **subject.grid)
        scene = isospline.Scene([isospline.Isosurface(volume, subject.level)])
        linear_scene = isospline.Scene([isospline.Isosurface(trilinear, subject.level)])
        grid = SdfGrid(subject, volume.affine, threads)
        for view, make_camera in CAMERAS.items():
            rays = in_tiles(make_camera(scene, settings.size).rays(settings.size))
            theirs = grid.rays(rays)
            seconds, answers = take_turns(
                {
                    "degree 2": lambda r=rays: scene.cast_rays(r, coherent=True),
                    "degree 1": lambda r=rays: linear_scene.cast_rays(r, coherent=True),
                    "sdfgrid": lambda r=theirs: grid.cast(r),
                },
                settings.repetitions,
            )
            yield {
                "subject": subject.name,
                "view": view,
                "rays": len(rays),
                "threads": threads,
                "mray_per_second": {name: rates(len(rays), seconds[name]) for name in seconds},
            } | check(answers["sdfgrid"].numpy(), answers["degree 1"]["t_hit"], rays, volume)


def check(theirs, ours, rays, volume):
    """Check that Mitsuba traces about the same trilinear surface: it computes in single precision."""
    both = np.isfinite(theirs) & np.isfinite(ours)
    voxels_per_t = np.linalg.norm(rays[:, 3:] @ np.linalg.inv(volume.affine)[:3, :3].T, axis=1)
    distance = float(np.median(np.abs(theirs[both] - ours[both]) * voxels_per_t[both]))
    one_alone = float((np.isfinite(theirs) != np.isfinite(ours)).mean())
    assert distance < 0.01 and one_alone < 0.05, f"Mitsuba sees another surface: {distance} voxels, {one_alone:.1%}"
    return {"median_distance": distance, "one_alone": one_alone}


def ratio(result, name="degree 2"):
    return result["mray_per_second"][name]["median"] / result["mray_per_second"]["sdfgrid"]["median"]


def goals(results):
    return [at_least(GOALS[0][0], 4, {f"{result['subject']}, {result['view']}": ratio(result) for result in results})]


def table(results):
    rows = [
        (
            result["subject"],
            result["view"],
            *(with_spread(rate) for rate in result["mray_per_second"].values()),
            ratio(result),
            ratio(result, "degree 1"),
            result["median_distance"],
            f"{result['one_alone']:.2%}",
        )
        for result in results
    ]
    return markdown_table(
        (
            "volume",
            "view",
            "degree 2, Mray/s",
            "degree 1, Mray/s",
            "sdfgrid, Mray/s",
            "ratio",
            "ratio of degree 1",
            "distance",
            "one alone",
        ),
        rows,
    )
