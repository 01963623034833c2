"""Long renderings of the command line: noise and time limits, Ctrl-C, checkpoints, and messages on the way."""

import os
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from command_line import fails, pixels, rendered
from interrupts import obey_signals
from spheres import mesh_sphere

import isospline
from isospline.base import progress
from isospline.cli.main import main
from isospline.viewer.document import Document, read_source
from isospline.viewer.session import session_of, write_session
from isospline.viewer.state import CameraState, ViewState

TRACED = ("-l", "0", "--size", "48x32", "--light", "path-trace")


@pytest.fixture
def checkpoint(tmp_path):
    return tmp_path / "a.checkpoint"


def arguments(ball, picture, *options):
    return ["render", str(ball), "-o", str(picture), *TRACED, *map(str, options)]


def traced(ball, samples):
    return rendered(ball, samples=samples, light=isospline.PathTracer()).to_srgb()


@pytest.mark.parametrize("light", ["studio", "phong", "path-trace"])
@pytest.mark.parametrize("samples", [0, -1])
def test_a_picture_has_at_least_one_sample(ball, tmp_path, picture, capsys, light, samples):
    expected = f"samples: expected a whole number of at least 1, got {samples}"
    given = ["--samples", samples, "-o", picture, "--quiet"]
    fails(capsys, 2, expected, "render", ball, "--level", "0", "--light", light, "--size", "48x32", *given)
    document = Document()
    source = document.add(read_source(ball))
    camera = CameraState(eye=(0.0, -90.0, 0.0), target=(0.0, 0.0, 0.0), up=(0.0, 0.0, 1.0))
    state = ViewState(camera=camera, light=light).with_new_object(source.key, 0.0)
    write_session(tmp_path / "a.json", session_of(document, state))
    fails(capsys, 2, expected, "render", "--session", tmp_path / "a.json", *given)
    assert not picture.exists()


def test_a_checkpoint_continues_with_more_samples(ball, picture, checkpoint, capsys):
    assert main(arguments(ball, picture, "--samples", 5, "--checkpoint", checkpoint)) == 0
    np.testing.assert_array_equal(pixels(picture), traced(ball, 5))
    picture.unlink()
    assert main(arguments(ball, picture, "--samples", 12, "--checkpoint", checkpoint, "--resume")) == 0
    np.testing.assert_array_equal(pixels(picture), traced(ball, 12))
    assert f"isospline: {checkpoint}: continues after 5 samples a pixel\n" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
# Without a checkpoint, the first sign of work is the line after ten seconds.
@pytest.mark.parametrize("has_checkpoint", [True, pytest.param(False, marks=pytest.mark.long)])
def test_kill_and_resume(ball, picture, checkpoint, has_checkpoint, tmp_path):
    """An interrupted and continued run gives the picture of a run without a pause."""
    command = [sys.executable, "-m", "isospline", *arguments(ball, picture, "--samples", 10**6)]
    command[command.index("48x32")] = "160x120"
    keep = ["--checkpoint", str(checkpoint)] if has_checkpoint else []
    process = subprocess.Popen(
        [*command, *keep], stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8", preexec_fn=obey_signals
    )
    if has_checkpoint:
        deadline = time.monotonic() + 120
        while not checkpoint.exists() and time.monotonic() < deadline:
            time.sleep(0.01)
        time.sleep(0.7)
    else:
        assert re.match(r"isospline: .*\d+%", process.stderr.readline())
    process.send_signal(signal.SIGINT)
    out, error = process.communicate(timeout=120)
    assert (process.returncode, out) == (130, "") and "Traceback" not in error
    found = re.search(r": has (\d+) samples a pixel(; --resume continues)?\nisospline: interrupted\n$", error)
    assert found and bool(found[2]) == has_checkpoint, error
    assert int(found[1]) >= 2 and pixels(picture).shape == (120, 160, 4)
    expected = {ball.name, picture.name} | ({checkpoint.name} if has_checkpoint else set())
    assert {path.name for path in tmp_path.iterdir()} == expected
    if not has_checkpoint:
        return

    samples = str(int(found[1]) + 7)
    command[command.index(str(10**6))] = samples
    words = command[3:]
    assert main([*words, *keep, "--resume"]) == 0
    resumed = pixels(picture)
    assert main(words) == 0
    np.testing.assert_array_equal(resumed, pixels(picture))


def test_an_exr_continues_bit_for_bit(ball, tmp_path, checkpoint):
    layers = ("--layers", "variance,direct,depth")
    for name, steps in (("whole", [7]), ("parts", [2, 7])):
        checkpoint.unlink(missing_ok=True)
        for number, samples in enumerate(steps):
            resume = ["--resume"] if number else []
            options = ("--samples", samples, "--checkpoint", checkpoint, *resume)
            assert main(arguments(ball, tmp_path / f"{name}.exr", *layers, *options)) == 0
    assert (tmp_path / "whole.exr").read_bytes() == (tmp_path / "parts.exr").read_bytes()


def test_noise_and_time_end_a_picture(ball, picture, capsys):
    assert main(arguments(ball, picture, "--noise", 0.02)) == 0
    found = re.search(r"isospline: (\d+) samples a pixel, noise (0\.0\d+)\n", capsys.readouterr().err)
    assert int(found[1]) % 16 == 0 and float(found[2]) <= 0.02
    np.testing.assert_array_equal(pixels(picture), traced(ball, int(found[1])))
    began = time.monotonic()
    assert main(arguments(ball, picture, "--time-limit", 0.3)) == 0
    assert time.monotonic() - began < 60
    assert re.search(r"isospline: \d+ samples a pixel", capsys.readouterr().err)


def test_a_video_is_not_resumed(ball, capsys, tmp_path):
    pytest.importorskip("imageio_ffmpeg")
    fails(
        capsys,
        2,
        r"--resume: expected numbered pictures, such as turn-####\.png, got the video .*turn\.mp4",
        *arguments(ball, tmp_path / "turn.mp4", "--resume", "--turntable", 3),
    )


def test_checkpoints_that_do_not_fit_are_told(ball, picture, checkpoint, capsys, tmp_path):
    def bad(code, message, *options):
        fails(capsys, code, message, *arguments(ball, picture, *options))

    assert main(arguments(ball, tmp_path / "a.png", "--samples", 2, "--checkpoint", checkpoint)) == 0
    capsys.readouterr()
    keep = ("--samples", 2, "--checkpoint", checkpoint)
    bad(2, f"--checkpoint: expected --resume, or the name of a new file, got {checkpoint}, which exists", *keep)
    bad(2, "--resume: expected --checkpoint with it, got none", "--resume")
    fails(
        capsys,
        2,
        "--checkpoint: expected one picture, got --turntable 3: --resume alone keeps its numbered pictures and makes",
        *arguments(ball, tmp_path / "turn-##.png", *keep, "--turntable", 3),
    )
    bad(2, r"no\.checkpoint: No such file", "--checkpoint", tmp_path / "no.checkpoint", "--resume")
    bad(2, "expected a folder that exists", "--checkpoint", tmp_path / "no" / "a")
    bad(2, "checkpoint: expected one of the same camera, got another one", *keep, "--resume", "--view", "top")
    bad(2, "checkpoint: expected one of the same size, got another one", *keep, "--resume", "--size", "49x32")
    bad(2, "checkpoint: expected one of the same volume of object 0, got another one", *keep, "--resume", "--degree", 3)
    bad(2, "checkpoint: expected one of the same objects, got another one", *keep, "--resume", "-l", 1)
    other = [*arguments(ball, picture, *keep, "--resume")]
    other[other.index("-l") + 1] = "1"
    fails(capsys, 2, "checkpoint: expected one of the same level of object 0, got another one", *other)
    bad(2, "checkpoint: expected one of the same path tracer's lights", *keep, "--resume", "--environment", 2)
    checkpoint.write_bytes(checkpoint.read_bytes()[:1000])
    bad(2, r"a\.checkpoint: cannot be read as a checkpoint", *keep, "--resume")
    bad(2, "noise: expected a finite number above 0, got 0.0", "--noise", 0)
    bad(2, "time_limit: expected a finite number above 0, got -1.0", "--time-limit", -1)
    for option in (
        ("--noise", 1),
        ("--time-limit", 1),
        ("--checkpoint", tmp_path / "b"),
        ("--checkpoint", checkpoint, "--resume"),
    ):
        message = f"{option[0]}: expected --light path-trace with it, got studio"
        fails(capsys, 2, message, "render", ball, "-o", picture, *option)
        fails(
            capsys,
            2,
            f"{option[0]} cannot be combined with --session",
            "render",
            "--session",
            "a.json",
            "-o",
            picture,
            *option,
        )
    assert not picture.exists()


@pytest.mark.parametrize("shading", [["--fast"], ["--light", "path-trace", "--samples", "2"]])
def test_a_turntable_continues_with_the_missing_pictures(ball, tmp_path, capsys, shading):
    command = ["render", str(ball), "-l", "0", "--size", "32x24", *shading, "--turntable", "4"]
    command += ["-o", str(tmp_path / "turn-##.png")]
    paths = [tmp_path / f"turn-{number:02}.png" for number in range(4)]
    assert main(command) == 0
    whole = [path.read_bytes() for path in paths]
    kept = paths[1].stat().st_mtime_ns
    paths[0].unlink()
    paths[2].unlink()
    capsys.readouterr()
    assert main([*command, "--resume"]) == 0
    assert "2 of 4 pictures exist already" in capsys.readouterr().err
    assert [path.read_bytes() for path in paths] == whole and paths[1].stat().st_mtime_ns == kept
    assert main([*command, "--resume"]) == 0
    assert "4 of 4 pictures exist already" in capsys.readouterr().err
    assert main([*command, "--resume", "--background", "red"]) == 0
    assert "0 of 4 pictures exist already" in capsys.readouterr().err
    assert all(path.read_bytes() != before for path, before in zip(paths, whole))


def test_a_turntable_of_changed_files_begins_again(ball, tmp_path, capsys):
    tifffile = pytest.importorskip("tifffile")
    pytest.importorskip("zarr")
    slices, store = tmp_path / "slices", isospline.convert(np.load(ball), tmp_path / "a.zarr")
    slices.mkdir()
    for number, page in enumerate(np.load(ball)):
        tifffile.imwrite(slices / f"{number}.tif", page)
    for volume in (slices, store):
        command = ["render", str(volume), "-l", "0", "--size", "16x12", "--fast", "--turntable", "2", "--resume"]
        changed = min(path for path in volume.rglob("*") if path.is_file())
        for kept in (0, 2, 0):
            assert main([*command, "-o", str(tmp_path / f"{volume.stem}-#.png")]) == 0
            assert f"{kept} of 2 pictures exist already" in capsys.readouterr().err
            if kept:
                os.utime(changed, (0, 0))


def test_a_volume_that_changes_after_it_was_read_is_another_one(ball, tmp_path, capsys, monkeypatch):
    read = isospline.read_volume

    def read_and_change(*given, **options):
        volume = read(*given, **options)
        np.save(tmp_path / "other.npy", volume.data[:, :, ::-1])
        os.replace(tmp_path / "other.npy", ball)
        return volume

    command = ["render", str(ball), "-l", "0", "--size", "16x12", "--fast", "--turntable", "2", "--resume"]
    command += ["-o", str(tmp_path / "turn-#.png")]
    with monkeypatch.context() as changing:
        changing.setattr(isospline, "read_volume", read_and_change)
        assert main(command) == 0
    for kept in (0, 2):
        capsys.readouterr()
        assert main(command) == 0
        assert f"{kept} of 2 pictures exist already" in capsys.readouterr().err


@pytest.mark.parametrize("suffix", ["gltf", "inp"])
def test_a_turntable_of_changed_parts_of_meshes_begins_again(ball, tmp_path, capsys, suffix):
    pytest.importorskip("trimesh" if suffix == "gltf" else "meshio")
    mesh, part = tmp_path / f"a.{suffix}", tmp_path / "gltf_buffer_0.bin"
    if suffix == "gltf":
        for name, content in mesh_sphere(9.0, 16).to_trimesh().scene().export(file_type="gltf").items():
            (tmp_path / name).write_bytes(content)
        (tmp_path / "model.gltf").rename(mesh)
    else:
        part = tmp_path / "part.inp"
        part.write_text(
            "*NODE\n1, 0, 0, 0\n2, 9, 0, 0\n3, 0, 9, 0\n*ELEMENT, TYPE=CPS3\n1, 1, 2, 3\n", encoding="utf-8"
        )
        mesh.write_text("*INCLUDE, INPUT=part.inp\n", encoding="utf-8")
    command = ["render", str(ball), "-l", "0", "--mesh", f"{mesh}@1,2,3", "--size", "16x12", "--fast"]
    for kept in (0, 2, 0):
        assert main([*command, "--turntable", "2", "--resume", "-o", str(tmp_path / "turn-#.png")]) == 0
        assert f"{kept} of 2 pictures exist already" in capsys.readouterr().err
        if kept:
            os.utime(part, (0, 0))


def test_a_full_disk_is_told_and_leaves_no_part(ball, picture, checkpoint, capsys, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", full)
    fails(
        capsys,
        1,
        r"a\.checkpoint: No space left on device",
        *arguments(ball, picture, "--samples", 2, "--checkpoint", checkpoint),
    )
    assert not picture.exists() and not checkpoint.exists()


def test_progress_without_a_terminal_is_lines(ball, picture, capsys, monkeypatch):
    monkeypatch.setattr(progress, "LINE_INTERVAL", 0.0)
    assert main(arguments(ball, picture, "--samples", 3)) == 0
    lines = capsys.readouterr().err.splitlines()
    assert any(line.startswith("isospline: filtering: ") for line in lines)
    told = [re.fullmatch(r"isospline: rendering: (\d+)%, \d+:\d\d(, \d+:\d\d left)?", line) for line in lines]
    shares = [int(each[1]) for each in told if each]
    assert shares == sorted(shares) and shares[-1] == 100
    assert any(each and each[2] for each in told)
    assert main(arguments(ball, picture, "--samples", 3, "--quiet")) == 0
    assert capsys.readouterr().err == ""


def test_the_time_that_is_left_is_that_of_the_rate(capsys, monkeypatch):
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    lines = progress.Lines("rendering")
    for seconds, fraction in ((0, 0.5), (5, 0.51), (20, 0.6), (25, 0.62), (60, 0.8)):  # a half was done before
        now[0] = 100.0 + seconds
        lines(fraction)
    assert capsys.readouterr().err == (
        "isospline: rendering: 60%, 00:20, 01:20 left\nisospline: rendering: 80%, 01:00, 00:40 left\n"
    )


def test_the_time_that_is_left_is_that_of_the_last_minute(capsys, monkeypatch):
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    lines = progress.Lines("area")
    for seconds in range(0, 310, 10):  # 90% in ten seconds, then 1% a minute
        now[0] = float(seconds)
        lines(0.9 * (seconds >= 10) + 0.01 * max(seconds - 10, 0) / 60)
    assert capsys.readouterr().err.splitlines()[-1] == "isospline: area: 95%, 05:00, 05:10 left"


def test_a_bar_shows_the_remaining_time(capsys):
    bar = progress.Bar("rendering")
    bar(0.5)
    time.sleep(0.2)
    bar(0.75)
    bar.close()
    assert re.search(r"\rrendering +75%\|[^|]+\| 00:00<00:00", capsys.readouterr().err)
