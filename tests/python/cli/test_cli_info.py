"""The commands `demo` and `info`."""

import json
import os
import re
import shlex
import subprocess
import sys

import numpy as np
import pytest
from command_line import fails, run

import isospline
from isospline import volumes
from isospline.cli import demo
from isospline.cli.main import main
from isospline.cli.parser import make_parser


@pytest.mark.slow
def test_demo_makes_a_volume_and_a_picture_and_prints_next_steps(tmp_path, capsys, monkeypatch):
    image = pytest.importorskip("PIL.Image")
    assert (demo.SAMPLES, demo.SIZE) == (192, (960, 720))
    monkeypatch.setattr(demo, "SAMPLES", 64)
    monkeypatch.setattr(demo, "SIZE", (240, 180))
    folder = tmp_path / "a folder"
    assert main(["demo", "-o", str(folder)]) == 0
    printed = capsys.readouterr()
    assert sorted(path.name for path in folder.iterdir()) == ["demo.npy", "demo.png"]
    assert all(re.fullmatch("isospline: (filter|render)ing: .* left", line) for line in printed.err.splitlines())
    assert str(folder / "demo.npy") in printed.out and str(folder / "demo.png") in printed.out
    data = np.load(folder / "demo.npy", mmap_mode="r")
    field, index = volumes.heart(), np.random.default_rng(0).integers(0, 64, (1000, 3))
    points = field.grid(64)["origin"] + index[:, ::-1] * np.asarray(field.grid(64)["spacing"])
    np.testing.assert_allclose(data[tuple(index.T)], field.value(points), rtol=1e-5, atol=1e-5)
    pixels = np.asarray(image.open(folder / "demo.png").convert("RGB")).astype(int)
    red = pixels[..., 0] > pixels[..., 1:].max(axis=-1) + 20
    assert 0.15 < red.mean() < 0.7 and red[:, 60:180].mean() > red[:, :60].mean()
    # The suggested next commands are valid, and find the volume.
    lines = [shlex.split(line) for line in printed.out.splitlines() if line.startswith("  isospline ")]
    assert [words[1] for words in lines] == ["info", "view", "render", "measure", "view", "render"]
    parse = make_parser(*["run"] * 9).parse_args
    assert all(parse(words[1:]).run == "run" for words in lines)
    assert main(lines[0][1:]) == 0 and "64 x 64 x 64" in capsys.readouterr().out


def test_demo_needs_a_folder_that_it_may_make(ball, capsys):
    fails(capsys, 2, "ball.npy: expected a folder, got a file", "demo", "-o", ball)


def test_info_describes_a_file(ball, capsys):
    assert main(["info", str(ball), "--spacing", "0.5,1,2"]) == 0
    text = capsys.readouterr().out
    data = np.load(ball)
    assert "24 x 22 x 20   int16, 20.6 KiB" in text
    assert re.search(r"spacing +0\.5  1  2\n", text)
    assert re.search(r"direction +\+x \+y \+z\n", text)
    assert re.search(r"patient +unknown\n", text)
    assert f"range      {data.min()} to {data.max()}" in text
    assert f"levels     {isospline.suggest_levels(data)[0]:.6g}" in text
    assert max(map(len, text.splitlines())) <= 120


def test_info_as_json_agrees_with_numpy(ball, capsys):
    assert main(["info", str(ball), "--json", "--spacing", "0.5,1,2"]) == 0
    summary = json.loads(capsys.readouterr().out)
    data = np.load(ball).astype(float)
    assert summary["size"] == [24, 22, 20] and summary["type"] == "int16" and summary["spacing"] == [0.5, 1, 2]
    assert summary["bounds"] == [[0, 0, 0], [11.5, 21, 38]]
    assert (summary["minimum"], summary["maximum"]) == (data.min(), data.max())
    assert summary["mean"] == pytest.approx(data.mean()) and summary["standard_deviation"] == pytest.approx(data.std())
    assert summary["histogram"]["counts"] == np.histogram(data, summary["histogram"]["edges"])[0].tolist()
    assert summary["suggested_levels"] == isospline.suggest_levels(data.astype(np.int16))


def test_info_of_constant_samples(tmp_path, capsys):
    np.save(tmp_path / "a.npy", np.full((3, 4, 5), 7, np.uint8))
    assert main(["info", str(tmp_path / "a.npy")]) == 0
    assert "none: all samples are the same" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize("environment", [{"PYTHONIOENCODING": "ascii"}, {"LC_ALL": "POSIX", "PYTHONUTF8": "0"}])
def test_names_that_the_terminal_cannot_show(ball, environment):
    """As on Python's standard error, their letters are escaped, or their bytes are written unchanged."""
    path = ball.rename(ball.with_name(os.fsdecode("µ.npy".encode())))
    environment = {**os.environ, "PYTHONCOERCECLOCALE": "0", **environment}
    for arguments in (["info", path], ["mesh", path, "-l", "0", "-o", path.with_suffix(".stl"), "--quiet"]):
        result = run(*arguments, env=environment)
        assert (result.returncode, result.stderr) == (0, "")
        assert re.search(r"(µ|\\xb5|\\udcc2\\udcb5)[.](npy|stl)", result.stdout)
        if arguments[0] == "info" and "PYTHONIOENCODING" in environment:
            assert "####" in result.stdout and "<- " in result.stdout


def test_info_tells_the_unit_of_a_patient(tmp_path, capsys):
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(np.zeros((5, 4, 3), np.int16), np.eye(4))
    image.header.set_xyzt_units("micron")
    nibabel.save(image, tmp_path / "a.nii")
    assert main(["info", str(tmp_path / "a.nii")]) == 0
    assert "z to the head, in µm\n" in capsys.readouterr().out


def test_info_into_a_pipe_that_closes(ball):
    command = f"{sys.executable} -m isospline info {ball} | true"
    assert subprocess.run(command, shell=True, capture_output=True, encoding="utf-8", check=False).stderr == ""


def test_info_of_raw_samples(tmp_path, capsys):
    data = np.arange(60).reshape(3, 4, 5)
    data.astype(">u2").tofile(tmp_path / "a.raw")
    for shape in ("5,4,3", "5x4x3"):
        assert main(["info", str(tmp_path / "a.raw"), "--shape", shape, "--dtype", "uint16", "--big-endian"]) == 0
        text = capsys.readouterr().out
        assert "5 x 4 x 3   uint16" in text and "range      0 to 59" in text


def test_the_deviation_of_samples_far_apart_is_that_of_numpy(tmp_path, capsys, rng):
    data = rng.normal(size=(20, 30, 40)).astype(np.float32)
    data[3, 4, 5] = 1e4
    np.save(tmp_path / "a.npy", data)
    assert main(["info", str(tmp_path / "a.npy"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["standard_deviation"] == pytest.approx(data.std(dtype=float), rel=1e-9)


@pytest.mark.parametrize("largest", [1e308, 1e200, 1e-310])
def test_info_of_huge_and_tiny_samples(tmp_path, capsys, rng, largest):
    shares = rng.uniform(-1, 1, (6, 7, 8))
    shares[0, 0, :2] = -1, 1
    np.save(tmp_path / "a.npy", shares * largest)
    assert main(["info", str(tmp_path / "a.npy"), "--json"]) == 0
    found, told = capsys.readouterr()
    found = json.loads(found, parse_constant=pytest.fail)
    assert told == ""
    assert found["mean"] / largest == pytest.approx(shares.mean(), abs=1e-6)
    assert found["standard_deviation"] / largest == pytest.approx(shares.std(), rel=1e-6)
    assert np.array(found["histogram"]["edges"]) / largest == pytest.approx(np.linspace(-1, 1, 25), abs=1e-4)
    assert sum(found["histogram"]["counts"]) == shares.size
