"""Meshes for printers. The oracles are closed forms of balls, trimesh and SciPy."""

import sys
import warnings

import numpy as np
import pytest

import isospline

trimesh = pytest.importorskip("trimesh")

OUTER, INNER = 15.0, 6.0


def grid(*shape):
    return [axis.astype(float) for axis in np.mgrid[tuple(slice(count) for count in shape)]]


def ball(coordinates, center, radius):
    """The distance from the surface of a ball, positive inside."""
    return radius - np.linalg.norm([axis - at for axis, at in zip(coordinates, center[::-1])], axis=0)


def cut_ball(**options):
    """A hollow ball that the border of the volume cuts, a ball in its hollow, and another one apart."""
    at = grid(40, 40, 40)
    hollow = np.minimum(ball(at, (20, 20, 10), OUTER), -ball(at, (20, 20, 10), INNER))
    field = np.maximum.reduce([hollow, ball(at, (20, 20, 10), 3), ball(at, (20, 20, 34), 3)])
    return isospline.Volume(field, **options)


def cut_volume(degree):
    """The volume of the filled ball within the border, in samples: half a sample below the first one if even."""
    height = OUTER - (10.5 if degree % 2 == 0 else 10.0)
    return 4 / 3 * np.pi * OUTER**3 - np.pi * height**2 * (3 * OUTER - height) / 3


def check(mesh):
    """One closed body with faces outwards, by trimesh."""
    shape = mesh.to_trimesh()
    assert shape.is_watertight and shape.is_winding_consistent and shape.body_count == 1
    return shape.volume


@pytest.mark.parametrize("options", [{}, {"tolerance": 0.3}, {"faces": 1000}])
def test_a_hollow_ball_is_closed_filled_and_freed_of_others(options):
    surface = isospline.Isosurface(cut_ball(), 0)
    assert surface.to_mesh().to_trimesh().body_count == 4
    mesh, report = surface.to_print_mesh(**options)
    distance = report.distance if options else 0.02  # of chords of a sample in a circle of radius 6
    assert abs(check(mesh) - cut_volume(2)) <= 4 * np.pi * OUTER**2 * distance
    sentence = f"closed at the border, kept 1 of 3 pieces, filled 1 cavity, {len(mesh.faces):,} faces, watertight"
    assert str(report) == sentence + (", no faces cross" if options else "")
    assert report.faces == len(mesh.faces) <= options.get("faces", np.inf)
    radial = mesh.vertices - (20, 20, 10)
    far = mesh.vertices[:, 2] > 3  # the model is flat across the border, where samples are mirrored
    cosines = np.sum(radial * mesh.normals, axis=1) / np.linalg.norm(radial, axis=1)
    assert np.all(cosines[far] > 0.99)
    if not options:
        with pytest.raises(AttributeError, match="distance: expected a tolerance or faces of to_print_mesh"):
            report.distance


@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("direction", [np.eye(3), np.diag([1, -1, 1.0]), [(0.6, -0.8, 0), (0.8, 0.6, 0), (0, 0, 1)]])
def test_every_degree_and_mirrored_and_oblique_volumes_are_closed(degree, direction):
    volume = cut_ball(degree=degree, spacing=(0.5, 0.7, 2), direction=direction, origin=(7, -8, 9))
    mesh, report = isospline.Isosurface(volume, 0).to_print_mesh()
    assert check(mesh) == pytest.approx(0.7 * cut_volume(degree), rel=5e-3)
    assert (report.pieces, report.cavities, report.closed_at_border) == (3, 1, True)


@pytest.mark.parametrize("axes", ["zyx", "xyz"])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_report_tells_a_solid_at_the_border_along_each_axis(axes, axis):
    counts = [20, 16, 18]
    counts[axis] = 40
    for place, is_at_border in ((3.0, True), (7.0, False), (32.0, False), (36.0, True)):
        center = [10.0, 8.0, 9.0]
        center[axis] = place
        field = ball(grid(*counts[::-1]), center, 5)
        volume = isospline.Volume(np.ascontiguousarray(field if axes == "zyx" else field.T), axes=axes)
        assert isospline.Isosurface(volume, 0).to_print_mesh()[1].closed_at_border == is_at_border


def test_a_solid_below_the_level_is_closed_too():
    mesh, report = isospline.Isosurface(cut_ball(), 0, inside="below").to_print_mesh()
    assert report.pieces == 2  # the shell between the hollow ball and the ball in it, and what is around both
    # The border cuts the cavity's ball away from the block, so only the ball apart is a cavity of the block.
    assert report.cavities == 1 and check(mesh) == pytest.approx(40**3 - cut_volume(2), rel=2e-3)


@pytest.mark.parametrize("clip", [None, isospline.HalfSpace((1, 0, 0), (1, 0, 0))])
def test_the_piece_with_the_largest_volume_of_its_solid_is_kept(clip):
    """A thin hollow ball, with a ball in it, is larger than a full ball, but has less volume."""
    at = grid(24, 24, 48)
    thin = np.minimum(ball(at, (12, 12, 12), 9), -ball(at, (12, 12, 12), 8))
    volume = isospline.Volume(np.maximum.reduce([thin, ball(at, (12, 12, 12), 4), ball(at, (36, 12, 12), 7.5)]))
    options = {} if clip is None else {"clip": clip, "capped": True}
    mesh, report = isospline.Isosurface(volume, 0, **options).to_print_mesh()
    assert check(mesh) == pytest.approx(4 / 3 * np.pi * 7.5**3, rel=1e-2)
    assert mesh.bounds[0, 0] > 24
    assert str(report) == f"kept 1 of 3 pieces, {len(mesh.faces):,} faces, watertight"


def test_of_a_clipped_surface_the_largest_piece_that_is_left_is_kept():
    at = grid(24, 24, 48)
    hollow = np.minimum(ball(at, (36, 12, 12), 8), -ball(at, (36, 12, 12), 3))
    volume = isospline.Volume(np.maximum(ball(at, (12, 12, 12), 10), hollow))
    clip = isospline.HalfSpace((18, 0, 0), (1, 0, 0))
    mesh, report = isospline.Isosurface(volume, 0, clip=clip, capped=True).to_print_mesh()
    assert check(mesh) == pytest.approx(4 / 3 * np.pi * 8**3, rel=1e-2)
    assert (report.pieces, report.cavities) == (2, 1)
    mesh, report = isospline.Isosurface(volume, 0, clip=clip, capped=True, largest=1).to_print_mesh()
    assert mesh.bounds[1, 0] < 24 and check(mesh) == pytest.approx(np.pi * 4**2 * (3 * 10 - 4) / 3, rel=2e-2)


def test_a_mesh_that_touches_itself_is_told():
    """At degree 1, a fin of samples that equal the level has no thickness: its sides are in one place."""
    data = np.zeros((8, 8, 8))
    data[2:6, 2:6, 2:4], data[3, 2:6, 4:6] = 2, 1
    volume = isospline.Volume(data, degree=1)
    for level, is_thick in ((1, False), (0.9, True)):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            mesh, report = isospline.Isosurface(volume, level).to_print_mesh()
        check(mesh)
        merged = trimesh.Trimesh(mesh.vertices, mesh.faces)  # processed: vertices at one place are one
        assert report.watertight == merged.is_watertight == is_thick
        assert ["the mesh to print touches itself along" in str(each.message) for each in caught] == [True] * (
            not is_thick
        )
        end = "watertight" if is_thick else "watertight except where it touches itself"
        assert str(report) == f"1 piece, {len(mesh.faces)} faces, {end}"


def make(level=0.0, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of an empty shell
        return isospline.Isosurface(cut_ball(), level, **options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"level": 99.0}, "level: expected one with a surface to print, got 99, where there is none"),
        ({"largest": 2}, "largest: expected 1 or None of a surface to print, got 2"),
        (
            {"clip": isospline.HalfSpace((20, 0, 0), (1, 0, 0))},
            "capped: expected True of a surface to print that is clipped, got False",
        ),
        (
            {"mask": np.arange(40) < 20 + np.zeros((40, 40, 1))},
            r"mask: expected one with a closed surface to print, got a mesh with \d+ open edges",
        ),
    ],
)
def test_errors_name_the_option_and_leave_no_file(options, message, tmp_path):
    surface = make(**options)
    with pytest.raises(ValueError, match=message):
        surface.write(tmp_path / "a.stl", for_print=True)
    assert list(tmp_path.iterdir()) == []


def test_a_mask_that_cuts_nothing_is_kept():
    mask = np.ones((40, 40, 40), bool)
    mask[:28] = False
    mesh, report = make(mask=mask).to_print_mesh()
    assert check(mesh) == pytest.approx(4 / 3 * np.pi * 3**3, rel=0.1)
    assert str(report) == f"1 piece, {len(mesh.faces)} faces, watertight"


def test_it_can_be_cancelled_and_shows_its_progress():
    surface, told = make(), []
    surface.to_print_mesh(tolerance=0.5, progress=told.append)
    assert told == sorted(told) and told[0] < 0.5 < told[-1] <= 1
    with pytest.raises(isospline.Cancelled):
        surface.to_print_mesh(progress=lambda fraction: fraction < 0.5)


def test_every_way_to_a_mesh_can_be_for_print(tmp_path):
    surface = make()
    mesh, report = surface.to_print_mesh(1.0)
    assert surface.write(tmp_path / "a.stl", 1.0, for_print=True) == report
    assert surface.write(tmp_path / "b.stl", 1.0) is None
    for shape in (trimesh.load_mesh(tmp_path / "a.stl"), surface.to_trimesh(1.0, for_print=True)):
        assert shape.is_watertight and shape.volume == pytest.approx(check(mesh), rel=1e-5)
    assert not trimesh.load_mesh(tmp_path / "b.stl").is_watertight
    pytest.importorskip("pyvista")
    assert surface.to_pyvista(1.0, for_print=True).volume == pytest.approx(check(mesh), rel=1e-5)


@pytest.mark.sweep(4)
@pytest.mark.parametrize(
    ("unit", "name"),
    [
        ("mm", "millimeter"),
        ("µm", "micron"),
        ("cm", "centimeter"),
        ("m", "meter"),
        ("inch", "inch"),
        ("", "millimeter"),
    ],
)
def test_3mf_has_the_unit_of_the_volume(unit, name, tmp_path):
    pytest.importorskip("lxml")
    pytest.importorskip("networkx")
    surface = isospline.Isosurface(cut_ball(unit=unit, origin=(1e6 / 3, 0, 0)), 0)
    report = surface.write(tmp_path / "a.3mf", tolerance=0.5, for_print=True)
    shape = trimesh.load_mesh(tmp_path / "a.3mf")
    assert shape.units == name
    mesh, again = surface.to_print_mesh(0.5)
    assert report == again
    np.testing.assert_array_equal(shape.vertices, mesh.vertices)
    np.testing.assert_array_equal(shape.faces, mesh.faces)
    read = isospline.read_mesh(tmp_path / "a.3mf")
    np.testing.assert_array_equal(read.vertices, mesh.vertices)
    assert [path.name for path in tmp_path.iterdir()] == ["a.3mf"]


def test_units_that_3mf_does_not_have(tmp_path):
    pytest.importorskip("lxml")
    pytest.importorskip("networkx")
    path = tmp_path / "a.3mf"
    with pytest.warns(UserWarning, match=r"a\.3mf: 3MF does not have the unit 'nm', only µm, mm, .*for millimetres"):
        isospline.Isosurface(cut_ball(unit="nm"), 0).write(path)
    assert trimesh.load_mesh(path).units == "millimeter"
    mesh = isospline.Mesh(np.eye(3), [(0, 1, 2)])
    mesh.write(path, unit="cm")
    assert trimesh.load_mesh(path).units == "centimeter"
    with pytest.raises(ValueError, match="unit: expected one of µm, mm, cm, m, inch or ft, got 'nm'"):
        mesh.write(tmp_path / "b.3mf", unit="nm")
    with pytest.raises(TypeError, match="unit: expected a str, one of µm, mm, cm, m, inch or ft, got 3"):
        mesh.write(tmp_path / "b.3mf", unit=3)
    assert [each.name for each in tmp_path.iterdir()] == ["a.3mf"]


@pytest.mark.parametrize("package", ["lxml", "networkx"])
def test_a_package_that_3mf_lacks_is_named(package, tmp_path, monkeypatch):
    for name in ("networkx", "lxml", "lxml.etree"):
        monkeypatch.setitem(sys.modules, name, type(sys)(name))
    monkeypatch.delitem(sys.modules, f"{package}.etree", raising=False)
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ModuleNotFoundError, match=rf"a\.3mf: Mesh.write needs the package {package}: pip install"):
        isospline.Mesh(np.eye(3), [(0, 1, 2)]).write(tmp_path / "a.3mf")
    assert list(tmp_path.iterdir()) == []
