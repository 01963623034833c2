"""The gradient of a depth map by all samples, beside Mitsuba 3's `sdfgrid`."""

import numpy as np
from suite import peers, subjects
from suite.clock import spread, take_turns
from suite.goal import at_most
from suite.tables import markdown_table, with_spread
from suite.views import CAMERAS, in_tiles

import isospline
from isospline.derivatives import cast_vjp

from .mitsuba import SdfGrid

TITLE = "Derivatives"
ABOUT = """The gradient of the sum of t over rays that hit, by all samples of the volume: `derivatives.cast_vjp` with
degrees 1 and 2, and Mitsuba's reverse mode (llvm_ad_rgb, single precision), on the same number of threads. The
directions have unit length in the space of Mitsuba's grid, which is trilinear, as degree 1 is. *Error* is that of the
gradient's sum, which is the derivative by the level: the largest difference from the mean of differences of t, of the
same tracer at two levels, relative to it. Rays whose t at the level between is not near the middle of these two are
left out: at outlines, differences say nothing. Neither has the outline here; Mitsuba has none for `sdfgrid`."""
SETTINGS = ("size", "repetitions", "threads")
GOALS = [
    ("error of the derivative by the level, against Mitsuba 3 sdfgrid", "at most 0.1 times"),
]
#: The step of differences, in parts of the data's range.
STEP = 1e-3


class DifferentiableSdfGrid(SdfGrid):
    """The subject in Mitsuba, with its gradient."""

    def __init__(self, subject, affine, threads):
        super().__init__(subject, affine, threads)
        self.range = float(np.ptp(np.asarray(subject.data, dtype=np.float32)))
        self.parameters = self.mitsuba.traverse(self.scene)
        self.values = self.mitsuba.TensorXf(self.parameters["shape.grid"])

    def cast_at(self, ray, shift):
        """t with all values shifted; then they are as before."""
        self.parameters["shape.grid"] = self.values + np.float32(shift)
        self.parameters.update()
        found = self.cast(ray).numpy()
        self.parameters["shape.grid"] = self.values
        self.parameters.update()
        return found

    def gradient(self, ray, weights):
        """The gradient of the sum of weights times t, by the values of the grid."""
        grid = self.mitsuba.TensorXf(self.values)
        self.drjit.enable_grad(grid)
        self.parameters["shape.grid"] = grid
        self.parameters.update()
        flags = int(self.mitsuba.RayFlags.All)
        found = self.scene.ray_intersect(ray, ray_flags=flags, coherent=True)
        self.drjit.backward(self.drjit.sum(self.drjit.select(found.is_valid(), found.t * weights, 0)))
        return self.drjit.grad(grid).numpy()


def measure(settings):
    peers.require_mitsuba()
    isospline.set_thread_count(settings.threads)
    threads = isospline.thread_count()
    for subject in map(subjects.cubic, settings.subjects()):
        scenes = {}
        for degree in (2, 1):
            volume = isospline.Volume(subject.data, degree=degree, **subject.grid)
            scenes[f"degree {degree}"] = isospline.Scene([isospline.Isosurface(volume, subject.level)])
        grid = DifferentiableSdfGrid(subject, volume.affine, threads)
        for view, make_camera in CAMERAS.items():
            rays = in_tiles(make_camera(scenes["degree 1"], settings.size).rays(settings.size))
            rays[:, 3:] /= np.linalg.norm(rays[:, 3:] @ grid.to_index[:3, :3].T, axis=1, keepdims=True)
            yield {"subject": subject.name, "view": view, "rays": len(rays), "threads": threads} | compare(
                scenes, grid, rays, grid.rays(rays), settings.repetitions
            )


def compare(scenes, grid, rays, theirs, repetitions):
    """Times, and errors of the derivative by the level."""
    step = STEP * grid.range
    kept, slopes, ways = {}, {}, {}
    for name, scene in scenes.items():
        surface = scene.object(0)
        ends = [surface.with_level(surface.level + way * step) for way in (-1, 1)]
        before, after = (isospline.Scene([end]).cast_rays(rays).t_hit for end in ends)
        kept[name], slopes[name] = slope(before, scene.cast_rays(rays).t_hit, after, step)
        ways[name] = lambda name=name, scene=scene: gradient(scene, rays, kept[name])
    # Their values are (level - data) / range: they grow with the level.
    kept["sdfgrid"], slopes["sdfgrid"] = slope(*(grid.cast_at(theirs, way * STEP) for way in (-1, 0, 1)), step)
    weights = grid.mitsuba.Float(kept["sdfgrid"].astype(np.float32))
    ways["sdfgrid"] = lambda: grid.gradient(theirs, weights)
    seconds, found = take_turns(ways, repetitions)
    by_level = {name: -found[name].sum() for name in scenes} | {"sdfgrid": found["sdfgrid"].sum() / grid.range}
    return {
        "seconds": {name: spread(times) for name, times in seconds.items()},
        "error": {name: abs(float(by_level[name] / slopes[name] - 1)) for name in ways},
    }


def slope(before, middle, after, step):
    """Which rays hit the same surface at all levels, with t nearly linear, and the derivative of the sum of their t."""
    with np.errstate(invalid="ignore"):
        bend = np.abs(after.astype(float) - 2.0 * middle + before)
        near = np.isfinite(bend) & (bend < 0.05 * np.abs(after - before)) & (np.abs(after - before) < 1.0)
    return near, float((after[near].astype(float) - before[near]).sum() / (2 * step))


def gradient(scene, rays, kept):
    _, vjp = cast_vjp(scene, rays, coherent=True)
    return vjp(t_hit=kept.astype(float))["samples"][0]


def ratio(result):
    return result["seconds"]["sdfgrid"]["median"] / result["seconds"]["degree 1"]["median"]


def goals(results):
    def by_case(number):
        return {f"{result['subject']}, {result['view']}": number(result) for result in results}

    def share(result):
        return result["error"]["degree 1"] / result["error"]["sdfgrid"]

    return [at_most(GOALS[0][0], 0.1, by_case(share), "times")]


def table(results):
    names = ("degree 2", "degree 1", "sdfgrid")
    return markdown_table(
        ("volume", "view", *(f"{name}, s" for name in names), "ratio", *(f"error of {name}" for name in names)),
        [
            (
                result["subject"],
                result["view"],
                *(with_spread(result["seconds"][name]) for name in names),
                ratio(result),
                *(f"{result['error'][name]:.1e}" for name in names),
            )
            for result in results
        ],
    )
