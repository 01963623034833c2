"""The command `mesh`."""

import json
import re

import numpy as np
import pytest
from command_line import leftovers

import isospline
from isospline.cli import main


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
        assert json.loads(capsys.readouterr().out)["area"]["value"] == pytest.approx(area)
    assert main(["mesh", *common, "--closed", "--capped", "-o", str(output)]) == 0
    shape = trimesh.load_mesh(output)
    assert shape.is_watertight and shape.area == pytest.approx(area)


def test_mesh_takes_a_tolerance_and_a_clip(ball, tmp_path, capsys):
    trimesh = pytest.importorskip("trimesh")
    volumes_of = {}
    for name, options in {
        "all": [],
        "few": ["--tolerance", "0.5"],
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
        assert ("at most" in said) == (name == "few")
        shape = trimesh.load_mesh(output)
        assert shape.is_watertight
        volumes_of[name] = shape.volume, len(shape.faces)
    assert volumes_of["few"][1] < volumes_of["all"][1] / 2
    assert volumes_of["half"][0] == pytest.approx(volumes_of["all"][0] / 2, rel=0.05)
    assert volumes_of["box"][0] == pytest.approx(volumes_of["all"][0] / 2, rel=0.05)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["-o", "ball.png"], "ball.png: expected a name that ends in .stl, .ply, .obj, .glb"),
        (["-o", "no/ball.stl"], "no/ball.stl: expected a folder that exists"),
        (["-o", "ball.stl", "--tolerance", "-1"], "tolerance: expected a finite number above 0, got -1"),
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
