"""Figures as a materials scientist, a metrologist and a graphics researcher would ask for them at the first try.

As in test_twelve_tasks.py, a wrong guess stands in `answered`: its error has to hold the right call.
"""

import numpy as np
import pytest
from guesses import answered

import isospline as iso

FEW = dict(size=(48, 36), samples=1)


@pytest.fixture
def part():
    field = iso.volumes.sphere(0.6)
    return iso.Isosurface(field.volume(16), field.level)


@pytest.fixture
def scan():
    field = iso.volumes.sphere(0.65)
    return iso.Isosurface(field.volume(16), field.level, name="scan")


def test_how_far_a_scan_is_from_the_part(scan, part, tmp_path):
    distance = iso.surface_distance(scan, part, signed=True)
    assert float(distance.mean) == pytest.approx(0.05, abs=2e-3)
    with answered("maximum"):
        distance.max
    assert distance.maximum[0] == pytest.approx(0.05, abs=5e-3)
    with answered("quantiles"):
        distance.percentile(95)
    pandas = pytest.importorskip("pandas")
    assert isinstance(distance.to_frame(), pandas.DataFrame)
    distance.to_csv(tmp_path / "distance.csv")
    with answered("hausdorff_distance(surface, other)"):
        scan.hausdorff(part)
    assert iso.hausdorff_distance(scan, part)[0] == pytest.approx(0.05, abs=5e-3)


@pytest.mark.parametrize("light", [None, "studio", "path-trace"])
def test_distances_in_colour(scan, part, light):
    with answered("color=ColorByDistance(other)"):
        iso.render(scan, color_by=part, light=light, **FEW)
    rule = iso.ColorByDistance(part)
    image = iso.render(scan, color=rule, light=light, annotate=True, **FEW)
    assert image.color[..., 3].max() > 0
    with answered("annotate=True"):
        iso.render(scan, color=rule, colorbar=True, light=light, **FEW)


def test_limits_of_distances_are_those_of_nearly_all_points(scan, part):
    """Spheres of radius 0.6 and 0.65: all of the signed distances are 0.05 outside; a mesh has those of its corners."""
    for coloured in (scan, iso.Mesh(part.to_mesh().vertices / 0.6 * 0.65, part.to_mesh().faces)):
        for signed, lowest in ((True, -0.05), (False, 0.0)):
            rule = iso.ColorByDistance(part, signed=signed)
            assert rule.limits is None
            fitted = iso.render(coloured, color=rule, **FEW).to_srgb()
            stated = iso.render(coloured, color=rule.replace(limits=(lowest, 0.05)), **FEW).to_srgb()
            assert np.abs(fitted.astype(int) - stated).max() <= 3
    moved = iso.Scene([(scan, np.diag([2.0, 2, 2, 1]))])  # of radius 1.3
    fitted = iso.render(moved, color=iso.ColorByDistance(part), **FEW).to_srgb()
    stated = iso.render(moved, color=iso.ColorByDistance(part, limits=(-0.7, 0.7)), **FEW).to_srgb()
    assert np.abs(fitted.astype(int) - stated).max() <= 3
    nothing = iso.Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.uint32))
    assert iso.render([nothing, scan], color=iso.ColorByDistance(part), **FEW).color[..., 3].max() > 0


def test_wall_thickness_and_values_of_a_simulation(part):
    assert iso.render(part, color=iso.ColorByThickness(), annotate=True, **FEW).color[..., 3].max() > 0
    mesh = part.to_mesh()
    with answered("values"):
        iso.Mesh(mesh.vertices, mesh.faces, scalars=mesh.vertices[:, 0])
    stress = iso.Mesh(mesh.vertices, mesh.faces, values=mesh.vertices[:, 0])
    assert iso.render(stress, annotate=True, **FEW) != iso.render(mesh, annotate=True, **FEW)
    with answered("color=ColorByVolume(volume, cmap) or color=ColorByValue(cmap)"):
        iso.render(stress, cmap="magma", **FEW)
    assert iso.render(stress, color=iso.ColorByValue("magma"), **FEW).color[..., 3].max() > 0


def test_a_transparent_skin_in_a_studio(scan, part):
    with answered("opacity"):
        iso.render([scan, part], transparency=0.7, **FEW)
    skin = iso.Isosurface(scan.volume, scan.level, opacity=0.3, name="skin")
    core = iso.Isosurface(part.volume, part.level, color="gold", name="core")
    image = iso.render([skin, core], light="studio", background=None, legend=True, **FEW)
    assert 0 < np.median(image.color[16:20, 22:26, 3]) <= 1


def test_a_turn_and_a_film_of_levels(part, tmp_path):
    pytest.importorskip("imageio_ffmpeg")
    iso.turntable(part, tmp_path / "turn.gif", frames=2, **FEW)
    with answered("turntable_cameras(scene, 36)"):
        iso.turntable(part, 36)
    iso.animate(lambda t: iso.render(part.with_level(part.level * (1 - t / 2)), **FEW), tmp_path / "film.gif", frames=2)
    assert (tmp_path / "turn.gif").stat().st_size > 0 < (tmp_path / "film.gif").stat().st_size


def test_arrays_of_a_picture(part, tmp_path):
    with answered('layers=("depth", "normal", "mask")'):
        iso.render(part, depth=True, **FEW)
    image = iso.render(part, layers=("depth", "normal", "mask"), **FEW)
    np.testing.assert_array_equal(image.mask, np.isfinite(image.depth))
    image.save(tmp_path / "image.npz")
    assert np.load(tmp_path / "image.npz")["mask"].dtype == bool


def test_a_mesh_of_a_size_and_light_of_a_sky(part):
    with answered("to_mesh(faces=...)"):
        part.decimate(0.9)
    with answered("faces"):
        part.to_mesh(target_faces=500)
    assert len(part.to_mesh(faces=500).faces) <= 500
    sky = np.ones((4, 8, 3), np.float32)
    assert iso.render(part, light="path-trace", environment=sky, **FEW) == iso.render(part, environment=sky, **FEW)
    with answered("light=Outline()"):
        iso.render(part, outline=True, **FEW)
    with answered('render(..., light="path-trace").denoise()'):
        iso.render(part, denoise=True, **FEW)
