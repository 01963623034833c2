"""Accuracy: the position of hits against the float64 oracle, from near and distant eyes."""

import numpy as np
from suite import judge
from suite.goal import at_most
from suite.oracle import Oracle
from suite.tables import markdown_table
from suite.views import isotropic_lines

import isospline

TITLE = "Position of the hit"
ABOUT = """Isotropic lines through the volume, traced as packets and as single rays. Their origins are moved back, so
that the eye is 1 to 10^4 voxels from the box. The oracle (NumPy and SciPy alone) cuts the polynomial along each ray
where its derivative vanishes; it computes in float64, and the ray is in extended precision. *Error* is the largest
distance along the ray, in voxels, over all hits, including grazing ones; the oracle uses the coefficients that
isospline stores (float32, less the middle of the data's range). *Model* is the same with float64 coefficients, which
shows what rounding the coefficients costs. Lost and wrong are defined as for primary rays."""
SETTINGS = ("accuracy_rays",)
GOALS = [("position of the hit against the float64 oracle", "at most 1e-06 voxel")]
DISTANCES = (1, 100, 10_000)


def measure(settings):
    isospline.set_thread_count(0)
    for subject in settings.subjects():
        volume = isospline.Volume(subject.data, **subject.grid)
        scene = isospline.Scene([isospline.Isosurface(volume, subject.level)])
        stored = Oracle(subject.data, subject.level, volume.affine, coefficients=volume.coefficients)
        model = Oracle(subject.data, subject.level, volume.affine)
        for distance in DISTANCES:
            rays = isotropic_lines(volume.bounds, settings.accuracy_rays, np.random.default_rng(distance))
            rays[:, :3] -= distance * np.linalg.norm(volume.affine[:3, 0]) * rays[:, 3:]
            yield {"subject": subject.name, "eye": distance} | compare(scene, rays, stored, model)


def compare(scene, rays, stored, model):
    voxels_per_t = stored.voxels_per_t(rays)
    t_true, t_model = stored.first_crossings(rays), model.first_crossings(rays)
    result = {"rays": len(rays), "hits": int(np.isfinite(t_true).sum())}
    for name, coherent in (("packets", True), ("single", False)):
        hits = scene.cast_rays(rays, coherent=coherent)
        result[name] = judge.differences(hits["t_hit"], t_true, voxels_per_t)
        apart = judge.distances(hits["t_hit"], t_model, voxels_per_t)
        result[name]["model_distance_max"] = float(apart[np.isfinite(apart)].max(initial=0))
    return result


def goals(results):
    errors = {
        f"{result['subject']}, eye {result['eye']} voxels away": max(
            np.inf if result[name]["lost"] + result[name]["wrong"] else result[name]["distance_max"] or 0.0
            for name in ("packets", "single")
        )
        for result in results
    }
    return [at_most(GOALS[0][0], 1e-6, errors, "voxel")]


def table(results):
    rows = [
        (
            result["subject"],
            result["eye"],
            result["hits"],
            *(result[name][key] for name in ("packets", "single") for key in ("distance_max", "model_distance_max")),
            sum(result[name][kind] for name in ("packets", "single") for kind in ("lost", "wrong")),
        )
        for result in results
    ]
    header = (
        "volume",
        "eye, voxels away",
        "hits",
        "error, packets",
        "model",
        "error, single",
        "model",
        "lost or wrong",
    )
    return markdown_table(header, rows)
