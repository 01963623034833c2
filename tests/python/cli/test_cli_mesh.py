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


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["-o", "ball.png"], "ball.png: expected a name that ends in .stl, .ply, .obj, .glb"),
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
    ],
)
def test_mesh_errors_are_clear(ball, tmp_path, monkeypatch, capsys, options, message):
    monkeypatch.chdir(tmp_path)
    assert main(["mesh", str(ball), *options]) == 2
    assert f"isospline: error: {message}" in capsys.readouterr().err
    assert leftovers(tmp_path) == []
