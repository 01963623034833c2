"""The rays: whole object and close-up, and the isotropic lines of the hop length."""

import numpy as np

import isospline


def whole_view(scene, size):
    """Primary rays (N, 6) of a perspective view of all of a scene."""
    return isospline.camera_for(scene, view="iso", size=size).rays(size).reshape(-1, 6)


def close_view(scene, size):
    """Primary rays of the same view from near by: the eye is a twentieth of the box's diagonal in front of the surface,
    which it looks at where the whole view has it nearest to the image's centre. None where no ray hits."""
    rays = whole_view(scene, size)
    hits = scene.cast_rays(rays)
    found = np.flatnonzero(np.isfinite(hits["t_hit"]))
    if len(found) == 0:
        return None
    forward = rays[:, 3:] / np.linalg.norm(rays[:, 3:], axis=1, keepdims=True)
    central = found[np.argmax(forward[found] @ forward[(size[1] // 2) * size[0] + size[0] // 2])]
    target = rays[central, :3] + hits["t_hit"][central] * rays[central, 3:]
    diagonal = np.linalg.norm(np.diff(scene.bounds, axis=0))
    eye = target - 0.05 * diagonal * forward[central]
    return isospline.PerspectiveCamera(eye, target, (0, 0, 1), 60.0).rays(size).reshape(-1, 6)


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
