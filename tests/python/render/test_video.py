"""Turntables: cameras around a scene, and videos read back by FFmpeg."""

import os
import re
import signal
import subprocess
import sys
import textwrap
import time

import numpy as np
import pytest
from interrupts import obey_signals
from projections import corners_of, project

import isospline
from isospline import volumes
from isospline.cli.main import main

ffmpeg = pytest.importorskip("imageio_ffmpeg")

SIZE = (64, 48)
BOUNDS = np.array([(-3, 10, 2), (5, 11, 8)])


@pytest.fixture(scope="module")
def images():
    field = volumes.torus()
    scene = isospline.Scene([isospline.Isosurface(field.volume(24), field.level)])
    cameras = isospline.turntable_cameras(scene, 5, size=SIZE)
    shading = isospline.Phong(color=(1, 0.4, 0.1))
    return [isospline.render(scene, camera, size=SIZE, light=shading, samples=4) for camera in cameras]


def read(path):
    """Frames of a video, (count, height, width, 3), and FFmpeg's description of it."""
    command = [ffmpeg.get_ffmpeg_exe(), "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    result = subprocess.run(command, capture_output=True, check=True)
    about = re.search("Video: .*", result.stderr.decode()).group()
    width, height = map(int, re.search(r", (\d+)x(\d+)", about).groups())
    return np.frombuffer(result.stdout, np.uint8).reshape(-1, height, width, 3), about


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("view", ["front", "iso", "top", (1, 2, -3)])
def test_a_turntable_keeps_its_distance_and_has_all_in_view(view, projection):
    cameras = isospline.turntable_cameras(BOUNDS, 7, view=view, projection=projection, size=SIZE, margin=0.1)
    first = isospline.camera_for(BOUNDS, view=view, projection=projection, size=SIZE, margin=0.1)
    np.testing.assert_allclose(cameras[0].world_to_camera[2, :3], first.world_to_camera[2, :3], atol=1e-12)
    pixels = np.stack([project(camera.world_to_ndc(SIZE), corners_of(BOUNDS), SIZE) / SIZE for camera in cameras])
    assert pixels.min() >= 0.05 - 1e-9 and pixels.max() <= 0.95 + 1e-9
    assert np.abs(pixels - 0.5).max() == pytest.approx(0.45)

    arms = np.stack([camera.eye - camera.target for camera in cameras])
    np.testing.assert_allclose(np.linalg.norm(arms, axis=1), np.linalg.norm(arms[0]))
    up = first.up / np.linalg.norm(first.up)
    np.testing.assert_allclose(arms @ up, arms[0] @ up, atol=1e-9)
    # Counter-clockwise about up, by equal angles, also from the last camera to the first.
    level = arms - np.outer(arms @ up, up)
    following = np.roll(level, -1, axis=0)
    angle = np.degrees(np.arctan2(np.cross(level, following) @ up, (level * following).sum(1)))
    np.testing.assert_allclose(angle, 360 / 7)


def test_bad_turntables():
    for count in (0, -1, 2.5):
        with pytest.raises(ValueError, match="^count: expected .* got "):
            isospline.turntable_cameras(BOUNDS, count)
    with pytest.raises(ValueError, match="^up: expected"):
        isospline.turntable_cameras(BOUNDS, 4, view="front", up=(0, 1, 0))


def test_a_video_shows_the_images(images, tmp_path):
    path = tmp_path / "turn.mp4"
    isospline.write_video(path, iter(images), fps=12.5, quality=10)
    assert os.listdir(tmp_path) == ["turn.mp4"]
    frames, about = read(path)
    assert "h264 (High) " in about and "yuv420p(tv, bt709" in about and "unknown" not in about and " 12.50 fps" in about
    assert b"colrnclx\0\1\0\1\0\1" in path.read_bytes()  # ISO/IEC 14496-12: primaries, transfer and matrix of BT.709
    assert frames.shape == (5, 48, 64, 3)
    expected = np.stack([image.to_srgb()[..., :3] * (image.color[..., 3:] > 0) for image in images]).astype(float)
    inside = np.stack([image.color[..., 3] == 1 for image in images])
    # 4:2:0 halves the resolution of colour: pixels at silhouettes differ more.
    assert np.abs(frames - expected)[inside].mean() < 4
    assert np.abs(frames.mean((0, 1, 2)) - expected.mean((0, 1, 2))).max() < 2


def test_bad_videos(images, tmp_path, monkeypatch):
    def refused(error, message, images=images, name="a.mp4", **options):
        with pytest.raises(error, match=message):
            isospline.write_video(tmp_path / name, images, **options)
        assert not os.listdir(tmp_path)

    refused(ValueError, "path: expected", name="a.avi")
    refused(ValueError, "images: expected at least one", images=[])
    refused(ValueError, "fps: expected", fps=0)
    refused(ValueError, "fps: expected", fps=np.nan)
    refused(ValueError, "quality: expected", quality=11)
    scene, camera = isospline.Scene(), isospline.PerspectiveCamera((0, -1, 0), (0, 0, 0))
    refused(ValueError, "size: expected an even", images=[isospline.render(scene, camera, size=(9, 8), light="phong")])
    other = isospline.render(scene, camera, size=(8, 8), light="phong")
    refused(ValueError, "images: expected all of one size", images=[images[0], other])
    refused(OSError, "No such file", name="missing/a.mp4")

    def broken():
        yield images[0]
        raise KeyError("mine")

    refused(KeyError, "mine", images=broken())
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    refused(ImportError, r"pip install isospline\[video\]")


@pytest.mark.skipif(sys.platform == "win32", reason="limits of POSIX")
def test_a_full_disk_is_told_and_leaves_no_video(tmp_path):
    program = """
        import resource, signal, sys
        import isospline
        camera = isospline.PerspectiveCamera((0, -1, 0), (0, 0, 0))
        image = isospline.render(isospline.Scene(), camera, size=(64, 64))
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (500, 500))
        try:
            isospline.write_video(sys.argv[1], [image] * 5)
        except OSError as error:
            print(error.filename, error.strerror)
    """
    path = tmp_path / "a.mp4"
    command = [sys.executable, "-c", textwrap.dedent(program), str(path)]
    done = subprocess.run(command, stdout=subprocess.PIPE, encoding="utf-8", check=True)
    assert done.stdout == f"{path} File too large\n"
    assert not os.listdir(tmp_path)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_interrupting_leaves_no_video(tmp_path, ball):
    command = [
        sys.executable,
        "-m",
        "isospline",
        "render",
        str(ball),
        "--level",
        "0",
        "--fast",
        "--size",
        "160x120",
        "--samples",
        "64",
        "--turntable",
        "3600",
        "-o",
        str(tmp_path / "a.mp4"),
    ]
    process = subprocess.Popen(
        command, stderr=subprocess.PIPE, encoding="utf-8", start_new_session=True, preexec_fn=obey_signals
    )
    deadline = time.monotonic() + 60
    while not list(tmp_path.glob(".*.part")) and time.monotonic() < deadline:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    error = process.communicate(timeout=60)[1]
    *progress, last = error.splitlines()  # a line every ten seconds, on a busy machine
    assert (process.returncode, last) == (130, "isospline: interrupted")
    told = "isospline: ([a-z ]+: [0-9]+%, .*|rendering takes about [0-9]+ s.*)"
    assert all(re.fullmatch(told, line) for line in progress)
    assert [path.name for path in tmp_path.iterdir()] == ["ball.npy"]


def test_an_interruption_while_ffmpeg_starts_leaves_no_video(tmp_path, monkeypatch, images):
    ffmpeg.get_ffmpeg_exe()  # it starts FFmpeg once, too
    begin, started = subprocess.Popen, []

    def interrupted(*arguments, **options):
        started.append(begin(*arguments, **options))
        signal.raise_signal(signal.SIGINT)
        return started[-1]

    monkeypatch.setattr(subprocess, "Popen", interrupted)
    with pytest.raises(KeyboardInterrupt):
        isospline.write_video(tmp_path / "a.mp4", images)
    assert started[-1].poll() is not None
    assert not os.listdir(tmp_path)


@pytest.fixture
def ball(tmp_path):
    np.save(tmp_path / "ball.npy", volumes.sphere(0.7).values(20))
    return tmp_path / "ball.npy"


def render(*arguments):
    return main(["render", *map(str, arguments)])


def test_turntable_on_the_command_line(ball, tmp_path, capsys):
    common = (ball, "--level", "0", "--size", "48x32", "--samples", "1", "--turntable", "3")
    assert render(*common, "--fps", "10", "-o", tmp_path / "turn.mp4") == 0
    frames, about = read(tmp_path / "turn.mp4")
    assert len(frames) == 3 and " 10 fps" in about and frames.max() > 100
    assert "turn.mp4: 3 pictures of 48 x 32, " in capsys.readouterr().out

    assert render(*common, "-o", tmp_path / "turn-###.png") == 0
    assert sorted(path.name for path in tmp_path.glob("*.png")) == ["turn-000.png", "turn-001.png", "turn-002.png"]


def test_animations_and_folders_on_the_command_line(ball, tmp_path, capsys):
    common = (ball, "--level", "0", "--size", "31x20", "--samples", "1", "--fast", "--turntable", "3")
    assert render(*common, "--fps", "10", "-o", tmp_path / "turn.gif") == 0
    frames, about = read(tmp_path / "turn.gif")
    assert frames.shape == (3, 20, 31, 3) and about.startswith("Video: gif") and " 10 fps" in about
    assert render(*common, "-o", tmp_path / "turn") == 0
    names = [f"frame-000{number}.png" for number in range(3)]
    assert sorted(os.listdir(tmp_path / "turn")) == [*names, "frames.json"]
    os.remove(tmp_path / "turn" / names[1])
    assert render(*common, "--resume", "-o", tmp_path / "turn") == 0
    assert "2 of 3 pictures exist already" in capsys.readouterr().err
    assert sorted(os.listdir(tmp_path / "turn")) == [*names, "frames.json"]
    assert render(*common[:-1], "2", "-o", tmp_path / "turn") == 2
    assert "expected a folder without pictures after the 2" in capsys.readouterr().err


def test_bad_turntables_on_the_command_line(ball, tmp_path, capsys):
    def fails(message, *arguments):
        assert render(ball, "--level", "0", *arguments) == 2
        assert message in capsys.readouterr().err
        assert [path.name for path in tmp_path.iterdir()] == ["ball.npy"]

    fails("for a video, say --turntable", "-o", tmp_path / "a.mp4")
    fails("such as turn-####.png", "--turntable", "3", "-o", tmp_path / "a.png")
    fails("such as turn-####.png", "--turntable", "3", "-o", tmp_path / "#-#.png")
    fails("at least 1 picture", "--turntable", "0", "-o", tmp_path / "a.mp4")
    fails("fps: expected", "--turntable", "3", "--fps", "-1", "-o", tmp_path / "a.mp4")
    fails("size: expected an even", "--turntable", "3", "--size", "31x20", "-o", tmp_path / "a.mp4")
