"""Counts above 32 bits, and sizes beyond memory, are errors at once. Arrays are views of one item."""

import numpy as np
import pytest

import isospline

MANY = 2**32


def repeated(item, *shape):
    return np.broadcast_to(np.asarray(item), (*shape, *np.shape(item)))


def test_meshes_that_embree_cannot_count():
    triangle = np.eye(3)
    with pytest.raises(ValueError, match="^faces: expected at most 4294967295"):
        isospline.Mesh(triangle, repeated((0, 1, 2), MANY))
    with pytest.raises(ValueError, match="^vertices: expected at most 4294967295"):
        isospline.Mesh(repeated((0.0, 1.0, 2.0), MANY), [(0, 1, 2)])
    for name in ("normals", "colors"):
        with pytest.raises(ValueError, match=f"^{name}: expected at most 4294967295, got 4294967296"):
            isospline.Mesh(triangle, [(0, 1, 2)], **{name: repeated((0.0, 1.0, 0.5), MANY)})


@pytest.mark.parametrize(("degree", "slices"), [(1, 64), (2, 62), (3, 16)])
def test_volumes_whose_bytes_64_bits_do_not_count(degree, slices):
    with pytest.raises(MemoryError, match=r"^data: the coefficients need \d{13,} MiB of memory, of which \d+ MiB"):
        isospline.Volume(repeated(np.uint8(1), slices, 2**28, 2**28), degree=degree)


def test_axes_that_are_too_long():
    with pytest.raises(ValueError, match="^data: expected at most 268435456 samples along an axis"):
        isospline.Volume(repeated(np.uint8(1), MANY + 1, 1, 1))


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_isosurfaces_of_cells_that_16_bits_do_not_count(degree, axis):
    def surface(cells):
        shape = [2, 2, 2]
        shape[axis] = cells + degree % 2
        samples = np.zeros(shape, np.float32)
        np.moveaxis(samples, axis, 0)[-1] = 1
        return isospline.Isosurface(isospline.Volume(samples, degree=degree), 0.9)

    with pytest.raises(ValueError, match="^volume: expected at most 65535 cells along each axis"):
        surface(65536)
    longest = surface(65535)
    rays = np.full((1, 6), 0.5)
    rays[0, 2 - axis], rays[0, 3:] = -1.0, np.eye(3)[2 - axis]
    hits = isospline.Scene([longest]).cast_rays(rays)
    assert hits["t_hit"][0] == pytest.approx(65535 + degree % 2, abs=0.5)
    assert longest.volume.cell_at(hits["primitive_ids"])[0, 2 - axis] == 65534


@pytest.mark.parametrize("size", [(2**28 + 1, 1), (1, 2**31 - 1)])
def test_images_that_are_too_large(size):
    scene, camera = isospline.Scene(), isospline.PerspectiveCamera((0, -5, 0), (0, 0, 0))
    message = "^size: expected a width and a height of 1 to 268435456, got "
    for call in (
        lambda: isospline.render(scene, camera, size=size, light="phong"),
        lambda: camera.rays(size),
        lambda: camera.world_to_ndc(size),
        lambda: isospline.ProgressiveRenderer(scene, camera, size=size, light=isospline.PathTracer()),
    ):
        with pytest.raises(ValueError, match=message):
            call()
    with pytest.raises(ValueError, match="^image: expected a width and a height of at most 2147483647"):
        isospline.EnvironmentLight(image=repeated(np.uint8((1, 1, 1)), 1, MANY + 1))


def test_samples_that_an_int_does_not_count():
    scene, camera = isospline.Scene(), isospline.PerspectiveCamera((0, -5, 0), (0, 0, 0))
    renderer = isospline.ProgressiveRenderer(scene, camera, size=(4, 4), light=isospline.PathTracer())
    renderer.step(2)
    with pytest.raises(ValueError, match="^samples: expected at most 2147483645 more"):
        renderer.step(2**31 - 2)
    assert renderer.samples == 2
