"""Options of the command line that have no effect are refused, even with the values of their defaults."""

import numpy as np
import pytest
from command_line import fails, leftovers

import isospline
from isospline.cli.main import main

DEPTH, PARALLEL = ("--layers", "depth", "-o", "a.exr"), ("--projection", "orthographic")


@pytest.mark.parametrize(
    ("needed", "option"),
    [
        ("--light outline with it, got studio", ("--exponent", "2")),
        (r"a video of --turntable with it, got a\.png", ("--fps", "30")),
        (r"a video of --turntable with it, got a-#\.png", ("--fps", "30", "--turntable", "2", "-o", "a-#.png")),
        ("--layers ambient_occlusion with it, got none", ("--ambient-occlusion-samples", "16")),
        ("--layers ambient_occlusion with it, got depth", ("--ambient-occlusion-samples", "16", *DEPTH)),
        ("--projection perspective with it, got orthographic", ("--field-of-view", "30", *PARALLEL)),
        (r"none with --level, got 1\.5", ("--label-smoothing", "1.5")),
        (r"a store with it, got ball\.npy", ("--memory-limit", "4GB")),
        (r"a store with it, got ball\.npy", ("--exact",)),
        (r"none for ball\.npy, which has one array, got 'x'", ("--name", "x")),
    ],
)
def test_options_without_effect_on_a_picture_are_refused(ball, monkeypatch, capsys, needed, option):
    monkeypatch.chdir(ball.parent)
    message = f"{option[0].removeprefix('--')}: expected {needed}"
    fails(capsys, 2, message, "render", "ball.npy", "-o", "a.png", "-l", "0", *option)
    assert not leftovers(ball.parent)


@pytest.mark.parametrize(
    ("message", "arguments"),
    [
        ("--memory-limit: expected a store with it", ["info", "ball.npy", "--memory-limit", "1GB"]),
        ("--json cannot be combined with --output", ["measure", "ball.npy", "--json", "-o", "a.csv"]),
        ("--label-smoothing: expected a label map with it", ["measure", "ball.npy", "--label-smoothing", "1"]),
        ("--limits: expected --output with it, got none", ["compare", "ball.npy", "a.stl", "--limits", "0,1"]),
        ("--size: expected --output with it, got none", ["compare", "ball.npy", "a.stl", "--size", "640x480"]),
        (
            "--workers cannot be combined with --scheduler",
            ["convert", "ball.npy", "a.zarr", "--workers", "2", "--scheduler", "tcp://127.0.0.1:1"],
        ),
        ("--level: expected a volume with it, got a.stl", ["view", "a.stl", "--level", "0"]),
        ("--degree: expected a file of samples with it, got none", ["view", "--degree", "3"]),
        ("--name: expected a file with named arrays with it, got ball.npy", ["view", "ball.npy", "--name", "density"]),
        ("--threads: expected a whole number of at least 1, got '0'", ["mesh", "ball.npy", "--threads", "0"]),
    ],
)
def test_options_without_effect_are_refused(ball, plate, monkeypatch, capsys, message, arguments):
    monkeypatch.chdir(ball.parent)
    plate.rename("a.stl")
    fails(capsys, 2, message, *arguments)
    assert leftovers(ball.parent) == ["a.stl"]


def test_options_of_files_and_other_models_are_refused_with_a_store(ball, tmp_path, capsys):
    pytest.importorskip("zarr")
    store = isospline.convert(np.load(ball), tmp_path / "a.zarr", degree=3)
    for option in (("--spacing", "1,1,9"), ("--shape", "3,3,3"), ("--dtype", "u1"), ("--offset", "3"), ("--name", "x")):
        told = f"{option[0]}: expected none with the store .*, whose samples isospline convert has read, got"
        fails(capsys, 2, told, "measure", store, *option)
    fails(capsys, 2, "--degree: expected 3, as in the store, got 2", "measure", store, "--degree", "2")


@pytest.mark.parametrize("option", [("-l", "0"), ("-l0",), ("--level", "0"), ("--level=0",)])
@pytest.mark.parametrize(
    ("command", "instead"),
    [
        (("measure", "ball.npy"), "; more are told as -l 0 -l 1e0 -l -.5"),
        (("render", "ball.npy", "-o", "a.png"), "; more are told as -l 0 -l 1e0 -l -.5"),
        (("view", "ball.npy"), "; more are told as -l 0 -l 1e0 -l -.5"),
        (("mesh", "ball.npy", "-o", "a.stl"), ""),
        (("compare", "ball.npy", "ball.npy"), ""),
    ],
)
def test_several_numbers_after_one_level_are_refused(ball, monkeypatch, capsys, command, instead, option):
    monkeypatch.chdir(ball.parent)
    message = rf"error: --level: expected one number, got 0 1e0 -\.5{instead}\n"
    fails(capsys, 2, message, *command, *option, "1e0", "-.5")
    fails(capsys, 2, message, command[0], *option, "1e0", "-.5", *command[1:])
    assert not leftovers(ball.parent)


def test_a_number_after_a_level_may_be_the_name_of_a_file(ball, monkeypatch, capsys):
    monkeypatch.chdir(ball.parent)
    isospline.convert(np.load(ball), ball.parent / "7")
    assert main(["measure", "-q", "-l", "0", "7"]) == 0
    assert capsys.readouterr().out.startswith("7\n")
