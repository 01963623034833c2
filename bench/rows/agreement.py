"""Agreement: packets, single rays, the float64 path and the hopper report the same hits."""

import numpy as np

import isospline
from suite import judge, subjects
from suite.goal import none_of
from suite.tables import markdown_table
from suite.views import in_tiles, isotropic_lines, unit

TITLE = "Agreement of the paths"
ABOUT = """The same rays through packets, single rays, `method="reference"` (float64, no SIMD) and the hopper, over
all real volumes and two procedural ones: in turns isotropic lines, images from random eyes in tiles, rays from
within, and rays aimed at corners of cells. A ray differs where one path hits alone or the hits are more than 1e-3
voxel apart; the largest distance of the others is given."""
GOALS = [("hits that differ between packet, single ray, float64 path and hopper", "0")]
CHUNK = 1 << 18
PATHS = ("packets", "reference", "hopper")  # each compared with single rays


def measure(settings):
    isospline.set_thread_count(0)
    procedural = subjects.procedural(("waves", "heart"), (96,))
    real = subjects.real(settings.volumes) if settings.volumes != "none" else ()
    for chosen in (procedural, real):
        for subject in chosen:
            yield {"subject": subject.name} | compare(subject, settings.agreement_rays, np.random.default_rng(0))


def compare(subject, count, generator):
    volume = isospline.Volume(subject.data, **subject.grid)
    surface = isospline.Isosurface(volume, subject.level)
    scene, hopper = isospline.Scene([surface]), isospline.VoxelHopper(surface)
    reference = isospline.Scene([isospline.Isosurface(volume, subject.level, method="reference")])
    to_index = np.linalg.inv(volume.affine)[:3, :3].T
    found = {path: {"differ": 0, "distance_max": 0.0} for path in PATHS}
    hit, examples = 0, []
    for done in range(0, count, CHUNK):
        rays = mixed_rays(surface, scene.bounds, min(CHUNK, count - done), generator)
        t_single = scene.cast_rays(rays, coherent=False)["t_hit"]
        hit += int(np.isfinite(t_single).sum())
        voxels_per_t = np.linalg.norm(rays[:, 3:] @ to_index, axis=1)
        for path, t_hit in (
            ("packets", scene.cast_rays(rays, coherent=True)["t_hit"]),
            ("reference", reference.cast_rays(rays, coherent=False)["t_hit"]),
            ("hopper", hopper.cast_rays(rays)["t_hit"]),
        ):
            apart = judge.distances(t_hit, t_single, voxels_per_t)
            wrong = apart > judge.TOLERANCE
            found[path]["differ"] += int(wrong.sum())
            found[path]["distance_max"] = max(found[path]["distance_max"], float(apart[~wrong].max(initial=0)))
            examples += [
                {"path": path, "ray": rays[i].tolist(), "t": t_hit[i], "t_single": t_single[i]}
                for i in np.flatnonzero(wrong)[: max(0, 5 - len(examples))]
            ]
    return {"rays": count, "hit": hit / count, "paths": found, "examples": examples}


def mixed_rays(surface, bounds, count, generator):
    """Rays of four kinds, a quarter each."""
    quarter = -(-count // 4)
    size = np.diff(bounds, axis=0)[0]
    inside = bounds[0] + generator.uniform(size=(quarter, 3)) * size
    kinds = [
        isotropic_lines(bounds, quarter, generator),
        random_image(bounds, quarter, generator),
        np.concatenate([inside, unit(generator.normal(size=(quarter, 3)))], axis=1),
        aimed_rays(surface, inside, generator),
    ]
    return np.concatenate(kinds)[:count]


def random_image(bounds, count, generator):
    """Rays of an image from a random eye around the box, in tiles."""
    width = 4 * int(np.ceil(np.sqrt(count) / 4))
    centre, radius = bounds.mean(axis=0), np.linalg.norm(np.diff(bounds, axis=0)) / 2
    direction = unit(generator.normal(size=(1, 3)))[0]
    eye = centre + generator.uniform(0.5, 4) * radius * direction
    target = bounds[0] + generator.uniform(size=3) * np.diff(bounds, axis=0)[0]
    up = (0, 0, 1) if abs(direction[2]) < 0.9 else (0, 1, 0)
    camera = isospline.PerspectiveCamera(eye, target, up, generator.uniform(5, 60))
    return in_tiles(camera.rays((width, width)))[:count]


def aimed_rays(surface, origins, generator):
    """From each origin towards a corner of a random cell of the shell."""
    affine = surface.volume.affine
    return np.concatenate([origins, corners(surface, len(origins), generator) @ affine[:3, :3].T + affine[:3, 3]
                           - origins], axis=1)  # fmt: skip


def corners(surface, count, generator):
    """Corners of random cells of the shell, in index space."""
    cells = surface.shell.cells[generator.integers(surface.shell.count, size=count)]
    return cells + generator.integers(2, size=(count, 3)) - (0.5 if surface.volume.degree % 2 == 0 else 0.0)


def goals(results):
    differing = {
        f"{result['subject']}, {path}": found["differ"] for result in results for path, found in result["paths"].items()
    }
    return [none_of(GOALS[0][0], differing, sum(result["rays"] for result in results))]


def table(results):
    rows = [
        (result["subject"], result["rays"], f"{result['hit']:.0%}",
         *(result["paths"][path][key] for key in ("differ", "distance_max") for path in PATHS))
        for result in results
    ]  # fmt: skip
    columns = (f"{path}{what}" for what in (" differ", ", largest distance") for path in PATHS)
    header = ("volume", "rays", "hit", *columns)
    return markdown_table(header, rows)
