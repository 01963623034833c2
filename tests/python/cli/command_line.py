"""Calls of the command line, and the library's results to compare with."""

import re
import subprocess
import sys

import numpy as np
import pytest

import isospline
from isospline.cli.main import main


def run(*arguments, **options):
    command = [sys.executable, "-m", "isospline", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, encoding="utf-8", check=False, timeout=300, **options)


def fails(capsys, code, pattern, *arguments):
    try:
        got = main([str(argument) for argument in arguments])
    except SystemExit as stop:
        got = stop.code
    error = capsys.readouterr().err
    assert re.fullmatch(r"isospline: error: [^\n]*\n", error), error
    assert re.search(pattern, error), error
    assert got == code


def render(file, output, *options):
    """Render a file with 48 x 32 pixels of one sample, unless the options say otherwise; compare with `rendered`."""
    common = ["render", file, "--size", "48x32", "--samples", "1", *options, "-o", output]
    assert main([str(word) for word in common]) == 0


def leftovers(folder):
    return sorted(path.name for path in folder.iterdir() if path.name != "ball.npy")


def pixels(path):
    return np.asarray(pytest.importorskip("PIL.Image").open(path))


def write_nrrd(path, data, spacing, unit):
    """A NRRD file with a unit, about the centre of the data."""
    origin = -spacing * (np.array(data.shape[::-1]) - 1) / 2
    lines = [
        "NRRD0004",
        "type: float",
        "dimension: 3",
        "space dimension: 3",
        f"sizes: {' '.join(map(str, data.shape[::-1]))}",
        f"space directions: ({spacing},0,0) (0,{spacing},0) (0,0,{spacing})",
        f"space origin: ({','.join(map(str, origin))})",
        f"space units: {' '.join([chr(34) + unit + chr(34)] * 3)}",
        "endian: little",
        "encoding: raw",
    ]
    path.write_bytes("\n".join([*lines, "", ""]).encode() + data.astype("<f4").tobytes())


def rendered(ball, levels=(0,), meshes=(), samples=1, **options):
    """The library's result for the ball."""
    volume = isospline.Volume(np.load(ball))
    scene = isospline.Scene([*(isospline.Isosurface(volume, level) for level in levels), *meshes])
    camera = isospline.camera_for(scene, size=(48, 32))
    return isospline.render(scene, camera, size=(48, 32), background=0, samples=samples, **options)
