"""Meshes in parts: together they are the mesh of `to_mesh`."""

import re
import warnings

import numpy as np
import pytest

import isospline
from isospline.cli.main import main

trimesh = pytest.importorskip("trimesh")
ndimage = pytest.importorskip("scipy.ndimage")


def noise(shape=(40, 30, 34), seed=0, **options):
    data = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=shape), 1.5)
    return isospline.Volume(data, **options)


def joined(parts):
    """One mesh, in which vertices with the same coordinates, bit for bit, are one."""
    vertices = np.concatenate([part.vertices for part in parts])
    first = np.cumsum([0, *(len(part.vertices) for part in parts)])
    faces = np.concatenate([part.faces.astype(np.int64) + start for part, start in zip(parts, first)])
    unique, inverse = np.unique(vertices, axis=0, return_inverse=True)
    return trimesh.Trimesh(unique, inverse.reshape(-1)[faces], process=False)


def same_triangles(a, b):
    """Whether two meshes have the same triangles, whatever their order and first corner."""

    def rows(mesh):
        corners = mesh.vertices[mesh.faces]
        first = np.lexsort(np.moveaxis(corners, 2, 0)[::-1], axis=1)[:, 0]
        turned = np.take_along_axis(corners, (first[:, None] + np.arange(3))[..., None] % 3, axis=1).reshape(-1, 9)
        return turned[np.lexsort(turned.T)]

    return np.array_equal(rows(a), rows(b))


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_parts_are_the_mesh(degree):
    surface = isospline.Isosurface(noise(degree=degree), 0.02)
    parts = list(surface.mesh_parts(cells=1))
    assert len(parts) == 5
    whole = surface.to_mesh()
    assert abs(sum(len(part.faces) for part in parts) - len(whole.faces)) < 1e-3 * len(whole.faces)
    together = joined(parts)
    assert together.volume == pytest.approx(whole.to_trimesh().volume, rel=1e-6)
    assert together.area == pytest.approx(whole.to_trimesh().area, rel=1e-6)


@pytest.mark.parametrize(
    "options",
    [{}, {"closed": True}, {"inside": "below", "closed": True}, {"largest": 1}],
    ids=["open", "closed", "below", "largest"],
)
def test_a_small_volume_is_one_part(options):
    surface = isospline.Isosurface(noise(), 0.02, **options)
    (part,) = surface.mesh_parts()
    whole = surface.to_mesh()
    assert same_triangles(part, whole)
    np.testing.assert_array_equal(part.normals, whole.normals)


@pytest.mark.parametrize("normal", [(0, 0, 1), (0.3, 0.1, 1), (1, 0, 0.02)])
def test_parts_with_caps_are_watertight(normal):
    volume = noise(shape=(30, 34, 40))
    clip = isospline.HalfSpace(np.mean(volume.bounds, axis=0), normal)
    surface = isospline.Isosurface(volume, 0.02, clip=clip, capped=True, closed=True)
    parts = list(surface.mesh_parts(cells=1))
    assert len(parts) >= 2
    solid = joined(parts)
    assert solid.is_watertight
    assert solid.volume == pytest.approx(surface.to_mesh().to_trimesh().volume, rel=1e-6)


def test_there_are_no_parts_without_a_surface():
    with pytest.warns(UserWarning, match="out of the data's range"):
        assert list(isospline.Isosurface(noise(), 100.0).mesh_parts(cells=1)) == []


def test_parts_keep_the_level_with_which_they_began():
    surface = isospline.Isosurface(noise(), 0.02)
    expected = [len(part.faces) for part in surface.mesh_parts(cells=1)]
    parts = surface.mesh_parts(cells=1)
    counts = [len(next(parts).faces)]
    surface.level = 0.05
    counts += [len(part.faces) for part in parts]
    assert counts == expected


def test_progress_is_that_of_all_parts():
    fractions = []
    surface = isospline.Isosurface(noise(), 0.02)
    list(surface.mesh_parts(cells=1, progress=fractions.append))
    assert fractions == sorted(fractions)
    assert fractions[0] < 0.2 and 0.9 < fractions[-1] <= 1.0
    parts = surface.mesh_parts(cells=1, progress=lambda fraction: fraction < 0.5)
    next(parts)
    with pytest.raises(isospline.Cancelled):
        list(parts)


def test_a_part_has_a_cell():
    with pytest.raises(ValueError, match="cells: expected at least 1, got 0"):
        isospline.Isosurface(noise(), 0.02).mesh_parts(cells=0)


@pytest.fixture
def stored(tmp_path):
    pytest.importorskip("zarr")

    def convert(volume, **options):
        isospline.convert(volume, tmp_path / "a.zarr", chunk=16, **options)
        return isospline.open_volume(tmp_path / "a.zarr", memory_limit="64MB")

    return convert


def test_stl_files_of_stores_are_those_of_memory(stored, tmp_path):
    data = ndimage.gaussian_filter(np.random.default_rng(1).normal(size=(50, 40, 34)), 2.0)
    surface = isospline.Isosurface(stored(data), 0.01, closed=True)
    surface.write(tmp_path / "parts.stl")
    surface.to_mesh().write(tmp_path / "whole.stl")
    parts, whole = (isospline.read_mesh(tmp_path / name) for name in ("parts.stl", "whole.stl"))
    assert same_triangles(parts, whole)
    assert parts.to_trimesh().is_watertight
    of_file = np.fromfile(tmp_path / "parts.stl", np.uint8)
    assert len(of_file) == 84 + 50 * len(parts.faces)
    assert [path.name for path in tmp_path.iterdir() if path.suffix not in (".zarr", ".stl")] == []


def test_stl_files_of_stores_far_away_have_an_offset(stored, tmp_path):
    data = ndimage.gaussian_filter(np.random.default_rng(1).normal(size=(30, 24, 28)), 2.0)
    source = isospline.Volume(data, origin=(500_000.25, 4_500_000.0, 300.0), spacing=0.01)
    surface = isospline.Isosurface(stored(data, origin=source.origin, spacing=source.spacing), 0.01)
    with pytest.warns(UserWarning, match="relative to"):
        surface.write(tmp_path / "far.stl")
    found = isospline.read_mesh(tmp_path / "far.stl")
    expected = surface.to_mesh()
    np.testing.assert_allclose(found.bounds, expected.bounds, atol=1e-6)


def test_no_file_is_left_of_a_cancelled_or_empty_mesh(stored, tmp_path):
    surface = isospline.Isosurface(stored(np.random.default_rng(1).random((30, 24, 28))), 0.5)
    with pytest.raises(isospline.Cancelled), warnings.catch_warnings():
        surface.write(tmp_path / "a.stl", progress=lambda fraction: False)
    with pytest.warns(UserWarning, match="out of the data's range"):
        surface.level = 7.0
    with pytest.raises(ValueError, match="a.stl: expected a mesh with faces, got none"):
        surface.write(tmp_path / "a.stl")
    assert [path.name for path in tmp_path.iterdir()] == ["a.zarr"]


def test_the_command_writes_parts_of_stores(stored, tmp_path, capsys):
    data = ndimage.gaussian_filter(np.random.default_rng(1).normal(size=(30, 24, 28)), 2.0)
    surface = isospline.Isosurface(stored(data), 0.01)
    path = tmp_path / "a.stl"
    assert main(["mesh", str(tmp_path / "a.zarr"), "-l", "0.01", "-o", str(path), "--quiet"]) == 0
    assert re.search(rf"a\.stl: {len(surface.to_mesh().faces):,} faces, written in parts", capsys.readouterr().out)
    assert same_triangles(isospline.read_mesh(path), isospline.read_mesh(written(surface, tmp_path / "b.stl")))


def written(surface, path):
    surface.write(path)
    return path
