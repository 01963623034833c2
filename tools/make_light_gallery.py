"""Renders the pictures of light, docs/images/light.png, from the real volumes in the folder ISOSPLINE_VOLUMES.

Hard shadows, ambient occlusion, and two path traced pictures: bone on a table, and a heart.
"""

import os
from pathlib import Path

import numpy as np
from PIL import Image

import isospline
from isospline import volumes

FOLDER = Path(os.environ["ISOSPLINE_VOLUMES"])
SIZE = (480, 400)


def table(under, z=None):
    """A square in a plane of constant z, by default at the least z of a surface."""
    lower, upper = isospline.Scene([under]).bounds
    reach = 3 * np.max(upper - lower)
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]) * reach + (lower + upper) / 2
    corners[:, 2] = lower[2] if z is None else z
    return isospline.Mesh(corners, [(0, 1, 2), (0, 2, 3)])


def surface(name, level, **options):
    return isospline.Isosurface(isospline.read_volume(FOLDER / name).to_volume(), level, **options)


def camera_of(only, view, up=None):
    return isospline.camera_for(isospline.Scene([only]), view=view, up=up, size=SIZE)


def tile(image):
    return Image.fromarray(image.to_srgb()).convert("RGB")


def hard_shadows():
    engine = surface("engine.nii.gz", 80)
    lights = [isospline.DirectionalLight((0.5, 1, -1.2)), isospline.DirectionalLight((-1, 0.6, -1), intensity=0.25)]
    shading = {
        0: isospline.Phong(color=(0.55, 0.65, 0.8), lights=lights, shadows=True, ambient=0.15),
        1: isospline.Phong(color=(0.9, 0.88, 0.84), lights=lights, shadows=True, ambient=0.15, specular=0),
    }
    scene = isospline.Scene([engine, table(engine)])
    return isospline.render(scene, camera_of(engine, (1, -1, 0.8)), size=SIZE, shading=shading, samples=9, background=0.7)


def ambient_occlusion():
    skull = surface("mouse_skull.nrrd", 40)
    shading = isospline.AmbientOcclusion(64, color=(0.95, 0.92, 0.85))
    return isospline.render(
        isospline.Scene([skull]), camera_of(skull, (1, -0.6, 0.5)), size=SIZE, shading=shading, samples=4, background=0.03
    )


def bone():
    head = surface("headsq.mha", 1150)
    lower, upper = isospline.Scene([head]).bounds
    ground = table(head, z=upper[2])  # the head stands in the direction of -z
    size, center = np.max(upper - lower), (lower + upper) / 2
    lamp = isospline.SphereLight(center + size * np.array((1.6, 1.5, -1.4)), 0.35 * size, radiance=26)
    integrator = isospline.PathTracer(
        materials={
            0: isospline.Material((0.87, 0.8, 0.64), roughness=0.45),
            1: isospline.Material((0.32, 0.36, 0.42), roughness=0.35),
        },
        lights=[lamp, isospline.EnvironmentLight((0.35, 0.4, 0.5))],
    )
    camera = camera_of(head, (-0.5, 1, -0.25), up=(0, 0, -1))
    scene = isospline.Scene([head, ground])
    return isospline.render(
        scene, camera, size=SIZE, integrator=integrator, samples=128, background=(0.3, 0.33, 0.4)
    )


def heart():
    field = volumes.heart()
    model = isospline.Isosurface(isospline.Volume(field.samples(160), **field.grid(160)), field.level)
    sky = np.linspace((0.9, 0.95, 1.0), (0.5, 0.45, 0.4), 16)[:, None].repeat(32, axis=1)
    integrator = isospline.PathTracer(
        materials={
            0: isospline.Material((1.0, 0.71, 0.29), metallic=1, roughness=0.3),
            1: isospline.Material((0.75, 0.75, 0.72), roughness=0.7),
        },
        lights=[
            isospline.RectangleLight((-5, -5, 4), (0, 2, 1.5), (2.5, 0, 0), radiance=22),
            isospline.EnvironmentLight(0.5, image=sky),
        ],
    )
    camera = isospline.PerspectiveCamera(eye=(1.5, -6, 2.2), target=(0, 0, -0.1), field_of_view=24)
    scene = isospline.Scene([model, table(model, z=-1.0)])
    return isospline.render(
        scene, camera, size=SIZE, integrator=integrator, samples=256, background=(0.45, 0.47, 0.5)
    )


if __name__ == "__main__":
    gallery = Image.new("RGB", (2 * SIZE[0], 2 * SIZE[1]))
    for number, make in enumerate((hard_shadows, ambient_occlusion, bone, heart)):
        gallery.paste(tile(make()), ((number % 2) * SIZE[0], (number // 2) * SIZE[1]))
    gallery.save(Path(__file__).parents[1] / "docs" / "images" / "light.png", optimize=True)
