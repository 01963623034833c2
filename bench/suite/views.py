"""Rays to measure with: two views in tiles, cosine-distributed ones from a surface, isotropic lines."""

import numpy as np

import isospline

FIELD_OF_VIEW = 30.0  # degrees, vertical
TILE = 4  # pixels; a tile of 4 x 4 is a packet of 16


def in_tiles(rays):
    """Rays [row, column, 6] of an image as (N, 6), tile after tile, and row by row within a tile. Rays that are
    neighbours in the list are then neighbours in the picture in both directions, which packets need."""
    height, width, _ = rays.shape
    if height % TILE or width % TILE:
        raise ValueError(f"size: expected multiples of {TILE}, got {width} x {height}")
    tiles = rays.reshape(height // TILE, TILE, width // TILE, TILE, 6).swapaxes(1, 2)
    return np.ascontiguousarray(tiles.reshape(-1, 6))


def whole_camera(scene, size):
    """A perspective view of a scene's box, or of a given box, whose corners are inside a margin of a twentieth.

    Not that of `camera_for`, which looks at what is drawn: rows keep their rays, whatever is thought to look best.
    """
    lower, upper = np.asarray(getattr(scene, "bounds", scene), dtype=float)
    center, direction = (lower + upper) / 2, np.array([1, -1, 1]) / np.sqrt(3)
    trial = isospline.PerspectiveCamera(direction, (0, 0, 0), (0, 0, 1), FIELD_OF_VIEW)
    right, upwards, forward = trial.world_to_camera[:3, :3]
    corners = np.stack(np.meshgrid(*zip(lower - center, upper - center), indexing="ij"), axis=-1).reshape(-1, 3)
    x, y, z = np.abs(corners @ right), np.abs(corners @ upwards), corners @ forward
    half_height = np.tan(np.radians(FIELD_OF_VIEW) / 2) * 0.95
    distance = max((y / half_height - z).max(), (x / half_height * size[1] / size[0] - z).max())
    return isospline.PerspectiveCamera(center + direction * distance, center, (0, 0, 1), FIELD_OF_VIEW)


def close_camera(scene, size):
    """A view straight at a place of the surface, from so near that every ray hits. Tries places that the whole view
    sees, and distances from a twentieth of the box's diagonal downwards; returns the first view where all rays hit, or
    else the one with the most hits."""
    rays = in_tiles(whole_camera(scene, (128, 128)).rays((128, 128)))
    hits = scene.cast_rays(rays, coherent=True)
    found = np.flatnonzero(np.isfinite(hits["t_hit"]))
    if len(found) == 0:
        raise ValueError("subject: expected a surface that the whole view sees, got none")
    chosen = np.random.default_rng(0).choice(found, min(48, len(found)), replace=False)
    diagonal = np.linalg.norm(np.diff(scene.bounds, axis=0))
    best, best_share = None, -1.0
    for distance in (0.05, 0.025, 0.0125):
        for i in chosen:
            target = rays[i, :3] + hits["t_hit"][i] * rays[i, 3:]
            normal = towards_the_eye(hits["primitive_normals"][i], rays[i, 3:])
            up = (0, 0, 1) if abs(normal[2]) < 0.9 else (0, 1, 0)
            camera = isospline.PerspectiveCamera(target + distance * diagonal * normal, target, up, 40.0)
            trial = scene.cast_rays(camera.rays((32, 32)), coherent=False)
            share = np.isfinite(trial["t_hit"]).mean()
            if share > best_share:
                best, best_share = camera, share
            if share == 1.0:
                return best
    return best


CAMERAS = {"whole": whole_camera, "close": close_camera}


def towards_the_eye(normals, directions):
    """Normals, flipped to face the rays that hit there."""
    return normals * -np.sign((normals * directions).sum(axis=-1, keepdims=True))


def from_the_surface(rays, hits, count, generator, offset):
    """`count` rays of the density cos / pi about the normal, as those of ambient occlusion, from where rays hit, in
    their order; they start `offset` in front of the surface."""
    hit = np.flatnonzero(np.isfinite(hits["t_hit"]))
    hit = hit[np.sort(np.arange(count) % len(hit))]
    normals = towards_the_eye(hits["primitive_normals"][hit], rays[hit, 3:])
    origins = rays[hit, :3] + hits["t_hit"][hit, None] * rays[hit, 3:] + offset * normals
    directions = normals + unit(generator.normal(size=normals.shape))
    return np.concatenate([origins, unit(directions)], axis=1)


def isotropic_lines(bounds, count, generator):
    """Rays (N, 6) along lines that are uniform and isotropic among those that meet the ball around a box."""
    centre, radius = bounds.mean(axis=0), np.linalg.norm(np.diff(bounds, axis=0)) / 2
    directions, others = (unit(generator.normal(size=(count, 3))) for _ in range(2))
    u = unit(np.cross(directions, others))
    v = np.cross(directions, u)
    distance = radius * np.sqrt(generator.uniform(size=(count, 1)))
    angle = generator.uniform(0, 2 * np.pi, (count, 1))
    origins = centre + distance * (np.cos(angle) * u + np.sin(angle) * v) - 2 * radius * directions
    return np.concatenate([origins, directions], axis=1)


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
