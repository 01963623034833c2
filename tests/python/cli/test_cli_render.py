"""The command `render`: its pictures are those of the library."""

import re
import sys
import types

import numpy as np
import pytest
from command_line import fails, leftovers, pixels, render, rendered

import isospline
from isospline.cli.main import main

PNG, EXR = b"\x89PNG\r\n\x1a\n", b"\x76\x2f\x31\x01"


@pytest.mark.parametrize(
    "options",
    [
        [],
        ["--light", "outline", "--exponent", "3", "--background", "1,1,1"],
        ["--view", "-x", "--projection", "orthographic", "--background", "none"],
        ["--view", "-1,2,0.5", "--up", "0,1,0", "--degree", "3"],
        ["--filter", "smoothing", "--smoothing", "0.1", "--boundary", "periodic"],
        ["--lamp", "1,-1,2", "--lamp", "-x", "--shadows"],
        ["--light", "ambient-occlusion", "--samples", "1"],
        ["--light", "path-trace", "--samples", "2", "--environment", "0.5", "--lamp", "-1,-1,2,3"],
        ["--degree", "1", "--filter", "none", "--inside", "below", "--color", "1,0.5,0.2", "--background", "white"],
    ],
    ids=" ".join,
)
def test_render_writes_a_picture(ball, picture, capsys, options):
    assert main(["render", str(ball), "--level", "0", "--size", "48x32", "-o", str(picture), *options]) == 0
    printed = capsys.readouterr()
    assert picture.read_bytes().startswith(PNG)
    assert printed.out.startswith(f"{picture}: Image(48 x 32, ")
    assert re.sub("isospline: rendering takes about .*\n", "", printed.err) == ""  # on a machine that is busy
    assert leftovers(picture.parent) == ["picture.png"]


def test_render_gives_the_picture_of_the_library(ball, picture):
    image = pytest.importorskip("PIL.Image")
    render(ball, picture, "-l", "0", "--light", "phong")
    volume = isospline.Volume(np.load(ball))
    scene = isospline.Scene([isospline.Isosurface(volume, 0)])
    expected = isospline.render(
        scene, isospline.camera_for(scene, size=(48, 32)), size=(48, 32), background=0, light="phong"
    )
    np.testing.assert_array_equal(np.asarray(image.open(picture)), expected.to_srgb())


@pytest.mark.parametrize(
    "options, color",
    [
        (["--color-by", "normal"], isospline.ColorByNormal()),
        (["--color-by", "thickness", "--limits", "0,2"], isospline.ColorByThickness(limits=(0, 2))),
        (["--color-by", "depth", "--cmap", "magma"], isospline.ColorByDepth("magma")),
        (["--color-by", "mean-curvature", "--limits", "-0.1,0.2"], isospline.ColorByCurvature(limits=(-0.1, 0.2))),
        (
            ["--color-by", "gaussian-curvature", "--cmap", "gray", "--limits", "0,1"],
            isospline.ColorByCurvature("gaussian", "gray", limits=(0, 1)),
        ),
        (["--color-by", "FILE", "--limits", "-100,300"], None),
        (["--color-by", "STORE", "--limits", "-100,300"], None),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_render_colors_as_the_library_does(ball, picture, options, color):
    image = pytest.importorskip("PIL.Image")
    volume, store = isospline.Volume(np.load(ball)), ball.parent / "a.zarr"
    if "STORE" in options:
        pytest.importorskip("zarr")
        isospline.convert(np.load(ball), store)
    options = [{"FILE": str(ball), "STORE": str(store)}.get(option, option) for option in options]
    color = isospline.ColorByVolume(volume, limits=(-100, 300)) if color is None else color
    scene = isospline.Scene([isospline.Isosurface(volume, 0)])
    camera = isospline.camera_for(scene, size=(48, 32))
    for shading in (isospline.Phong(color=color), isospline.Outline(surface_color=color)):
        render(ball, picture, "-l", "0", "--light", type(shading).__name__.lower(), *options)
        expected = isospline.render(scene, camera, size=(48, 32), light=shading, background=0)
        np.testing.assert_array_equal(np.asarray(image.open(picture)), expected.to_srgb())


RIGHT, LEFT = isospline.DirectionalLight((-1, 0, 0)), isospline.DirectionalLight((1, 1, -2), intensity=0.25)


SUN = isospline.DirectionalLight((1, 1, -2), intensity=0.25 * np.pi)


RED = isospline.Material((0.8, 0.2, 0.1))


@pytest.mark.parametrize(
    "options, expected",
    [
        (["--lamp", "+x", "--lamp", "1,1,-2,0.25"], dict(light=isospline.Phong(lights=[RIGHT, LEFT]))),
        (
            ["--lamp", "left", "--shadows"],
            dict(light=isospline.Phong(lights=[isospline.DirectionalLight("left")], shadows=True)),
        ),
        (
            ["--light", "ambient-occlusion", "--color", "0.8,0.2,0.1"],
            dict(light=isospline.AmbientOcclusion(color=(0.8, 0.2, 0.1))),
        ),
        (
            ["--light", "outline", "--color", "0.8,0.2,0.1"],
            dict(light=isospline.Outline(surface_color=(0.8, 0.2, 0.1))),
        ),
        (["--light", "path-trace"], dict(light=isospline.PathTracer())),
        (
            ["--light", "path-trace", "--color", "0.8,0.2,0.1", "--lamp", "1,1,-2,0.25"],
            dict(light=isospline.PathTracer(RED, lights=[SUN])),
        ),
        (
            [
                "--light",
                "path-trace",
                "--color-by",
                "normal",
                "--environment",
                "0.5,0.6,0.7",
                "--lamp",
                "1,1,-2,0.25",
            ],
            dict(
                light=isospline.PathTracer(
                    isospline.Material(isospline.ColorByNormal()),
                    lights=[SUN, isospline.EnvironmentLight((0.5, 0.6, 0.7))],
                )
            ),
        ),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_render_lights_as_the_library_does(ball, picture, options, expected):
    render(ball, picture, "-l", "0", *options)
    np.testing.assert_array_equal(pixels(picture), rendered(ball, **expected).to_srgb())


@pytest.mark.parametrize(
    "options, clip",
    [
        (["--clip", "11,10,9,-1,0.5,0"], [isospline.HalfSpace((11, 10, 9), (-1, 0.5, 0))]),
        (
            ["--clip", "11,10,9,0,0,-1", "--clip-box", "-1,0,0,12,11,10"],
            [isospline.HalfSpace((11, 10, 9), (0, 0, -1)), isospline.Box((-1, 0, 0), (12, 11, 10))],
        ),
    ],
    ids=lambda value: " ".join(map(str, value)),
)
@pytest.mark.parametrize("capped", [False, True])
def test_render_cuts_as_the_library_does(ball, picture, options, clip, capped):
    open_ends = [] if capped else ["--no-capped", "--no-closed"]
    look = ["--view", "1,2,3", "--color-by", ball, "--light", "phong"]
    render(ball, picture, "-l", "0", *look, *options, *open_ends)
    volume = isospline.Volume(np.load(ball))
    scene = isospline.Scene([isospline.Isosurface(volume, 0, clip=clip, capped=capped)])
    camera = isospline.camera_for(scene, view=(1, 2, 3), size=(48, 32))
    shading = isospline.Phong(color=isospline.ColorByVolume(volume))
    expected = isospline.render(scene, camera, size=(48, 32), light=shading, background=0)
    np.testing.assert_array_equal(pixels(picture), expected.to_srgb())
    assert (scene.count_intersections(camera.rays((48, 32))) % 2 == 0).all() == capped


def test_path_tracing_takes_more_samples(ball, picture):
    assert main(["render", str(ball), "-l", "0", "--size", "48x32", "--light", "path-trace", "-o", str(picture)]) == 0
    expected = rendered(ball, light=isospline.PathTracer(), samples=64)
    np.testing.assert_array_equal(pixels(picture), expected.to_srgb())


def test_render_in_the_light_of_a_file(ball, tmp_path, rng):
    OpenEXR = pytest.importorskip("OpenEXR")
    sky = rng.uniform(0, 1, (4, 8, 3)).astype(np.float32)
    header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION}
    with OpenEXR.File(header, {"RGB": sky}) as file:
        file.write(str(tmp_path / "sky.exr"))
    render(
        ball,
        tmp_path / "a.png",
        "-l",
        "0",
        "--samples",
        "2",
        "--light",
        "path-trace",
        "--environment",
        tmp_path / "sky.exr",
    )
    integrator = isospline.PathTracer(lights=[isospline.EnvironmentLight(image=sky)])
    expected = rendered(ball, samples=2, light=integrator)
    np.testing.assert_array_equal(pixels(tmp_path / "a.png"), expected.to_srgb())


@pytest.mark.parametrize("shading", ["phong", "path-trace"])
def test_render_of_levels_and_meshes(ball, plate, picture, capsys, shading):
    colors = [(1, 0.1, 0.1), (0.1, 1, 0.1), (0.1, 0.1, 1)]
    options = [part for color in colors for part in ("--color", ",".join(map(str, color)))]
    render(ball, picture, "-l", "400", "-l", "0", "--mesh", plate, "--light", shading, *options)
    if shading == "phong":
        look = dict(light={number: isospline.Phong(color=color) for number, color in enumerate(colors)})
    else:
        materials = {number: isospline.Material(color) for number, color in enumerate(colors)}
        look = dict(light=isospline.PathTracer(materials=materials))
    expected = rendered(ball, (400, 0), [isospline.read_mesh(plate)], layers=("geometry_ids",), **look)
    np.testing.assert_array_equal(pixels(picture), expected.to_srgb())
    assert {1, 2} <= set(np.unique(expected.geometry_ids))
    cells = sum(isospline.Isosurface(isospline.Volume(np.load(ball)), level).shell.count for level in (400, 0))
    assert f", {cells} cells" in capsys.readouterr().out


@pytest.mark.parametrize("shading", [isospline.Phong, isospline.Outline, isospline.AmbientOcclusion])
def test_render_of_translucent_levels(ball, picture, shading):
    name = {isospline.Phong: "phong", isospline.Outline: "outline"}.get(shading, "ambient-occlusion")
    images = []
    for given, opacities in ((["0.25", "1"], (0.25, 1)), (["0.5"], (0.5, 0.5))):
        options = [part for opacity in given for part in ("--opacity", opacity)]
        render(ball, picture, "-l", "0", "-l", "400", "--light", name, *options)
        look = {number: shading(opacity=opacity) for number, opacity in enumerate(opacities)}
        images.append(pixels(picture))
        np.testing.assert_array_equal(images[-1], rendered(ball, (0, 400), light=look).to_srgb())
    assert (images[0] != images[1]).any()


def test_one_color_is_that_of_all(ball, plate, picture):
    render(ball, picture, "-l", "0", "--mesh", plate, "--light", "phong", "--color", "1,0.5,0.2")
    shading = isospline.Phong(color=(1, 0.5, 0.2))
    expected = rendered(ball, meshes=[isospline.read_mesh(plate)], light=shading)
    np.testing.assert_array_equal(pixels(picture), expected.to_srgb())


def test_render_denoises(ball, picture, monkeypatch, capsys):
    options = ["-l", "0", "--light", "path-trace", "--denoise"]
    monkeypatch.setitem(sys.modules, "pyoidn", None)
    fails(capsys, 1, "pip install pyoidn", "render", ball, *options, "-o", picture)
    assert not picture.exists()
    flat = types.SimpleNamespace(denoise=lambda color, **_: np.full_like(color, 0.25))
    monkeypatch.setitem(sys.modules, "pyoidn", flat)
    render(ball, picture, *options)
    assert np.unique(pixels(picture)[..., :3]).tolist() == [137]  # sRGB of 0.25


def test_render_stores_layers(ball, tmp_path):
    OpenEXR = pytest.importorskip("OpenEXR")
    render(
        ball,
        tmp_path / "a.exr",
        "-l",
        "0",
        "--samples",
        "2",
        "--light",
        "path-trace",
        "--layers",
        "curvature,ambient_occlusion,direct,mask",
        "--ambient-occlusion-samples",
        "8",
    )
    layers = dict(layers=("curvature", "ambient_occlusion", "direct", "mask"), ambient_occlusion_samples=8)
    expected = rendered(ball, samples=2, light=isospline.PathTracer(), **layers)
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
    np.testing.assert_array_equal(channels["direct.G"], expected.direct[..., 1])
    np.testing.assert_array_equal(channels["ambient_occlusion"], expected.ambient_occlusion)
    np.testing.assert_array_equal(channels["curvature.mean"], expected.curvature[..., 0])
    np.testing.assert_array_equal(channels["id.geometry"] == 0, expected.mask)


@pytest.mark.parametrize("light", ["studio", "unlit"])
def test_render_stores_the_mask(ball, tmp_path, light):
    OpenEXR = pytest.importorskip("OpenEXR")
    render(ball, tmp_path / "a.exr", "-l", "0", "--light", light, "--layers", "mask")
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        hit = file.channels()["id.geometry"].pixels == 0
    np.testing.assert_array_equal(hit, rendered(ball, light="phong", layers=("mask",)).mask)


def test_render_through_a_lens_stores_curvature(ball, tmp_path):
    OpenEXR = pytest.importorskip("OpenEXR")
    look = ["--light", "phong", "--layers", "curvature", "--samples", "4"]
    render(ball, tmp_path / "a.exr", "-l", "0", *look, "--aperture", "2", "--focus", "60")
    scene = isospline.Scene([isospline.Isosurface(isospline.Volume(np.load(ball)), 0)])
    camera = isospline.camera_for(scene, size=(48, 32)).with_lens(2, focus_distance=60)
    expected = isospline.render(
        scene, camera, size=(48, 32), background=0, samples=4, layers=("curvature",), light="phong"
    )
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        channels = file.channels()
        np.testing.assert_array_equal(channels["curvature.mean"].pixels, expected.curvature[..., 0])
        np.testing.assert_array_equal(channels["G"].pixels, expected.color[..., 1])


def test_render_writes_exr(ball, tmp_path):
    assert main(["render", str(ball), "--level", "0", "--size", "16x9", "-o", str(tmp_path / "picture.EXR")]) == 0
    assert (tmp_path / "picture.EXR").read_bytes().startswith(EXR)


def test_render_without_a_level_takes_the_first_suggestion(ball, picture, capsys):
    assert main(["render", str(ball), "--size", "16x9", "-o", str(picture)]) == 0
    first = isospline.suggest_levels(np.load(ball))[0]
    expected = f"isospline: level {first:g}, the first one of the suggested levels: {first:g}, "
    assert capsys.readouterr().err.startswith(expected)


@pytest.mark.parametrize("level", ["1e4", "-12345.5"])
def test_render_of_a_level_out_of_range_warns_and_writes(ball, picture, capsys, level):
    assert main(["render", str(ball), "--level", level, "--size", "16x9", "--no-closed", "-o", str(picture)]) == 0
    printed = capsys.readouterr()
    assert re.fullmatch(r"isospline: warning: level \S+ is out of the data's range.*\n", printed.err)
    assert "0% covered), 0 cells" in printed.out
    assert picture.exists()


@pytest.mark.parametrize("color", ["#d9c7a8", "ivory", "tab:blue", "r", "0.2,0.3,0.4", "0.5"])
def test_colors_of_the_command_line(ball, picture, color):
    render(ball, picture, "-l", "0", "--light", "phong", "--color", color, "--background", color)
    parts = color.split(",")
    with_numbers = parts[0][0] == "0"
    linear = ([float(part) for part in parts] * 3)[:3] if with_numbers else isospline.Phong(color=color).color
    volume = isospline.Volume(np.load(ball))
    expected = isospline.render(
        isospline.Isosurface(volume, 0), size=(48, 32), light=isospline.Phong(color=linear), background=linear
    )
    np.testing.assert_array_equal(pixels(picture), expected.to_srgb())


def test_marks_of_the_command_line(ball, picture):
    common = ["render", str(ball), "-l", "0", "--size", "160x48", "--fast", "-o", str(picture)]
    images = []
    for options in ([], ["--annotate"], ["--annotate", "scale-bar"], ["--color-by", "depth", "--annotate"]):
        assert main([*common, *options]) == 0
        images.append(pixels(picture))
    assert (images[0] != images[1]).any() and (images[1] == images[2]).all() and (images[2] != images[3]).any()
    # The corner of the scale bar is free, so that the camera is the same.
    traced = ["render", str(ball), "-l", "0", "--size", "160x48", "--light", "path-trace", "--samples", "2"]
    for options in ([], ["--annotate", "scale-bar"]):
        assert main([*traced, *options, "-o", str(picture)]) == 0
        images.append(pixels(picture))
    differs = (images[-1] != images[-2]).any(axis=(1, 2))
    assert differs.any() and not differs[:30].any()


@pytest.mark.parametrize("light", ["studio", "phong", "path-trace"])
@pytest.mark.parametrize("marks", [["--annotate"], ["--annotate", "colorbar"]])
def test_thickness_has_a_colour_bar(ball, picture, light, marks):
    options = ["-l", "0", "--size", "160x120", "--light", light, "--samples", "1", "--color-by", "thickness"]
    assert main(["render", str(ball), *options, *marks, "-o", str(picture)]) == 0
    surface = isospline.Isosurface(np.load(ball), 0, closed=True)
    annotate = True if len(marks) == 1 else "colorbar"
    options = dict(size=(160, 120), light=light, samples=1, color=isospline.ColorByThickness(), annotate=annotate)
    expected = isospline.render(surface, background=None if light == "studio" else 0.0, **options)
    np.testing.assert_array_equal(pixels(picture), expected.to_srgb())


@pytest.mark.parametrize(("option", "up"), [("-z", (0, 0, -1)), ("+y", (0, 1, 0)), ("1,0,1", (1, 0, 1))])
def test_upward_direction(ball, picture, option, up):
    render(ball, picture, "-l", "0", "--light", "phong", "--up", option, "--color-by", "normal")
    volume = isospline.Volume(np.load(ball))
    camera = isospline.camera_for(isospline.Isosurface(volume, 0), up=up, size=(48, 32))
    expected = isospline.render(
        isospline.Isosurface(volume, 0),
        camera,
        size=(48, 32),
        background=0,
        light=isospline.Phong(color=isospline.ColorByNormal()),
    )
    np.testing.assert_array_equal(pixels(picture), expected.to_srgb())
