"""Bone and an implant: a volume and a mesh in one scene, the bone cut open with a cap, on a floor with shadows."""

from pathlib import Path

import numpy as np

import isospline
from isospline import volumes


def bone(samples: int) -> isospline.Volume:
    """A block with a dense wall around a sponge, above 0 inside: a rounded box with a gyroid in it."""
    z, y, x = np.mgrid[-1 : 1 : samples * 1j, -1 : 1 : samples * 1j, -1 : 1 : samples * 1j]
    depth = 0.6 - 0.6 * ((x / 0.95) ** 6 + (y / 0.6) ** 6 + (z / 0.6) ** 6) ** (1 / 6)
    sponge = 0.55 - np.abs(volumes.gyroid(periods=6).value(np.stack([x, y, z], axis=-1)))
    data = np.minimum(depth, np.maximum(0.09 - depth, 0.08 * sponge))
    return isospline.Volume(data, spacing=(2 / (samples - 1),) * 3, origin=(-1, -1, -1))


def screw(turns: int = 11, length: float = 1.2, around: int = 96, along: int = 600) -> isospline.Mesh:
    """A surface of revolution about z with a thread, closed at its ends."""
    u, angle = np.meshgrid(np.linspace(0, 1, along), np.linspace(0, 2 * np.pi, around, endpoint=False), indexing="ij")
    thread = np.abs((turns * u / 0.8 - angle / (2 * np.pi)) % 1 - 0.5)
    core = np.where(u < 0.8, 0.13 + 0.05 * np.minimum(u / 0.3, 1) + 0.1 * thread * (u > 0.03), 0.24)
    radius = core * ((u > 0) & (u < 1))
    vertices = np.stack([radius * np.cos(angle), radius * np.sin(angle), length * u - 0.4], axis=-1)
    a = np.arange(along * around).reshape(along, around)
    b, c, d = np.roll(a, -1, 1)[:-1], np.roll(a, -1, 1)[1:], a[1:]
    faces = np.concatenate([np.stack([a[:-1], b, c], -1), np.stack([a[:-1], c, d], -1)]).reshape(-1, 3)
    return isospline.Mesh(vertices.reshape(-1, 3), faces)


def main(samples: int = 160, size: tuple[int, int] = (640, 440), folder: str = "out") -> None:
    scene = isospline.Scene()
    front = isospline.HalfSpace((0, 0, 0), normal=(0, 1, 0))  # keeps what lies behind y = 0
    jaw = scene.add(isospline.Isosurface(bone(samples), 0.0, clip=front, capped=True))
    implant = scene.add(screw())
    floor = scene.add(
        isospline.Mesh([(-60, -60, -0.6), (60, -60, -0.6), (60, 60, -0.6), (-60, 60, -0.6)], [(0, 1, 2), (0, 2, 3)])
    )
    lights = [isospline.DirectionalLight((0.6, 0.9, -1.1)), isospline.PositionalLight((-4, -5, 2), intensity=0.35)]
    lit = isospline.Phong(lights=lights, shadows=True)
    shading = {
        jaw: lit.replace(color=(0.93, 0.86, 0.72), cap_color=(0.85, 0.45, 0.38), ambient=0.12),
        implant: lit.replace(color=(0.6, 0.65, 0.72), specular=0.6, ambient=0.1),
        floor: lit.replace(color=(0.5, 0.56, 0.6), specular=0, ambient=0.2),
    }
    camera = isospline.PerspectiveCamera(eye=(1.3, -4.2, 1.7), target=(0, 0, 0.08), field_of_view=25)
    image = isospline.render(scene, camera, size=size, light=shading, background=(0.5, 0.56, 0.6), samples=9)
    Path(folder).mkdir(exist_ok=True)
    image.write(Path(folder) / "185-implant.png")


if __name__ == "__main__":
    main()
