"""The command `measure`."""

import json

import numpy as np
import pytest

import isospline
from isospline.cli.main import main


def measured(capsys, *arguments):
    """The numbers that it prints."""
    assert main(["measure", *map(str, arguments), "--json", "--quiet"]) == 0
    return json.loads(capsys.readouterr().out)


def test_each_level_is_measured(ball, capsys):
    both = measured(capsys, ball, "-l", "0", "-l", "400")
    table = isospline.measure(np.load(ball), [0, 400])
    for row, found in enumerate(both):
        assert found["level"] == table.levels[row]
        assert found["area"] == {"value": table.areas[row], "error": table.area_errors[row]}
        assert found["enclosed_volume"] == {"value": table.enclosed_volumes[row], "error": table.volume_errors[row]}
    assert both[1] == measured(capsys, ball, "-l", "400")
    assert main(["measure", str(ball), "-l", "0", "-l", "400", "--quiet"]) == 0
    assert [line.split()[1] for line in capsys.readouterr().out.splitlines() if "  level" in line] == ["0", "400"]


def test_a_table_of_levels(ball, tmp_path, capsys):
    path = tmp_path / "levels.csv"
    assert main(["measure", str(ball), "-l", "0", "-l", "400", "-o", str(path), "--quiet"]) == 0
    assert capsys.readouterr().out == f"{path}: 2 levels\n"
    table = np.genfromtxt(path, delimiter=",", names=True)
    expected = isospline.measure(np.load(ball), [0, 400])
    for name in expected:
        assert table[name].tolist() == expected[name].tolist()
    assert main(["measure", str(ball), "-l", "0", "-o", str(tmp_path / "levels.txt"), "--quiet"]) == 2
    assert "expected the name of a table, which ends in .csv" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("command", ["measure", "mesh"])
def test_measures_and_meshes_are_of_the_surface_in_the_picture(command, tmp_path, scan_with_table, capsys):
    """By default, the bones of a patient without the table, as in `render`."""
    path, _ = scan_with_table
    assert main(["render", str(path), "--size", "32x24", "--fast", "-o", str(tmp_path / "a.png"), "--quiet"]) == 0
    told = [line for line in capsys.readouterr().err.splitlines() if "level" in line]
    assert len(told) == 2 and "for bones" in told[0] and "the body" in told[1]
    options = ["-o", str(tmp_path / "a.stl")] if command == "mesh" else ["--order", "2", "--json"]
    assert main([command, str(path), *options, "--quiet"]) == 0
    printed = capsys.readouterr()
    assert [line for line in printed.err.splitlines() if "level" in line] == told
    if command == "mesh":
        bounds = isospline.read_mesh(tmp_path / "a.stl").bounds
    else:
        (box,) = json.loads(printed.out)["components"]["bounds"]
        bounds = np.array(box)
    assert bounds[1, 1] < 36  # the table is beyond


def test_a_level_without_a_surface_is_told(ball, capsys):
    assert main(["measure", str(ball), "-l", "0", "-l", "1e9", "--quiet"]) == 2
    printed = capsys.readouterr()
    warning, error = printed.err.splitlines()
    assert "warning: level 1000000000 is out of the data's range" in warning
    assert error == "isospline: error: level: expected one with a surface, got 1e+09, where nothing is to be measured"
    assert printed.out == ""


def test_measures_of_the_empty_side_are_those_of_the_whole(ball, capsys):
    found = measured(capsys, ball, "-l", "1e4", "--inside", "below")
    assert found["enclosed_volume"]["value"] == pytest.approx(24 * 22 * 20) and found["area"]["value"] == 0
