"""Agreement: packets, single rays, the float64 path and the hopper report the same hits."""

import numpy as np
from suite import subjects
from suite.goal import none_of
from suite.tables import markdown_table
from suite.views import in_tiles, isotropic_lines, unit

import isospline

TITLE = "Agreement of the paths"
ABOUT = """The same rays through packets, single rays, `method="reference"` (float64, no SIMD) and the hopper, over all
real volumes and two procedural ones. There are four kinds of rays in equal numbers: isotropic lines, images from random
eyes in tiles, rays from within, and rays aimed at corners of cells. A tenth of the rays are degenerate: in faces, along
edges, through corners of cells, and parallel to axes. A ray differs where t, the geometry id, the primitive id or the
normal are not exactly the same."""
SETTINGS = ("agreement_rays",)
GOALS = [("hits that differ between packet, single ray, float64 path and hopper", "0")]
CHUNK = 1 << 18
PATHS = ("packets", "reference", "hopper", "occlusions")  # each compared with single rays
COMPARED = ("t_hit", "geometry_ids", "primitive_ids", "primitive_normals")


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
    scene, hopper = isospline.Scene([surface]), isospline.research.VoxelHopper(surface)
    reference = isospline.Scene([isospline.research.isosurface(volume, subject.level, method="reference")])
    differing = dict.fromkeys(PATHS, 0)
    hit, examples = 0, []
    for done in range(0, count, CHUNK):
        rays = mixed_rays(surface, scene.bounds, min(CHUNK, count - done), generator)
        single = scene.cast_rays(rays, coherent=False)
        hit += int(np.isfinite(single["t_hit"]).sum())
        for path, hits in (
            ("packets", scene.cast_rays(rays, coherent=True)),
            ("reference", reference.cast_rays(rays, coherent=False)),
            ("hopper", hopper.cast_rays(rays)),
        ):
            differs = np.zeros(len(rays), bool)
            for key in COMPARED:
                differs |= (hits[key] != single[key]).reshape(len(rays), -1).any(axis=1)
            differing[path] += int(differs.sum())
            examples += [
                {"path": path, "ray": rays[i].tolist()}
                | {key: (hits[key][i].tolist(), single[key][i].tolist()) for key in COMPARED}
                for i in np.flatnonzero(differs)[: max(0, 5 - len(examples))]
            ]
        differing["occlusions"] += count_wrong_occlusions(scene, rays, single)
    return {"rays": count, "hit": hit / count, "differing": differing, "examples": examples}


def count_wrong_occlusions(scene, rays, hits):
    """Rays that are occluded but hit nothing, or the reverse; and rays from hits to a light of which packets and single
    rays say different things."""
    found = np.isfinite(hits["t_hit"])
    light = np.add(*scene.bounds) / 2 + 2 * np.diff(scene.bounds, axis=0)[0]
    rays_that_hit, of_hits = rays[found], {name: hits[name][found] for name in COMPARED}
    positions = rays_that_hit[:, :3] + of_hits["t_hit"][:, None] * rays_that_hit[:, 3:]
    shadow = scene.secondary_rays(rays_that_hit, of_hits, light - positions)
    wrong = 0
    for tested, expected in ((rays, found), (shadow, scene.test_occlusions(shadow))):
        differs = scene.test_occlusions(tested) != expected
        differs |= scene.test_occlusions(tested, coherent=True) != expected
        wrong += int(differs.sum())
    return wrong


def mixed_rays(surface, bounds, count, generator):
    """Rays of four kinds in equal numbers, a tenth of them degenerate."""
    degenerate, quarter = count // 10, -(-(count - count // 10) // 4)
    size = np.diff(bounds, axis=0)[0]
    inside = bounds[0] + generator.uniform(size=(quarter, 3)) * size
    kinds = [
        degenerate_rays(surface, degenerate, generator),
        isotropic_lines(bounds, quarter, generator),
        random_image(bounds, quarter, generator),
        np.concatenate([inside, unit(generator.normal(size=(quarter, 3)))], axis=1),
        aimed_rays(surface, inside, generator),
    ]
    return np.concatenate(kinds)[:count]


def degenerate_rays(surface, count, generator):
    """Through corners of cells of the shell: parallel to axes, along diagonals, in planes of faces."""
    through, directions = corners(surface, count, generator), generator.normal(size=(count, 3))
    kind, row = generator.integers(4, size=count), np.arange(count)
    axis = generator.integers(3, size=count)
    directions[kind < 2] = 0
    directions[row[kind < 2], axis[kind < 2]] = 1  # along an axis: on an edge, or in a face next to one
    through[row[kind == 1], (axis[kind == 1] + 1) % 3] += generator.uniform(size=int((kind == 1).sum()))
    directions[kind == 2] = generator.integers(-1, 2, size=(int((kind == 2).sum()), 3))
    directions[(directions == 0).all(axis=1)] = 1
    directions[row[kind == 3], axis[kind == 3]] = 0
    directions *= generator.choice((-1, 1), size=(count, 1))
    length = np.linalg.norm(directions, axis=1, keepdims=True)
    origins = through - directions / length * np.linalg.norm(surface.volume.shape)
    affine = surface.volume.affine
    return np.concatenate([origins @ affine[:3, :3].T + affine[:3, 3], directions @ affine[:3, :3].T], axis=1)


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
    return np.concatenate(
        [origins, corners(surface, len(origins), generator) @ affine[:3, :3].T + affine[:3, 3] - origins], axis=1
    )


def corners(surface, count, generator):
    """Corners of random cells of the shell, in index space."""
    cells = surface.shell.cells[generator.integers(surface.shell.count, size=count)]
    return cells + generator.integers(2, size=(count, 3)) - (0.5 if surface.volume.degree % 2 == 0 else 0.0)


def goals(results):
    differing = {
        f"{result['subject']}, {path}": count for result in results for path, count in result["differing"].items()
    }
    return [none_of(GOALS[0][0], differing, sum(result["rays"] for result in results))]


def table(results):
    paths = [path for path in PATHS if all(path in result["differing"] for result in results)]
    rows = [
        (result["subject"], result["rays"], f"{result['hit']:.0%}", *(result["differing"][path] for path in paths))
        for result in results
    ]
    return markdown_table(("volume", "rays", "hit", *(f"{path} differ" for path in paths)), rows)
