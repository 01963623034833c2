"""Environments from files that another library has written."""

import struct

import numpy as np
import pytest
from environment_files import write_exr, write_hdr

import isospline
from isospline.cli.light_options import LIGHTS
from isospline.picture import studio
from isospline.picture.lights import NAMED
from isospline.suggest.view import SuggestedView


@pytest.fixture
def sky(rng):
    image = rng.uniform(0, 3, (8, 16, 3)).astype(np.float32)
    image[0, 0], image[1, 1] = 0, (500, 2, 1e-3)
    return image


@pytest.fixture(scope="module")
def ball():
    field = isospline.volumes.sphere(0.7)
    return isospline.Isosurface(field.volume(16), field.level)


def test_exr_is_read_as_it_was_written(tmp_path, sky):
    write_exr(tmp_path / "sky.exr", {"RGB": sky})
    got = isospline.read_environment(tmp_path / "sky.exr")
    assert got.dtype == np.float32
    np.testing.assert_array_equal(got, sky)


def test_half_floats_and_other_channels_are_read(tmp_path, sky):
    channels = {name: sky[..., i].astype(np.float16) for i, name in enumerate("RGB")}
    write_exr(tmp_path / "sky.exr", {**channels, "A": np.ones((8, 16), np.float16), "Z": sky[..., 0]})
    np.testing.assert_array_equal(isospline.read_environment(tmp_path / "sky.exr"), sky.astype(np.float16))


def test_hdr_is_read_as_it_was_written(tmp_path, sky):
    write_hdr(tmp_path / "sky.HDR", sky)
    got = isospline.read_environment(str(tmp_path / "sky.HDR"))
    # All channels share the exponent of the largest one, and have 8 bits; the rest is truncated.
    assert (np.abs(got - sky) <= sky.max(axis=-1, keepdims=True) / 128).all()
    assert (got[0, 0] == 0).all() and got[1, 1, 0] == pytest.approx(500, rel=1 / 128)


@pytest.mark.parametrize("axes, y, x", [("+Y 8 +X 16", -1, 1), ("-Y 8 -X 16", 1, -1), ("+Y 8 -X 16", -1, -1)])
def test_hdr_that_is_mirrored_stands_upright(tmp_path, sky, axes, y, x):
    write_hdr(tmp_path / "sky.hdr", sky)
    write_hdr(tmp_path / "mirrored.hdr", sky[::y, ::x])
    content = (tmp_path / "mirrored.hdr").read_bytes()
    (tmp_path / "mirrored.hdr").write_bytes(content.replace(b"-Y 8 +X 16", axes.encode()))
    got, expected = (isospline.read_environment(tmp_path / name) for name in ("mirrored.hdr", "sky.hdr"))
    np.testing.assert_array_equal(got, expected)


@pytest.mark.parametrize("axes", ["+X 8 -Y 16", "-X 8 +Y 16", "+X 8 +Y 16", "-X 8 -Y 16"])
def test_hdr_by_columns_is_refused(tmp_path, sky, axes):
    write_hdr(tmp_path / "sky.hdr", sky)
    content = (tmp_path / "sky.hdr").read_bytes()
    (tmp_path / "sky.hdr").write_bytes(content.replace(b"-Y 8 +X 16", axes.encode()))
    with pytest.raises(ValueError, match=r"sky\.hdr: expected an image stored by rows, got one stored by columns"):
        isospline.read_environment(tmp_path / "sky.hdr")


def test_the_display_window_of_exr_is_the_sphere(tmp_path, sky):
    window, display = (tuple(np.int32(box)) for box in ([(4, -2), (19, 5)], [(0, 0), (15, 7)]))
    write_exr(tmp_path / "sky.exr", {"RGB": sky}, dataWindow=window, displayWindow=display)
    expected = np.zeros_like(sky)
    expected[:6, 4:] = sky[2:, :12]
    np.testing.assert_array_equal(isospline.read_environment(tmp_path / "sky.exr"), expected)


def test_negative_values_are_black(tmp_path, sky):
    write_exr(tmp_path / "sky.exr", {"RGB": sky - 1})
    np.testing.assert_array_equal(isospline.read_environment(tmp_path / "sky.exr"), np.maximum(sky - 1, 0))


def test_it_lights_as_its_pixels_do(tmp_path, sky):
    write_exr(tmp_path / "sky.exr", {"RGB": sky})
    light = isospline.EnvironmentLight(0.5, image=isospline.read_environment(tmp_path / "sky.exr"), visible=True)
    image = isospline.render(
        isospline.Scene([]),
        isospline.PanoramicCamera((0, 0, 0), (1, 0, 0)),
        size=(16, 8),
        light=isospline.PathTracer(lights=[light]),
    )
    np.testing.assert_allclose(image.color[..., :3], 0.5 * sky, rtol=1e-6)


def test_files_that_are_no_environments(tmp_path, sky, monkeypatch):
    def refused(path, message, kind=ValueError):
        with pytest.raises(kind, match=message):
            isospline.read_environment(path)

    refused(tmp_path / "sky.png", r"^path: expected a name that ends in \.exr or \.hdr")
    refused(tmp_path / "no.hdr", r"no\.hdr", FileNotFoundError)
    (tmp_path / "folder.hdr").mkdir()
    refused(tmp_path / "folder.hdr", "folder", IsADirectoryError)
    refused(3, "path: expected a str or path-like", TypeError)
    for suffix in ("exr", "hdr"):
        path = tmp_path / f"a.{suffix}"
        for content in (b"", b"nonsense", b"#?RADIANCE\n\n-Y 5 +X 5\n" + bytes(3), struct.pack("<II", 20000630, 2)):
            path.write_bytes(content)
            refused(path, rf"a\.{suffix}: cannot be read as an environment: [^\n]+$")
    write_exr(tmp_path / "gray.exr", {"Y": sky[..., 0]})
    refused(tmp_path / "gray.exr", "gray.exr: expected channels R, G and B, got none named R")
    sky[3, 3, 1] = np.nan
    write_exr(tmp_path / "nan.exr", {"RGB": sky})
    refused(tmp_path / "nan.exr", "nan.exr: expected finite numbers, got nan")
    monkeypatch.setitem(__import__("sys").modules, "OpenImageIO", None)
    refused(tmp_path / "nan.exr", r"pip install isospline\[light\]", ImportError)


def test_cut_files_are_told(tmp_path, sky):
    write_hdr(tmp_path / "sky.hdr", sky)
    whole = (tmp_path / "sky.hdr").read_bytes()
    for length in range(0, len(whole), 37):
        (tmp_path / "cut.hdr").write_bytes(whole[:length])
        with pytest.raises(ValueError, match="cut.hdr: cannot be read as an environment"):
            isospline.read_environment(tmp_path / "cut.hdr")


@pytest.mark.parametrize("name", NAMED)
def test_lights_have_the_names_of_the_command(name, ball):
    assert list(NAMED) == list(LIGHTS)
    options = dict(size=(12, 9), samples=2)
    assert isospline.render(ball, light=name, **options) == isospline.render(ball, light=NAMED[name](), **options)
    if name not in ("studio", "path-trace"):
        of_objects = isospline.render(ball, light={0: name}, **options)
        assert of_objects == isospline.render(ball, light=NAMED[name](), **options)
    with pytest.raises(ValueError, match="^light: expected one of studio, phong, .*, got 'sun'"):
        isospline.render(ball, light="sun")


@pytest.mark.parametrize("given", [0.5, (1, 0.5, 0.2)], ids=["brightness", "colour"])
def test_an_environment_lights_the_scene(ball, given):
    options = dict(size=(12, 9), samples=2)
    wanted = isospline.render(ball, light=isospline.PathTracer(lights=[isospline.EnvironmentLight(given)]), **options)
    for light in (None, "path-trace", isospline.PathTracer()):
        assert isospline.render(ball, light=light, environment=given, **options) == wanted
    lamp = isospline.DirectionalLight((0, 1, -1))
    both = isospline.PathTracer(lights=[lamp, isospline.EnvironmentLight(given)])
    lit = isospline.render(ball, light=isospline.PathTracer(lights=[lamp]), environment=given, **options)
    assert lit == isospline.render(ball, light=both, **options) and lit != wanted
    with pytest.raises(ValueError, match="^environment: expected light=.path-trace. or a PathTracer with it, got 'stu"):
        isospline.render(ball, light="studio", environment=given)
    with pytest.raises(ValueError, match="^environment: expected a PathTracer without an EnvironmentLight"):
        isospline.render(ball, light=both, environment=given)


@pytest.mark.parametrize("up", [(0, 0, 1), (0, 0, -1)])
def test_the_zenith_is_above_in_the_picture(ball, up, monkeypatch):
    """Also of a volume whose top is below."""
    if up != (0, 0, 1):
        monkeypatch.setattr(studio, "suggested_view", lambda scene: SuggestedView(up=up))
    sky = np.zeros((8, 16, 3))
    sky[:4], sky[4:] = (0, 0, 1), (1, 0, 0)
    camera = isospline.PerspectiveCamera((0, -5, 0), (0, 0, 0), up)
    options = dict(size=(12, 8), samples=16)
    image = isospline.render(ball, camera, environment=isospline.EnvironmentLight(sky, visible=True), **options)
    assert np.allclose(image.color[0, 0, :3], (0, 0, 1)) and np.allclose(image.color[-1, 0, :3], (1, 0, 0))
    red, _, blue = image.color[:4, 6, :3].sum(axis=0) - image.color[4:, 6, :3].sum(axis=0)
    assert blue > 0 > red
    without = isospline.render(ball, camera, environment=sky, **options)
    assert not without.color[0, 0].any() and without.color[3, 6, 3] == 1
