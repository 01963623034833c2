"""Turns and other animations in one call: the frames that they write, and what is left after errors."""

import copy
import os
import subprocess
import tracemalloc

import numpy as np
import PIL.Image
import pytest

import isospline
from isospline import volumes
from isospline.picture import animation, rendering

SIZE = (48, 32)


@pytest.fixture(scope="module")
def surface():
    field = volumes.heart()
    return isospline.Isosurface(field.volume(24), field.level, color="firebrick", name="heart")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The empty working directory of a test."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def pixels(path):
    with PIL.Image.open(path) as file:
        return np.asarray(file)


def frames_of_gif(path):
    """The frames of a GIF, by Pillow, and their times in milliseconds."""
    with PIL.Image.open(path) as file:
        frames, times = [], []
        for number in range(file.n_frames):
            file.seek(number)
            frames.append(np.asarray(file.convert("RGB")).astype(int))
            times.append(file.info["duration"])
        assert file.info["loop"] == 0
    return np.stack(frames), times


@pytest.mark.parametrize("light", [None, "phong", "path-trace"])
def test_a_turn_has_the_pictures_of_its_cameras(surface, folder, light):
    options = dict(size=SIZE, light=light, samples=2, background="white")
    assert isospline.turntable(surface, folder / "turn", frames=3, view="front", **options) == folder / "turn"
    assert sorted(os.listdir("turn")) == ["frame-0000.png", "frame-0001.png", "frame-0002.png"]
    cameras = isospline.turntable_cameras(surface, 3, view="front", size=SIZE)
    for number, camera in enumerate(cameras):
        expected = isospline.render(surface, camera, **options).to_srgb()
        np.testing.assert_array_equal(pixels(folder / "turn" / f"frame-{number:04}.png"), expected)


def test_a_turn_is_written_to_videos_and_numbered_pictures(surface, folder):
    encoder = pytest.importorskip("imageio_ffmpeg").get_ffmpeg_exe()
    options = dict(size=SIZE, background="white", samples=1)
    isospline.turntable(surface, "turn-##.png", frames=4, **options)
    isospline.turntable(surface, "turn.gif", seconds=0.4, fps=10, **options)
    isospline.turntable(surface, "turn.mp4", frames=4, fps=10, quality=10, **options)
    isospline.turntable(surface, "##.exr", frames=1, **options)
    assert sorted(os.listdir()) == ["00.exr", *(f"turn-0{number}.png" for number in range(4)), "turn.gif", "turn.mp4"]

    expected = np.stack([pixels(f"turn-0{number}.png")[..., :3] for number in range(4)]).astype(int)
    of_gif, times = frames_of_gif("turn.gif")
    assert times == [100] * 4
    assert np.abs(of_gif - expected).mean() < 4 and np.abs(expected - np.roll(expected, 1, axis=0)).mean() > 8
    command = [encoder, "-v", "error", "-i", "turn.mp4", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    of_mp4 = np.frombuffer(subprocess.run(command, capture_output=True, check=True).stdout, np.uint8)
    assert np.abs(of_mp4.reshape(expected.shape) - expected).mean() < 8


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_the_legend_and_colour_bars_of_a_turn_hide_nothing(folder, monkeypatch, projection):
    field = volumes.heart()
    rule = isospline.ColorByCurvature(limits=(-5, 5))
    surface = isospline.Isosurface(field.volume(24), field.level, color=rule, name="a long name")
    plain = []

    def without_marks(*given, **options):
        plain.append(rendering.without_marks(*given, **options))
        return copy.copy(plain[-1])

    monkeypatch.setattr(animation, "without_marks", without_marks)
    options = dict(size=(320, 120), samples=1, projection=projection, view="front", light="phong")
    isospline.turntable(surface, "marked", frames=3, legend=True, annotate="colorbar", **options)
    places = []
    for number, image in enumerate(plain):
        covered = image.color[..., 3] > 0
        marks = (pixels(f"marked/frame-{number:04}.png") != image.to_srgb()).any(axis=-1)
        assert covered.mean() > 0.05 and not (covered & marks).any()
        columns = np.flatnonzero(marks.any(axis=0))
        assert columns.min() < np.flatnonzero(covered.any(axis=0)).min() < columns.max()
        places.append(columns)
    assert all(np.array_equal(places[0], each) for each in places)


def test_the_environment_of_a_turn_is_that_of_pictures(surface, folder):
    sky = np.ones((4, 8, 3)) * np.linspace(2, 0.2, 4)[:, None, None]
    isospline.turntable(surface, "a", frames=2, size=SIZE, environment=sky, samples=2)
    cameras = isospline.turntable_cameras(surface, 2, size=SIZE)
    expected = isospline.render(surface, cameras[1], size=SIZE, environment=sky, samples=2)
    np.testing.assert_array_equal(pixels("a/frame-0001.png"), expected.to_srgb())


def test_anything_that_is_rendered_is_turned(surface, folder):
    array = volumes.torus().values(12)
    for scene in ([surface, surface.to_mesh()], isospline.Scene(surface), surface.volume, array):
        isospline.turntable(scene, "turn-#.png", frames=1, size=(8, 6), samples=1, light="phong")
        assert pixels("turn-0.png")[..., 3].any()
        os.remove("turn-0.png")
    isospline.turntable(array, "turn-#.png", frames=1, size=(8, 6), level=-0.1, light="phong")


def test_time_runs_from_zero_to_one_without_one(folder):
    times = []

    def picture(t):
        times.append(t)
        return np.full((6, 8, 3), round(200 * t), np.uint8)

    told = []
    assert isospline.animate(picture, "a-#.png", frames=4, progress=told.append).name == "a-#.png"
    assert times == [0, 0.25, 0.5, 0.75] and told == [*times, 1.0]
    assert [pixels(f"a-{number}.png")[2, 3].tolist() for number in range(4)] == [
        [value, value, value, 255] for value in (0, 50, 100, 150)
    ]
    times.clear()
    isospline.animate(picture, "b", seconds=0.5, fps=6)
    assert len(times) == 3 and len(os.listdir("b")) == 3


def test_images_and_arrays_are_frames(surface, folder):
    pytest.importorskip("imageio_ffmpeg")
    image = isospline.render(surface, size=SIZE, light="phong")
    clear = image.to_srgb().copy()
    assert 0 < (clear[..., 3] == 0).mean() < 1
    for frame in (image, clear):
        isospline.animate(lambda t, frame=frame: frame, "a-#.png", frames=1)
        np.testing.assert_array_equal(pixels("a-0.png"), image.to_srgb())
        isospline.animate(lambda t, frame=frame: frame, "a.gif", frames=1)
        (shown,), _ = frames_of_gif("a.gif")
        assert (shown[clear[..., 3] == 0] < 12).all()  # on black


def test_frames_are_written_one_by_one(folder):
    """The peak of memory does not grow with the number of frames."""
    pytest.importorskip("imageio_ffmpeg")

    def peak(frames):
        tracemalloc.start()
        isospline.animate(lambda t: np.full((128, 128, 3), 9, np.uint8), "a.gif", frames=frames)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peak

    peak(2)
    assert peak(40) < peak(4) + 2 * 128 * 128 * 3


@pytest.mark.parametrize(
    "wrong",
    [
        None,
        "a.png",
        3.0,
        np.zeros((4, 6)),
        np.zeros((4, 6, 3)),
        np.zeros((4, 6, 2), np.uint8),
        np.zeros((0, 6, 3), "u1"),
    ],
    ids=lambda value: str(getattr(value, "shape", value)),
)
def test_functions_return_pictures(folder, wrong):
    message = r"^function: expected an Image or a \(height, width, 3 or 4\) uint8 array from function\(0\.5\), got "
    frames = iter([np.zeros((4, 6, 3), np.uint8), wrong])
    for name, left in (("a.gif", []), ("a-#.png", ["a-0.png"])):
        if name == "a.gif":
            pytest.importorskip("imageio_ffmpeg")
        frames = iter([np.zeros((4, 6, 3), np.uint8), wrong])
        with pytest.raises(TypeError, match=message):
            isospline.animate(lambda t, frames=frames: next(frames), name, frames=2)
        assert os.listdir() == left


@pytest.mark.parametrize("error", [KeyError("mine"), KeyboardInterrupt(), isospline.Cancelled()])
def test_no_part_of_a_video_is_left(surface, folder, error):
    pytest.importorskip("imageio_ffmpeg")
    (folder / "a.mp4").write_bytes(b"old")

    def picture(t):
        if t > 0.4:
            raise error
        return isospline.render(surface, size=SIZE, light="phong")

    with pytest.raises(type(error)):
        isospline.animate(picture, "a.mp4", frames=4)
    told = []
    with pytest.raises(isospline.Cancelled):
        isospline.turntable(
            surface,
            "a.mp4",
            frames=4,
            size=SIZE,
            progress=lambda part: told.append(part) or part < 0.5,
            light="phong",
        )
    assert os.listdir() == ["a.mp4"] and (folder / "a.mp4").read_bytes() == b"old"
    assert 0.5 <= max(told) < 1
    with pytest.raises(isospline.Cancelled):
        isospline.animate(picture, "b", frames=4, progress=lambda part: False)
    assert os.listdir() == ["a.mp4"]


def test_bad_animations(surface, folder):
    def refused(error, message, path="turn", **options):
        for call in (
            lambda: isospline.turntable(surface, path, **{"size": SIZE, **options}),
            lambda: isospline.animate(lambda t: pytest.fail("called"), path, **options),
        ):
            if "size" in options or "samples" in options:
                call = lambda: isospline.turntable(surface, path, **options)  # noqa: E731
            with pytest.raises(error, match=message):
                call()
            assert os.listdir() == []

    refused(ValueError, r"^path: expected the name of a video, .* got 'a\.avi'", "a.avi")
    refused(ValueError, r"^path: expected one #### for the number in it, .* got 'a\.png'", "a.png")
    refused(ValueError, "^path: expected the name of a video or of a folder, got an empty one", "")
    refused(FileNotFoundError, "expected a folder that exists", "no/a")
    refused(TypeError, "^path: expected a str or path-like, got None", None)
    refused(ValueError, "^frames: expected a whole number of at least 1, got 0", frames=0)
    refused(ValueError, "^seconds: cannot be combined with frames, got 3 and 2", frames=2, seconds=3)
    for wrong in (0, -1, np.nan, np.inf, 1e300):
        refused(ValueError, "^seconds: expected a number above 0", seconds=wrong)
    refused(TypeError, "^seconds: expected a number, got '3'", seconds="3")
    refused(ValueError, "^fps: expected a positive number", fps=0)
    refused(ValueError, "^quality: expected a number from 0 to 10, got 11", quality=11)
    refused(ValueError, "^samples: expected a whole number", samples=0)
    if pytest.importorskip("imageio_ffmpeg"):
        refused(FileNotFoundError, "expected a folder that exists", "no/a.gif")
        refused(ValueError, "^fps: expected 0.00153 to 50 images a second of a GIF, got 60", "a.gif", fps=60)
        refused(ValueError, "^fps: expected 0.00153 to 50 images a second of a GIF, got 0.001", "a.gif", fps=0.001)
        refused(ValueError, "^size: expected an even width and height", "a.mp4", size=(31, 24))


def test_a_folder_has_no_pictures_of_a_longer_turn(surface, folder):
    isospline.turntable(surface, "turn", frames=2, size=(8, 6), light="phong")
    (folder / "turn" / "other.txt").touch()
    isospline.turntable(surface, "turn", frames=2, size=(6, 6), light="phong")
    assert pixels("turn/frame-0001.png").shape == (6, 6, 4)
    with pytest.raises(ValueError, match=r"^path: expected a folder without pictures after the 1 .* frame-0001\.png"):
        isospline.turntable(surface, "turn", frames=1, size=(8, 6), light="phong")


@pytest.mark.parametrize("path", ["##.png", "sub/turn-##.png", "a+##b.png"])
def test_numbered_pictures_are_not_among_those_of_a_longer_turn(folder, path):
    (folder / "sub").mkdir()
    picture = np.zeros((4, 6, 3), np.uint8)
    isospline.animate(lambda t: picture, path, frames=3)
    for other in ("x01.png", "turn-5.png", "turn-05.exr", "a+7b.png", "aa07b.png"):
        (folder / path).with_name(other).touch()
    isospline.animate(lambda t: picture, path, frames=3)
    with pytest.raises(ValueError, match=r"^path: expected a folder without pictures after the 2 .*02b?\.png: remove"):
        isospline.animate(lambda t: picture, path, frames=2)
    isospline.animate(lambda t: picture, path.replace("#b", "#c"), frames=3)


def test_frames_have_one_size(folder):
    frames = iter([np.zeros((4, 6, 3), np.uint8), np.zeros((6, 6, 3), np.uint8)])
    with pytest.raises(ValueError, match=r"^function: expected frames of one size, got \(6, 4\) and \(6, 6\)"):
        isospline.animate(lambda t: next(frames), "a", frames=2)


def test_calls_that_meant_another_function_are_answered(surface, folder):
    for wrong in (36, 36.0):
        with pytest.raises(
            TypeError, match=rf"^path: .* got {wrong}; did you mean turntable_cameras\(scene, {wrong}\)\?"
        ):
            isospline.turntable(surface, wrong, view="front", light="phong")
    with pytest.raises(TypeError, match=r"^count: .*turntable_cameras\(scene, count\)"):
        isospline.turntable(surface, count=36, light="phong")
    with pytest.raises(TypeError, match=r"^function: .* got Isosurface; did you mean turntable\(scene, path\)\?"):
        isospline.animate(surface, "a.gif")
    with pytest.raises(TypeError, match=r"^function: .* did you mean write_video\(path, images\)\?"):
        isospline.animate([isospline.render(surface, size=SIZE, light="phong")], "a.gif")
