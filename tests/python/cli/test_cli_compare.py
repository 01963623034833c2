"""`isospline compare`: distances of the surface of a volume from a mesh or another surface."""

import csv
import json

import numpy as np
import pytest
from command_line import fails, leftovers, pixels, write_nrrd
from spheres import mesh_sphere

import isospline
from isospline.cli.main import main


@pytest.fixture
def part(ball):
    """A mesh of a larger ball about the centre of the ball, beside it."""
    sphere = mesh_sphere(1.0, 32)
    center = (np.array(np.load(ball).shape[::-1]) - 1) / 2
    extent = 0.7 * center  # the ball is an ellipsoid: its samples are denser along some axes
    path = ball.parent / "part.ply"
    isospline.Mesh(sphere.vertices * (extent + 1) + center, sphere.faces).write(path)
    return path


def test_the_numbers_are_those_of_the_library(ball, part, tmp_path, capsys):
    table, picture = tmp_path / "a.csv", tmp_path / "a.png"
    words = ["compare", str(ball), str(part), "-l", "0", "--samples", "500"]
    assert main([*words, "--json", "--table", str(table), "-o", str(picture), "--size", "96x72"]) == 0
    printed = json.loads(capsys.readouterr().out)
    surface = isospline.Isosurface(isospline.Volume(np.load(ball)), 0)
    found = isospline.surface_distance(surface, isospline.read_mesh(part), samples=500, signed=True)
    assert printed["mean"] == {"value": found.mean.value, "error": found.mean.error}
    assert printed["maximum"] == list(found.maximum)
    assert list(printed["quantiles"].values()) == found.quantiles.tolist()
    assert -1.2 < found.mean.value < -0.4 and printed["level"] == 0
    with open(table, encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["points_x", "points_y", "points_z", "distances"]
    np.testing.assert_array_equal(np.array(rows[1:], float)[:, 3], found.distances)
    assert pixels(picture).shape == (72, 96, 4)

    assert main(words) == 0
    told = capsys.readouterr().out
    assert f"{found.mean.value:.6g}" in told and "95% are within" in told and "largest" in told


def test_all_formats_of_meshes_are_compared_and_colour_surfaces(ball, part, tmp_path, capsys):
    mesh = isospline.read_mesh(part)
    path = tmp_path / "part.off"
    points = "\n".join(" ".join(map(repr, row)) for row in mesh.vertices.tolist())
    faces = "\n".join("3 " + " ".join(map(str, row)) for row in mesh.faces.tolist())
    path.write_text(f"OFF\n{len(mesh.vertices)} {len(mesh.faces)} 0\n{points}\n{faces}\n", encoding="ascii")
    printed, pictures = [], [tmp_path / "ply.png", tmp_path / "off.png"]
    for each, picture in zip((part, path), pictures):
        assert main(["compare", str(ball), str(each), "-l", "0", "--samples", "20", "--json"]) == 0
        printed.append({**json.loads(capsys.readouterr().out), "other": None})
        colors = ["--color-by", str(each), "--limits", "-2,2", "--light", "phong", "--size", "48x36"]
        assert main(["render", str(ball), "-l", "0", *colors, "-o", str(picture)]) == 0
        capsys.readouterr()
    assert printed[0] == printed[1]
    np.testing.assert_array_equal(*map(pixels, pictures))


@pytest.mark.parametrize("missing", [0, 1])
def test_a_mesh_with_a_hole_is_told(ball, part, tmp_path, capsys, missing):
    whole = isospline.read_mesh(part)
    corners = whole.vertices[whole.faces[missing:]].reshape(-1, 3)  # no face shares a vertex with another
    path = tmp_path / "open.ply"
    isospline.Mesh(corners, np.arange(len(corners), dtype=np.uint32).reshape(-1, 3)).write(path)
    words = ["compare", str(ball), str(path), "-l", "0", "--samples", "20"]
    assert main(words) == 0
    assert ("is not closed" in capsys.readouterr().err) == bool(missing)
    assert main([*words, "--unsigned"]) == 0
    assert "is not closed" not in capsys.readouterr().err


def test_two_volumes_are_compared(ball, capsys):
    words = ["compare", str(ball), str(ball), "-l", "0", "--other-level", "0", "--json"]
    assert main([*words, "--samples", "100", "--unsigned"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["maximum"][0] < 1e-6 and printed["rms"]["value"] < 1e-6


@pytest.mark.parametrize(
    "options",
    [
        ["--degree", "1"],
        ["--filter", "smoothing", "--smoothing", "9"],
        ["--boundary", "periodic", "--filter", "none"],
        ["--largest", "all"],
        ["--inside", "below"],
    ],
)
def test_a_volume_is_at_no_distance_from_itself(ball, capsys, options):
    noisy = ball.parent / "noisy.npy"
    data = np.load(ball)[::2, ::2, ::2]
    np.save(noisy, data + np.random.default_rng(1).normal(0, 0.1, data.shape))
    assert main(["compare", str(noisy), str(noisy), "--json", "--samples", "100", *options]) == 0
    assert json.loads(capsys.readouterr().out)["rms"]["value"] < 1e-6


@pytest.mark.parametrize("names", [("a.zarr", "ball.npy"), ("ball.npy", "a.zarr")])
def test_a_store_is_compared(ball, capsys, names):
    pytest.importorskip("zarr")
    isospline.convert(np.load(ball), ball.parent / "a.zarr")
    words = [
        "compare",
        *(str(ball.parent / name) for name in names),
        "-l",
        "0",
        "--other-level",
        "0",
        "--samples",
        "100",
    ]
    assert main([*words, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["rms"]["value"] < 1e-6
    fails(capsys, 2, "--degree: expected 2, as in the store, got 3", *words, "--degree", "3")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["-o", "a.jpg"], r"a\.jpg: expected a name that ends in \.png"),
        (["--table", "a.txt"], r"a\.txt: expected a name that ends in \.csv"),
        (["-l", "0", "-l", "100"], "--level: expected one level to compare, got 2"),
        (["--other-level", "3"], "--other-level: expected a volume to compare with, got the mesh"),
    ],
)
def test_bad_comparisons_leave_no_file(ball, part, capsys, options, message):
    fails(capsys, 2, message, "compare", ball, part, *options)
    assert leftovers(ball.parent) == ["part.ply"]


def test_volumes_in_two_units_are_compared_in_the_first_one(ball, tmp_path, capsys):
    data = np.load(ball)
    for name, spacing, unit in (("a", 0.5, "mm"), ("b", 500.0, "um"), ("c", 0.5, "furlong")):
        write_nrrd(tmp_path / f"{name}.nrrd", data, spacing, unit)
    paths = {name: str(tmp_path / f"{name}.nrrd") for name in "abc"}
    options = ["-l", "0", "--other-level", "0", "--samples", "200", "--json"]
    for first, second, unit, size in (("a", "b", "mm", 1.0), ("b", "a", "um", 1000.0)):
        assert main(["compare", paths[first], paths[second], *options]) == 0
        told = capsys.readouterr()
        printed = json.loads(told.out)
        assert printed["unit"] == unit
        assert printed["rms"]["value"] < 1e-5 * size and printed["maximum"][1] < 0.5 * size
        assert f"{paths[second]}: coordinates in" in told.err and f"are converted to {unit}" in told.err
    fails(capsys, 2, "expected coordinates in mm, as in .*, got furlong", "compare", paths["a"], paths["c"], *options)


def test_the_unit_in_a_3mf_file_counts(ball, tmp_path, capsys):
    pytest.importorskip("lxml")
    pytest.importorskip("networkx")
    write_nrrd(tmp_path / "a.nrrd", np.load(ball), 0.5, "mm")
    mesh = isospline.Isosurface(isospline.read_volume(tmp_path / "a.nrrd").to_volume(), 0).to_mesh()
    for unit, size, name in (("mm", 1.0, ""), ("inch", 25.4, "inch"), ("um", 0.001, "micron")):
        part = isospline.Mesh(mesh.vertices / size, mesh.faces)
        path = tmp_path / f"{unit}.3mf"
        part.write(path, unit=unit)
        words = ["compare", str(tmp_path / "a.nrrd"), str(path), "-l", "0", "--samples", "200", "--json"]
        assert main(words) == 0
        told = capsys.readouterr()
        assert json.loads(told.out)["rms"]["value"] < 0.02  # of a ball of a radius of some millimetres
        assert ("are converted" in told.err) == bool(name) and name in told.err


def test_nan_in_either_volume_is_named_and_replaced(ball, capsys):
    data = np.load(ball).astype(np.float32)
    data[0, 0, 0] = np.nan
    holed = ball.parent / "holed.npy"
    np.save(holed, data)
    options = ["-l", "0", "--other-level", "0", "--samples", "50", "--json"]
    for pair in ((holed, ball), (ball, holed)):
        fails(
            capsys,
            2,
            r"holed\.npy: expected finite samples, got 1 of .*--nan VALUE replaces",
            "compare",
            *pair,
            *options,
        )
        assert main(["compare", *map(str, pair), *options, "--nan", str(np.load(ball).min())]) == 0
        assert json.loads(capsys.readouterr().out)["rms"]["value"] < 0.5
