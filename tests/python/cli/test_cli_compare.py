"""`isospline compare`: distances of the surface of a volume from a mesh or another surface."""

import csv
import json

import numpy as np
import pytest
from command_line import fails, leftovers, pixels
from spheres import mesh_sphere

import isospline
from isospline.cli.main import main


@pytest.fixture
def part(ball):
    """A mesh of a larger ball about the centre of the ball, beside it."""
    sphere = mesh_sphere(1.0, 64)
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
