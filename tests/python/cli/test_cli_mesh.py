"""The command `mesh`."""

import json
import re

import numpy as np
import pytest
from command_line import leftovers

import isospline
from isospline.cli.main import main


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".obj", ".glb"])
def test_mesh_writes_a_closed_mesh(ball, tmp_path, suffix, capsys):
    trimesh = pytest.importorskip("trimesh")
    output = tmp_path / f"ball{suffix}"
    assert main(["mesh", str(ball), "--level", "0", "-o", str(output)]) == 0
    assert re.match(rf"{re.escape(str(output))}: Mesh\(\d+ vertices, \d+ faces\), [\d.]+ s\n", capsys.readouterr().out)
    shape = trimesh.load_mesh(output)
    assert shape.is_watertight and shape.volume > 0
    assert leftovers(tmp_path) == [output.name]


def test_mesh_and_measure_close_the_border(tmp_path, capsys):
    trimesh = pytest.importorskip("trimesh")
    full, output = tmp_path / "full.npy", tmp_path / "full.ply"
    np.save(full, np.full((12, 14, 16), 100, np.int16))
    common = [str(full), "--level", "50"]
    for options, area in (([], 0), (["--closed"], 2 * (12 * 14 + 14 * 16 + 16 * 12))):
        assert main(["measure", *common, "--json", *options]) == 0
        printed = capsys.readouterr()
        assert json.loads(printed.out)["area"]["value"] == pytest.approx(area)
        assert ("--closed closes it there" in printed.err) == (not options)
    assert main(["mesh", *common, "--closed", "--capped", "-o", str(output)]) == 0
    shape = trimesh.load_mesh(output)
    assert shape.is_watertight and shape.area == pytest.approx(area)


@pytest.mark.parametrize("command", ["mesh", "measure"])
@pytest.mark.parametrize("degree", ["1", "2"])
def test_a_solid_that_is_left_open_at_the_border_is_told(tmp_path, capsys, command, degree):
    """A bar through one side of an oblique volume; below the level, what is around it."""
    pytest.importorskip("SimpleITK")
    bar = np.zeros((9, 11, 13), np.float32)
    bar[:5, 4:7, 5:8] = 100
    path, output = tmp_path / "bar.nrrd", ["-o", str(tmp_path / "bar.ply")] if command == "mesh" else []
    header = "NRRD0004\ntype: float\ndimension: 3\nsizes: 13 11 9\nendian: little\nencoding: raw\nspace: LPS\n"
    header += "space directions: (0.6,0.8,0) (-1.6,1.2,0) (0.1,0,3)\nspace origin: (7,-8,9)\n\n"
    path.write_bytes(header.encode() + bar.tobytes())
    common = [command, str(path), "-l", "50", "--degree", degree, "--quiet", *output]
    sentence = "the solid is left open where it meets the border of the volume; --closed closes it there"
    cut_off = ["--clip-box", "-99,-99,15,99,99,99", "--capped"]  # the end at the border
    for options, is_open in (([], True), (["--closed"], False), (cut_off, False), (["--inside", "below"], True)):
        assert main([*common, *options]) == 0
        assert (sentence in capsys.readouterr().err) == is_open


def test_sides_that_cut_the_solid_are_told(tmp_path, capsys):
    """Of a ball near the border none; of what is cut flat at the border, or two samples before it, each."""
    z, y, x = np.indices((24, 24, 24)) - 11.5
    rod = x**2 + y**2 < 36
    for solid, sides in ((x**2 + y**2 + z**2 < 100, 0), (rod, 2), (rod & (abs(z) < 10), 2)):
        np.save(tmp_path / "solid.npy", solid.astype(np.uint8))
        assert main(["measure", str(tmp_path / "solid.npy"), "--closed", "--quiet"]) == 0
        sentence = f"the border of the volume cuts the solid at {sides} sides, where it has flat faces"
        said = [line for line in capsys.readouterr().err.splitlines() if "flat faces" in line]
        assert said == ([f"isospline: {sentence}"] if sides else [])


def test_mesh_takes_a_tolerance_and_a_clip(ball, tmp_path, capsys):
    trimesh = pytest.importorskip("trimesh")
    volumes_of = {}
    for name, options in {
        "all": [],
        "few": ["--tolerance", "0.5"],
        "faces": ["--faces", "200"],
        "half": ["--clip", "0,0,9.5,0,0,1", "--capped"],
        "box": ["--clip-box", "0,0,0,99,99,9.5", "--capped", "--threads", "1", "--degree", "3"],
    }.items():
        output = tmp_path / f"{name}.ply"
        arguments = ["mesh", str(ball), "--level", "0", "-o", str(output), *options]
        try:
            assert main(arguments) == 0
        finally:
            isospline.set_thread_count(0)
        said = capsys.readouterr().out
        assert ("at most" in said) == (name in ("few", "faces"))
        shape = trimesh.load_mesh(output)
        assert shape.is_watertight
        volumes_of[name] = shape.volume, len(shape.faces)
    assert volumes_of["few"][1] < volumes_of["all"][1] / 2
    assert 160 <= volumes_of["faces"][1] <= 200
    assert volumes_of["half"][0] == pytest.approx(volumes_of["all"][0] / 2, rel=0.05)
    assert volumes_of["box"][0] == pytest.approx(volumes_of["all"][0] / 2, rel=0.05)


@pytest.fixture
def hollow(tmp_path):
    """A hollow ball that the border cuts, and a smaller ball, in micrometres."""
    nibabel = pytest.importorskip("nibabel")
    z, y, x = np.mgrid[0:24, 0:24, 0:40]
    radius = np.sqrt((x - 12) ** 2 + (y - 12) ** 2 + (z - 8) ** 2)
    small = 4 - np.sqrt((x - 32) ** 2 + (y - 12) ** 2 + (z - 12) ** 2)
    data = np.maximum(np.minimum(10 - radius, radius - 5), small).astype(np.float32)
    image = nibabel.Nifti1Image(data.T, np.diag([0.5, 0.5, 0.5, 1]))
    image.header.set_xyzt_units("micron")
    nibabel.save(image, tmp_path / "hollow.nii")
    return tmp_path / "hollow.nii"


# The volume of a ball of radius 10 without what the border cuts off, 8.5 from its centre, for spacing 0.5.
HOLLOW = (4 / 3 * np.pi * 10**3 - np.pi * 1.5**2 * (3 * 10 - 1.5) / 3) / 8


@pytest.mark.parametrize("options", [[], ["--tolerance", "0.1"], ["--faces", "1500", "--largest", "1"], ["--closed"]])
def test_mesh_for_print_is_one_closed_piece(hollow, tmp_path, capsys, options):
    trimesh = pytest.importorskip("trimesh")
    output = tmp_path / "part.stl"
    assert main(["mesh", str(hollow), "-l", "0", "-o", str(output), "--for-print", *options]) == 0
    said = capsys.readouterr()
    shape = trimesh.load_mesh(output)
    assert shape.is_watertight and shape.body_count == 1
    assert shape.volume == pytest.approx(HOLLOW, rel=0.05)
    proven = ", no faces cross, at most 0[.][0-9]+ from the surface" if options and options != ["--closed"] else ""
    done = f"closed at the border, kept 1 of 2 pieces, filled 1 cavity, {len(shape.faces):,} faces, watertight{proven}"
    assert re.fullmatch(rf"{re.escape(str(output))}: {done}, [\d.]+ s\n", said.out)
    assert "left open" not in said.err


def test_mesh_for_print_of_a_clip_and_of_a_scan(hollow, scan_with_table, tmp_path, capsys):
    trimesh = pytest.importorskip("trimesh")
    common = ["--for-print", "--quiet", "-o", str(tmp_path / "a.stl")]
    # Half of the hollow ball has no cavity.
    assert main(["mesh", str(hollow), "-l", "0", "--clip", "0,0,4,0,0,1", "--capped", *common]) == 0
    assert re.search(r": kept 1 of 2 pieces, 5,6\d\d faces, watertight, ", capsys.readouterr().out)
    # The bone without the table, from one side of the volume to the other.
    assert main(["mesh", str(scan_with_table[0]), *common]) == 0
    said = capsys.readouterr()
    assert ": closed at the border, 1 piece, " in said.out and "plate on which it lies is left out" in said.err
    shape = trimesh.load_mesh(tmp_path / "a.stl")
    assert shape.is_watertight and shape.extents == pytest.approx([8, 8, 40], abs=1)


def test_mesh_writes_3mf_with_the_unit(hollow, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("lxml")
    pytest.importorskip("networkx")
    assert main(["mesh", str(hollow), "-l", "0", "--for-print", "--quiet", "-o", str(tmp_path / "a.3MF")]) == 0
    shape = trimesh.load_mesh(tmp_path / "a.3MF")
    assert shape.units == "micron" and shape.is_watertight
    assert shape.volume == pytest.approx(HOLLOW, rel=0.02)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["-o", "ball.png"], "ball.png: expected a name that ends in .stl, .ply, .obj, .glb, .3mf"),
        (["-o", "no/ball.stl"], "no/ball.stl: expected a folder that exists"),
        (["-o", "ball.stl", "--tolerance", "-1"], "tolerance: expected a finite number above 0, got -1"),
        (["-o", "ball.stl", "--faces", "0"], "faces: expected at least 1, got 0"),
        (
            ["-o", "ball.stl", "--tolerance", "1", "--faces", "9"],
            "faces: expected either a tolerance or faces, got both",
        ),
        (
            ["-o", "ball.stl", "--capped"],
            "--capped: expected --clip or --clip-box, or --closed for the volume's border",
        ),
        (["-o", "ball.stl", "--level", "1e9"], "ball.stl: expected a mesh with faces, got none"),
        (
            ["-o", "ball.stl", "--for-print", "--level", "1e9"],
            "level: expected one with a surface to print, got 1e+09, where there is none",
        ),
        (
            ["-o", "ball.stl", "--for-print", "--largest", "2"],
            "--largest: expected 1 or nothing with --for-print, got 2",
        ),
        (
            ["-o", "ball.stl", "--for-print", "--clip-box", "0,0,0,9,9,9"],
            "--for-print: expected --capped with --clip and --clip-box, got none",
        ),
    ],
)
def test_mesh_errors_are_clear(ball, tmp_path, monkeypatch, capsys, options, message):
    monkeypatch.chdir(tmp_path)
    assert main(["mesh", str(ball), *options]) == 2
    assert f"isospline: error: {message}" in capsys.readouterr().err
    assert leftovers(tmp_path) == []
