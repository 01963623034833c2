"""The command line: its output, its files, and its errors."""

import json
import os
import re
import shlex
import signal
import struct
import subprocess
import sys
import time
import types

import numpy as np
import pytest
from interrupts import obey_interrupts

import isospline
from isospline import volumes
from isospline.cli import main
from isospline.cli_parser import make_parser
from isospline.levels import histogram

PNG, EXR = b"\x89PNG\r\n\x1a\n", b"\x76\x2f\x31\x01"


def run(*arguments, **options):
    command = [sys.executable, "-m", "isospline", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, encoding="utf-8", check=False, timeout=300, **options)


@pytest.fixture
def ball(tmp_path):
    """A ball of radius 0.7 in [-1, 1]^3, in whole samples: 700 r^2 below 490 inside."""
    path = tmp_path / "ball.npy"
    np.save(path, (1000 * volumes.sphere(0.7).samples((20, 22, 24))).astype(np.int16))
    return path


@pytest.fixture
def picture(tmp_path):
    return tmp_path / "picture.png"


def leftovers(folder):
    return sorted(path.name for path in folder.iterdir() if path.name != "ball.npy")


# demo


def test_demo_makes_a_volume_and_a_picture_and_prints_next_steps(tmp_path, capsys):
    image = pytest.importorskip("PIL.Image")
    folder = tmp_path / "a folder"
    assert main(["demo", "-o", str(folder)]) == 0
    printed = capsys.readouterr()
    assert sorted(path.name for path in folder.iterdir()) == ["demo.npy", "demo.png"]
    assert all(re.fullmatch("isospline: (filter|render)ing: .* left", line) for line in printed.err.splitlines())
    assert str(folder / "demo.npy") in printed.out and str(folder / "demo.png") in printed.out
    np.testing.assert_array_equal(np.load(folder / "demo.npy"), volumes.heart().samples(192))
    pixels = np.asarray(image.open(folder / "demo.png").convert("RGB")).astype(int)
    red = pixels[..., 0] > pixels[..., 1:].max(axis=-1) + 20
    assert 0.15 < red.mean() < 0.7 and red[:, 240:720].mean() > red[:, :240].mean()
    # The suggested next commands are valid, and find the volume.
    lines = [shlex.split(line) for line in printed.out.splitlines() if line.startswith("  isospline ")]
    assert [words[1] for words in lines] == ["info", "view", "render", "measure", "view", "render"]
    parse = make_parser(*["run"] * 7).parse_args
    assert all(parse(words[1:]).run == "run" for words in lines)
    assert main(lines[0][1:]) == 0 and "192 x 192 x 192" in capsys.readouterr().out


def test_demo_needs_a_folder_that_it_may_make(ball, capsys):
    fails(capsys, 2, "ball.npy: expected a folder, got a file", "demo", "-o", ball)


# info


def test_info_describes_a_file(ball, capsys):
    assert main(["info", str(ball), "--spacing", "0.5,1,2"]) == 0
    text = capsys.readouterr().out
    data = np.load(ball)
    assert "24 x 22 x 20   int16, 20.6 KiB" in text
    assert re.search(r"spacing +0\.5  1  2\n", text)
    assert re.search(r"direction +\+x \+y \+z\n", text)
    assert re.search(r"patient +not told\n", text)
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


def test_info_without_unicode(ball):
    result = run("info", ball, env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert result.returncode == 0 and "####" in result.stdout and "<- " in result.stdout


@pytest.mark.parametrize("environment", [{"PYTHONIOENCODING": "ascii"}, {"LC_ALL": "POSIX", "PYTHONUTF8": "0"}])
def test_names_that_the_terminal_cannot_show(ball, environment):
    """As on Python's standard error, their letters are escaped, or their bytes are written unchanged."""
    path = ball.rename(ball.with_name(os.fsdecode("µ.npy".encode())))
    environment = {**os.environ, "PYTHONCOERCECLOCALE": "0", **environment}
    for arguments in (["info", path], ["mesh", path, "-l", "0", "-o", path.with_suffix(".stl"), "--quiet"]):
        result = run(*arguments, env=environment)
        assert (result.returncode, result.stderr) == (0, "")
        assert re.search(r"(µ|\\xb5|\\udcc2\\udcb5)[.](npy|stl)", result.stdout)


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


# render


@pytest.mark.parametrize(
    "options",
    [
        [],
        ["--shading", "outline", "--exponent", "3", "--background", "1,1,1"],
        ["--view", "-x", "--projection", "orthographic", "--background", "none"],
        ["--view", "-1,2,0.5", "--up", "0,1,0", "--degree", "3", "--prune-depth", "0"],
        ["--method", "bracket", "--filter", "smoothing", "--smoothing", "0.1", "--boundary", "periodic"],
        ["--light", "1,-1,2", "--light", "-x", "--shadows"],
        ["--shading", "ambient-occlusion", "--samples", "1"],
        ["--shading", "path-trace", "--samples", "2", "--environment", "0.5", "--light", "-1,-1,2,3"],
        ["--degree", "1", "--filter", "none", "--inside", "below", "--color", "1,0.5,0.2", "--background", "white"],
    ],
    ids=" ".join,
)
def test_render_writes_a_picture(ball, picture, capsys, options):
    assert main(["render", str(ball), "--level", "0", "--size", "48x32", "-o", str(picture), *options]) == 0
    printed = capsys.readouterr()
    assert picture.read_bytes().startswith(PNG)
    assert printed.out.startswith(f"{picture}: Image(48 x 32, ") and printed.err == ""
    assert leftovers(picture.parent) == ["picture.png"]


def test_render_gives_the_picture_of_the_library(ball, picture):
    image = pytest.importorskip("PIL.Image")
    assert (
        main(
            [
                "render",
                str(ball),
                "-l",
                "0",
                "--size",
                "48x32",
                "--samples",
                "1",
                "--shading",
                "phong",
                "-o",
                str(picture),
            ]
        )
        == 0
    )
    volume = isospline.Volume(np.load(ball))
    scene = isospline.Scene([isospline.Isosurface(volume, 0)])
    expected = isospline.render(scene, isospline.camera_for(scene, size=(48, 32)), size=(48, 32), background=0)
    np.testing.assert_array_equal(np.asarray(image.open(picture)), expected.to_srgb())


@pytest.mark.parametrize(
    "options, color",
    [
        (["--color-by", "normal"], isospline.ColorByNormal()),
        (["--color-by", "depth", "--cmap", "magma"], isospline.ColorByDepth("magma")),
        (["--color-by", "mean-curvature", "--limits", "-0.1,0.2"], isospline.ColorByCurvature(limits=(-0.1, 0.2))),
        (
            ["--color-by", "gaussian-curvature", "--cmap", "gray", "--limits", "0,1"],
            isospline.ColorByCurvature("gaussian", "gray", limits=(0, 1)),
        ),
        (["--color-by", "FILE", "--limits", "-100,300"], None),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_render_colors_as_the_library_does(ball, picture, options, color):
    image = pytest.importorskip("PIL.Image")
    options = [str(ball) if option == "FILE" else option for option in options]
    volume = isospline.Volume(np.load(ball))
    color = isospline.ColorByVolume(volume, limits=(-100, 300)) if color is None else color
    scene = isospline.Scene([isospline.Isosurface(volume, 0)])
    camera = isospline.camera_for(scene, size=(48, 32))
    for shading in (isospline.Phong(color=color), isospline.Outline(surface_color=color)):
        common = ["-l", "0", "--size", "48x32", "--samples", "1", "--no-capped"]
        common += ["--shading", type(shading).__name__.lower()]
        assert main(["render", str(ball), *common, *options, "-o", str(picture)]) == 0
        expected = isospline.render(scene, camera, size=(48, 32), shading=shading, background=0)
        np.testing.assert_array_equal(np.asarray(image.open(picture)), expected.to_srgb())


def pixels(path):
    return np.asarray(pytest.importorskip("PIL.Image").open(path))


def rendered(ball, levels=(0,), meshes=(), samples=1, **options):
    """The library's result for the ball."""
    volume = isospline.Volume(np.load(ball))
    scene = isospline.Scene([*(isospline.Isosurface(volume, level) for level in levels), *meshes])
    camera = isospline.camera_for(scene, size=(48, 32))
    return isospline.render(scene, camera, size=(48, 32), background=0, samples=samples, **options)


RIGHT, LEFT = isospline.DirectionalLight((-1, 0, 0)), isospline.DirectionalLight((1, 1, -2), intensity=0.25)
SUN = isospline.DirectionalLight((1, 1, -2), intensity=0.25 * np.pi)
RED = isospline.Material((0.8, 0.2, 0.1))


@pytest.mark.parametrize(
    "options, expected",
    [
        (["--light", "+x", "--light", "-1,-1,2,0.25"], dict(shading=isospline.Phong(lights=[RIGHT, LEFT]))),
        (["--light", "left", "--shadows"], dict(shading=isospline.Phong(lights=[RIGHT], shadows=True))),
        (
            ["--shading", "ambient-occlusion", "--color", "0.8,0.2,0.1"],
            dict(shading=isospline.AmbientOcclusion(color=(0.8, 0.2, 0.1))),
        ),
        (
            ["--shading", "outline", "--color", "0.8,0.2,0.1"],
            dict(shading=isospline.Outline(surface_color=(0.8, 0.2, 0.1))),
        ),
        (["--shading", "path-trace"], dict(integrator=isospline.PathTracer())),
        (
            ["--shading", "path-trace", "--color", "0.8,0.2,0.1", "--light", "-1,-1,2,0.25"],
            dict(integrator=isospline.PathTracer(RED, lights=[SUN])),
        ),
        (
            [
                "--shading",
                "path-trace",
                "--color-by",
                "normal",
                "--environment",
                "0.5,0.6,0.7",
                "--light",
                "-1,-1,2,0.25",
            ],
            dict(
                integrator=isospline.PathTracer(
                    isospline.Material(isospline.ColorByNormal()),
                    lights=[SUN, isospline.EnvironmentLight((0.5, 0.6, 0.7))],
                )
            ),
        ),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_render_lights_as_the_library_does(ball, picture, options, expected):
    common = ["-l", "0", "--size", "48x32", "--samples", "1"]
    assert main(["render", str(ball), *common, *options, "-o", str(picture)]) == 0
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
    options = [*options, "--view", "1,2,3", "--color-by", str(ball), *([] if capped else ["--no-capped"])]
    common = ["-l", "0", "--size", "48x32", "--samples", "1", "--shading", "phong"]
    assert main(["render", str(ball), *common, *options, "-o", str(picture)]) == 0
    volume = isospline.Volume(np.load(ball))
    scene = isospline.Scene([isospline.Isosurface(volume, 0, clip=clip, capped=capped)])
    camera = isospline.camera_for(scene, view=(1, 2, 3), size=(48, 32))
    shading = isospline.Phong(color=isospline.ColorByVolume(volume))
    expected = isospline.render(scene, camera, size=(48, 32), shading=shading, background=0)
    np.testing.assert_array_equal(pixels(picture), expected.to_srgb())
    assert (scene.count_intersections(camera.rays((48, 32))) % 2 == 0).all() == capped


def test_path_tracing_takes_more_samples(ball, picture):
    assert main(["render", str(ball), "-l", "0", "--size", "48x32", "--shading", "path-trace", "-o", str(picture)]) == 0
    expected = rendered(ball, integrator=isospline.PathTracer(), samples=64)
    np.testing.assert_array_equal(pixels(picture), expected.to_srgb())


def test_render_in_the_light_of_a_file(ball, tmp_path, rng):
    OpenEXR = pytest.importorskip("OpenEXR")
    sky = rng.uniform(0, 1, (4, 8, 3)).astype(np.float32)
    header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION}
    with OpenEXR.File(header, {"RGB": sky}) as file:
        file.write(str(tmp_path / "sky.exr"))
    assert (
        main(
            [
                "render",
                str(ball),
                "-l",
                "0",
                "--size",
                "48x32",
                "--samples",
                "2",
                "--shading",
                "path-trace",
                "--environment",
                str(tmp_path / "sky.exr"),
                "-o",
                str(tmp_path / "a.png"),
            ]
        )
        == 0
    )
    integrator = isospline.PathTracer(lights=[isospline.EnvironmentLight(image=sky)])
    expected = rendered(ball, samples=2, integrator=integrator)
    np.testing.assert_array_equal(pixels(tmp_path / "a.png"), expected.to_srgb())


@pytest.fixture
def plate(tmp_path):
    """A square below the ball, as a file."""
    pytest.importorskip("trimesh")
    text = "OFF\n4 2 0\n0 0 1\n23 0 1\n23 21 1\n0 21 1\n3 0 1 2\n3 0 2 3\n"
    (tmp_path / "plate.off").write_text(text, encoding="utf-8")
    return tmp_path / "plate.off"


@pytest.mark.parametrize("shading", ["phong", "path-trace"])
def test_render_of_levels_and_meshes(ball, plate, picture, capsys, shading):
    colors = [(1, 0.1, 0.1), (0.1, 1, 0.1), (0.1, 0.1, 1)]
    options = [part for color in colors for part in ("--color", ",".join(map(str, color)))]
    assert (
        main(
            [
                "render",
                str(ball),
                "-l",
                "400",
                "-l",
                "0",
                "--mesh",
                str(plate),
                "--size",
                "48x32",
                "--samples",
                "1",
                "--shading",
                shading,
                *options,
                "-o",
                str(picture),
            ]
        )
        == 0
    )
    if shading == "phong":
        look = dict(shading={number: isospline.Phong(color=color) for number, color in enumerate(colors)})
    else:
        materials = {number: isospline.Material(color) for number, color in enumerate(colors)}
        look = dict(integrator=isospline.PathTracer(materials=materials))
    expected = rendered(ball, (400, 0), [isospline.read_mesh(plate)], layers=("geometry_ids",), **look)
    np.testing.assert_array_equal(pixels(picture), expected.to_srgb())
    assert {1, 2} <= set(np.unique(expected.geometry_ids))
    cells = sum(isospline.Isosurface(isospline.Volume(np.load(ball)), level).shell.count for level in (400, 0))
    assert f", {cells} cells" in capsys.readouterr().out


@pytest.mark.parametrize("shading", [isospline.Phong, isospline.Outline, isospline.AmbientOcclusion])
def test_render_of_translucent_levels(ball, picture, shading):
    name = {isospline.Phong: "phong", isospline.Outline: "outline"}.get(shading, "ambient-occlusion")
    common = ["--size", "48x32", "--samples", "1", "--shading", name, "-o", str(picture)]
    images = []
    for given, opacities in ((["0.25", "1"], (0.25, 1)), (["0.5"], (0.5, 0.5))):
        options = [part for opacity in given for part in ("--opacity", opacity)]
        assert main(["render", str(ball), "-l", "0", "-l", "400", *common, *options]) == 0
        look = {number: shading(opacity=opacity) for number, opacity in enumerate(opacities)}
        images.append(pixels(picture))
        np.testing.assert_array_equal(images[-1], rendered(ball, (0, 400), shading=look).to_srgb())
    assert (images[0] != images[1]).any()


def test_one_color_is_that_of_all(ball, plate, picture):
    assert (
        main(
            [
                "render",
                str(ball),
                "-l",
                "0",
                "--mesh",
                str(plate),
                "--size",
                "48x32",
                "--samples",
                "1",
                "--shading",
                "phong",
                "--color",
                "1,0.5,0.2",
                "-o",
                str(picture),
            ]
        )
        == 0
    )
    shading = isospline.Phong(color=(1, 0.5, 0.2))
    expected = rendered(ball, meshes=[isospline.read_mesh(plate)], shading=shading)
    np.testing.assert_array_equal(pixels(picture), expected.to_srgb())


def test_render_denoises(ball, picture, monkeypatch, capsys):
    arguments = [
        "render",
        str(ball),
        "-l",
        "0",
        "--size",
        "48x32",
        "--shading",
        "path-trace",
        "--denoise",
        "--samples",
        "1",
        "-o",
        str(picture),
    ]
    monkeypatch.setitem(sys.modules, "pyoidn", None)
    fails(capsys, 1, "pip install pyoidn", *arguments)
    assert not picture.exists()
    flat = types.SimpleNamespace(denoise=lambda color, **_: np.full_like(color, 0.25))
    monkeypatch.setitem(sys.modules, "pyoidn", flat)
    assert main(arguments) == 0
    assert np.unique(pixels(picture)[..., :3]).tolist() == [137]  # sRGB of 0.25


def test_render_stores_layers(ball, tmp_path):
    OpenEXR = pytest.importorskip("OpenEXR")
    assert (
        main(
            [
                "render",
                str(ball),
                "-l",
                "0",
                "--size",
                "48x32",
                "--samples",
                "2",
                "--shading",
                "path-trace",
                "--layers",
                "curvature,ambient_occlusion,direct",
                "--ambient-occlusion-samples",
                "8",
                "-o",
                str(tmp_path / "a.exr"),
            ]
        )
        == 0
    )
    layers = dict(layers=("curvature", "ambient_occlusion", "direct"), ambient_occlusion_samples=8)
    expected = rendered(ball, samples=2, integrator=isospline.PathTracer(), **layers)
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
    np.testing.assert_array_equal(channels["direct.G"], expected.direct[..., 1])
    np.testing.assert_array_equal(channels["ambient_occlusion"], expected.ambient_occlusion)
    np.testing.assert_array_equal(channels["curvature.mean"], expected.curvature[..., 0])


def test_render_through_a_lens_stores_curvature(ball, tmp_path):
    OpenEXR = pytest.importorskip("OpenEXR")
    common = ["-l", "0", "--size", "48x32", "--shading", "phong", "--layers", "curvature"]
    common += ["-o", str(tmp_path / "a.exr")]
    assert main(["render", str(ball), *common, "--aperture", "2", "--focus", "60"]) == 0
    scene = isospline.Scene([isospline.Isosurface(isospline.Volume(np.load(ball)), 0)])
    camera = isospline.camera_for(scene, size=(48, 32)).with_lens(2, focus_distance=60)
    expected = isospline.render(scene, camera, size=(48, 32), background=0, samples=4, layers=("curvature",))
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
    assert main(["render", str(ball), "--level", level, "--size", "16x9", "--no-capped", "-o", str(picture)]) == 0
    printed = capsys.readouterr()
    assert re.fullmatch(r"isospline: warning: level \S+ is out of the data's range.*\n", printed.err)
    assert "0% covered), 0 cells" in printed.out
    assert picture.exists()


def test_progress_is_shown_on_a_terminal_only(ball, picture):
    pty, fcntl, termios = (pytest.importorskip(name) for name in ("pty", "fcntl", "termios"))
    try:
        ours, terminal = pty.openpty()
    except OSError as error:
        pytest.skip(f"no pseudo-terminals here: {error}")
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    command = [sys.executable, "-m", "isospline", "render", ball, "--level", "0", "--size", "64x64", "-o", picture]
    result = subprocess.run(command, stdout=subprocess.PIPE, stderr=terminal, check=False)
    shown = os.read(ours, 100_000)
    os.close(terminal)
    os.close(ours)
    assert result.returncode == 0
    for stage in (b"filtering", b"finding cells", b"rendering"):
        assert stage in shown


# Errors: one line, an exit code, no file


def fails(capsys, code, pattern, *arguments):
    try:
        got = main([str(argument) for argument in arguments])
    except SystemExit as stop:
        got = stop.code
    error = capsys.readouterr().err
    assert re.fullmatch(r"isospline: error: [^\n]*\n", error), error
    assert re.search(pattern, error), error
    assert got == code


def test_bad_arguments_are_told(ball, picture, capsys):
    render = ("render", ball, "-o", picture)
    fails(capsys, 2, "required: COMMAND")
    fails(capsys, 2, "invalid choice: 'paint'", "paint")
    fails(capsys, 2, "required: -o/--output", "render", ball)
    fails(capsys, 2, "--level: invalid float value: 'high'", *render, "--level", "high")
    fails(capsys, 2, "--size: expected a width and a height such as 640x480, got '640'", *render, "--size", "640")
    fails(capsys, 2, "--spacing: expected 3 numbers separated by commas, got '1,2'", *render, "--spacing", "1,2")
    fails(capsys, 2, "--shape: expected three counts", *render, "--shape", "1,2")
    fails(capsys, 2, "--dtype: expected a type such as uint8", *render, "--dtype", "integer")
    fails(capsys, 2, "--background: expected the name of a colour, such as white", *render, "--background", "muave")
    fails(capsys, 2, "--color: expected the name of a colour, .* got 'muave'", *render, "--color", "muave")
    fails(
        capsys,
        2,
        'color: expected linear numbers from 0 to 1 for red, .* got .*did you mean "#ff8000"',
        *render,
        "-l",
        "0",
        "--color",
        "255,128,0",
    )
    fails(capsys, 2, "--annotate: expected scale-bar, colorbar or scale-bar,colorbar", *render, "--annotate", "ruler")
    fails(capsys, 2, "annotate: expected a colour rule", *render, "-l", "0", "--annotate", "colorbar")
    fails(capsys, 2, "--fast: expected --shading studio with it, got phong", *render, "--fast", "--shadows")
    fails(capsys, 2, "--clip: expected 6 numbers separated by commas, got '1,2,3'", *render, "--clip", "1,2,3")
    fails(
        capsys,
        2,
        "--capped: expected --clip or --clip-box with it, got none",
        "mesh",
        ball,
        "-o",
        ball.parent / "a.stl",
        "--capped",
    )
    fails(capsys, 2, "normal", *render, "--clip", "1,2,3,0,0,0")
    fails(capsys, 2, "unrecognized arguments: --colour", *render, "--colour", "1,1,1")
    fails(capsys, 2, "view: expected one of", *render, "--level", "0", "--view", "within")
    fails(capsys, 2, "spacing: expected positive numbers", *render, "--spacing", "1,-1,1")
    fails(capsys, 2, "prune_depth: expected", *render, "--level", "0", "--prune-depth", "9")
    fails(capsys, 2, "level: expected", *render, "--level", "nan")
    fails(capsys, 2, "--dtype, with it", *render, "--big-endian")
    fails(capsys, 2, "--limits: expected --color-by", *render, "--limits", "0,1")
    fails(capsys, 2, "--cmap: expected --color-by", *render, "--color-by", "normal", "--cmap", "magma")
    fails(capsys, 2, "--limits: expected two curvatures", *render, "--color-by", "mean-curvature")
    fails(capsys, 2, "cmap: expected the name of a colour map", *render, "--color-by", "depth", "--cmap", "magna")
    fails(capsys, 2, "gradient: No such file", *render, "--color-by", "gradient")
    lens = ("--level", "0", "--aperture", "1")
    fails(capsys, 2, "--aperture: expected a perspective", *render, *lens, "--projection", "orthographic")
    fails(capsys, 2, "focus_distance: expected", *render, *lens, "--focus", "-1")
    traced = ("--level", "0", "--shading", "path-trace")
    fails(
        capsys,
        2,
        "--light: expected 3 or 4 numbers separated by commas or one of .*front, .* got 'above'",
        *render,
        "--light",
        "above",
    )
    fails(capsys, 2, "--light: expected a side, which is not 0,0,0", *render, "--light", "0,0,0")
    fails(capsys, 2, "intensity: expected", *render, "--light", "0,0,1,-1")
    fails(
        capsys,
        2,
        "--light: expected --shading phong or path-trace with it, got outline",
        *render,
        "--light",
        "top",
        "--shading",
        "outline",
    )
    fails(capsys, 2, "--shadows: expected --shading phong with it, got path-trace", *render, *traced, "--shadows")
    for option in (("--environment", "1"), ("--denoise",)):
        fails(
            capsys,
            2,
            f"{option[0]}: expected --shading path-trace with it, got studio",
            "render",
            ball,
            "-o",
            ball.parent / "a.exr",
            *option,
        )
    fails(
        capsys,
        2,
        "--environment: expected 1 or 3 numbers separated by commas or a file: .exr or .hdr, got 'blue'",
        *render,
        *traced,
        "--environment",
        "blue",
    )
    fails(capsys, 2, r"no\.exr: No such file", *render, *traced, "--environment", ball.parent / "no.exr")
    fails(capsys, 2, "radiance: expected", *render, *traced, "--environment", "-1")
    fails(capsys, 2, "base_color: expected linear numbers from 0 to 1", *render, *traced, "--color", "2,1,1")
    fails(
        capsys,
        2,
        "--color: expected 1, or 3 for all levels and meshes, got 2",
        *render,
        "--color",
        "1,1,1",
        "--color",
        "1,1,1",
        "-l",
        "0",
        "-l",
        "1",
        "--mesh",
        "a.stl",
    )
    fails(
        capsys,
        2,
        "--opacity: expected 1, or 2 for all levels and meshes, got 3",
        *render,
        "-l",
        "0",
        "-l",
        "1",
        *(["--opacity", "0.5"] * 3),
    )
    fails(
        capsys,
        2,
        "--opacity: expected --shading studio, .* or ambient-occlusion with it, got path-trace",
        *render,
        *traced,
        "--opacity",
        "0.5",
    )
    fails(capsys, 2, "opacity: expected", *render, "--opacity", "2")
    fails(capsys, 2, "--color: expected it without --color-by", *render, "--color", "1,1,1", "--color-by", "normal")
    fails(capsys, 2, r"no\.stl: No such file", *render, "--mesh", ball.parent / "no.stl")
    fails(capsys, 2, "--layers: expected the name of a picture that has layers", *render, "--layers", "curvature")
    exr = ("render", ball, "--level", "0", "-o", ball.parent / "a.exr")
    fails(capsys, 2, "--layers: expected names among depth, .*, primitive_ids, got 'z'", *exr, "--layers", "depth,z")
    fails(capsys, 2, "--layers: expected direct with --shading path-trace only, got studio", *exr, "--layers", "direct")
    fails(
        capsys,
        2,
        "ambient_occlusion_samples: expected rays a hit",
        *exr,
        "--layers",
        "ambient_occlusion",
        "--ambient-occlusion-samples",
        "0",
    )
    assert not leftovers(picture.parent)


def test_bad_files_are_told(tmp_path, picture, capsys):
    pytest.importorskip("SimpleITK")
    fails(capsys, 2, r"missing\.nrrd: No such file", "info", tmp_path / "missing.nrrd")
    fails(capsys, 2, "a folder that holds a DICOM series", "info", tmp_path)
    (tmp_path / "a.npy").write_bytes(b"nonsense")
    fails(capsys, 2, r"a\.npy: cannot be read as NPY", "render", tmp_path / "a.npy", "-o", picture)
    (tmp_path / "a.raw").write_bytes(b"12345678")
    fails(
        capsys,
        2,
        r"expected 27 bytes, 3 x 3 x 3 samples \(x, y, z\) of uint8, got 8 bytes \(shape=",
        "info",
        tmp_path / "a.raw",
        "--shape",
        "3,3,3",
        "--dtype",
        "uint8",
    )
    np.save(tmp_path / "nan.npy", np.full((3, 3, 3), np.nan))
    fails(capsys, 2, "finite", "render", tmp_path / "nan.npy", "--level", "0", "-o", picture)
    (tmp_path / "a.exr").write_bytes(b"nonsense")
    np.save(tmp_path / "ball.npy", volumes.sphere(0.7).samples(8))
    fails(
        capsys,
        2,
        r"a\.exr: cannot be read as an environment",
        "render",
        tmp_path / "ball.npy",
        "--level",
        "0",
        "--shading",
        "path-trace",
        "--environment",
        tmp_path / "a.exr",
        "-o",
        picture,
    )
    (tmp_path / "a.off").write_text("nonsense", encoding="utf-8")
    fails(
        capsys,
        2,
        r"a\.off: cannot be read as a mesh",
        "render",
        tmp_path / "ball.npy",
        "--level",
        "0",
        "--mesh",
        tmp_path / "a.off",
        "-o",
        picture,
    )
    np.save(tmp_path / "flat.npy", np.ones((3, 3, 3)))
    fails(capsys, 2, r"flat\.npy: expected samples that differ", "render", tmp_path / "flat.npy", "-o", picture)
    assert not picture.exists()


def test_bad_output_is_told_before_anything_is_read(tmp_path, capsys):
    missing = tmp_path / "missing.npy"
    fails(capsys, 2, r"a\.jpg: expected the name of a picture", "render", missing, "-o", tmp_path / "a.jpg")
    fails(capsys, 2, "expected a folder that exists", "render", missing, "-o", tmp_path / "no" / "a.png")
    (tmp_path / "b.png").mkdir()
    fails(capsys, 2, "got that of a folder", "render", missing, "-o", tmp_path / "b.png")
    if os.geteuid() != 0:
        (tmp_path / "locked").mkdir(mode=0o500)
        fails(capsys, 2, "can be written to", "render", missing, "-o", tmp_path / "locked" / "a.png")


def test_a_full_disk_is_told(ball, capsys):
    if not os.access("/dev/full", os.W_OK):
        pytest.skip("no /dev/full")
    with pytest.MonkeyPatch.context() as patch:

        def full(*_, **__):
            raise OSError(28, "No space left on device", "a.png")

        patch.setattr(isospline.Image, "write", full)
        fails(
            capsys,
            1,
            r"a\.png: No space left on device",
            "render",
            ball,
            "--level",
            "0",
            "--size",
            "8x8",
            "-o",
            ball.parent / "a.png",
        )


def test_missing_libraries_are_told(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "SimpleITK", None)
    (tmp_path / "a.nrrd").write_bytes(
        b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n\n" + bytes(8)
    )
    fails(
        capsys, 1, r"reading NRRD needs the package SimpleITK: pip install isospline\[io\]", "info", tmp_path / "a.nrrd"
    )


def test_the_exit_code_is_that_of_main(ball, tmp_path):
    result = run("info", tmp_path / "missing.nrrd")
    assert (result.returncode, result.stdout) == (2, "") and "Traceback" not in result.stderr
    result = run("--version")
    assert (result.returncode, result.stdout) == (0, f"isospline {isospline.__version__}\n")
    for arguments in (["--help"], ["info", "--help"], ["render", "--help"]):
        result = run(*arguments)
        assert result.returncode == 0 and result.stdout.startswith("usage: isospline")


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_interrupting_leaves_no_file(tmp_path, ball):
    picture = tmp_path / "picture.png"
    command = [
        sys.executable,
        "-m",
        "isospline",
        "render",
        str(ball),
        "--size",
        "4096x4096",
        "--samples",
        "4096",
        "-o",
        str(picture),
    ]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, encoding="utf-8", preexec_fn=obey_interrupts)
    assert process.stderr.readline().startswith("isospline: level")
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=60)
    assert process.returncode == 130
    assert error == "isospline: interrupted\n"
    assert leftovers(tmp_path) == []


# Real volumes


REAL = {
    "engine.nii.gz": (80, []),
    "bonsai.nii.gz": (40, []),
    "fuel.nii.gz": (40, []),
    "vismale_128x256x256_uint8.raw": (
        60,
        ["--shape", "128,256,256", "--dtype", "uint8", "--spacing", "1.57774,0.995861,1.00797"],
    ),
    "tooth_103x94x161_uint16.raw": (600, ["--shape", "103,94,161", "--dtype", "uint16"]),
    "headsq.mha": (500, []),
    "ironprot.vtk": (128, []),
    "mouse_skull.nrrd": (40, []),
    "weave.tif": (140, []),
    "abdomen_512x512x275_int16.nii.gz": (250, []),
}


@pytest.mark.parametrize("name", REAL)
def test_real_volumes_render(volumes_folder, picture, capsys, name):
    level, options = REAL[name]
    assert (
        main(
            [
                "render",
                str(volumes_folder / name),
                "--level",
                str(level),
                "--size",
                "64x48",
                "--samples",
                "1",
                "-o",
                str(picture),
                *options,
            ]
        )
        == 0
    )
    covered = int(re.search(r"(\d+)% covered", capsys.readouterr().out).group(1))
    assert 2 < covered < 98


def test_first_suggestions_of_real_volumes_are_worth_seeing(volumes_folder):
    """They differ from a level in the volume's description by less than a twelfth of the range of values."""
    for name, levels in {
        "bonsai.nii.gz": (40, 80),
        "headsq.mha": (500, 1150),
        "weave.tif": (140,),
        "mouse_skull.nrrd": (40,),
        "engine.nii.gz": (80, 180),
    }.items():
        values, _ = histogram(isospline.read_volume(volumes_folder / name).data)
        first = isospline.suggest_levels(isospline.read_volume(volumes_folder / name).data)[0]
        assert min(abs(first - level) for level in levels) < (values[-1] - values[0]) / 12


# mesh


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".obj", ".glb"])
def test_mesh_writes_a_closed_mesh(ball, tmp_path, suffix, capsys):
    trimesh = pytest.importorskip("trimesh")
    output = tmp_path / f"ball{suffix}"
    assert main(["mesh", str(ball), "--level", "0", "-o", str(output)]) == 0
    assert re.match(rf"{re.escape(str(output))}: Mesh\(\d+ vertices, \d+ faces\), [\d.]+ s\n", capsys.readouterr().out)
    shape = trimesh.load_mesh(output)
    assert shape.is_watertight and shape.volume > 0
    assert leftovers(tmp_path) == [output.name]


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
        (["-o", "ball.stl", "--capped"], "--capped: expected --clip or --clip-box with it, got none"),
        (["-o", "ball.stl", "--level", "1e9"], "ball.stl: expected a mesh with faces, got none"),
    ],
)
def test_mesh_errors_are_clear(ball, tmp_path, monkeypatch, capsys, options, message):
    monkeypatch.chdir(tmp_path)
    assert main(["mesh", str(ball), *options]) == 2
    assert f"isospline: error: {message}" in capsys.readouterr().err
    assert leftovers(tmp_path) == []


# Pictures worth looking at


def test_the_default_picture_is_in_studio_light(ball, picture):
    assert main(["render", str(ball), "-l", "0", "--size", "48x36", "-o", str(picture)]) == 0
    volume = isospline.Volume(np.load(ball))
    surface = isospline.Isosurface(volume, 0, clip=isospline.Box(*volume.bounds), capped=True)
    expected = isospline.render(
        surface,
        size=(48, 36),
        samples=8,
        shading=isospline.Phong(color="#d9c7a8"),
        lighting=isospline.Studio(),
        background="#e8ebef",
    )
    np.testing.assert_array_equal(pixels(picture), expected.to_srgb())


def test_fast_leaves_shadows_out(ball, picture):
    assert main(["render", str(ball), "-l", "0", "--size", "48x36", "--fast", "-o", str(picture)]) == 0
    volume = isospline.Volume(np.load(ball))
    expected = isospline.render(
        isospline.Isosurface(volume, 0),
        size=(48, 36),
        samples=4,
        background="#e8ebef",
        shading=isospline.Phong(color="#d9c7a8"),
        lighting=isospline.Studio(fast=True),
    )
    difference = np.abs(pixels(picture).astype(int) - expected.to_srgb().astype(int))
    assert difference.max() <= 2  # the border that closes it is no part of this ball


def test_slow_pictures_announce_their_time(ball, picture, capsys, monkeypatch):
    from isospline import cli_picture

    options = types.SimpleNamespace(quiet=False, fast=False, shading="studio")
    for changes, expected in (({}, 1), ({"quiet": True}, 0), ({"fast": True}, 0), ({"shading": "phong"}, 0)):
        said, handed_on = [], []
        patience = cli_picture.Patience(
            types.SimpleNamespace(**{**vars(options), **changes}), handed_on.append, said.append
        )
        patience(0.5)
        patience._begin -= 4
        for fraction in (0.5, 0.75, 1.0):
            patience(fraction)
        assert handed_on == [0.5, 0.5, 0.75, 1.0] and len(said) == expected
    monkeypatch.setattr(cli_picture, "PATIENCE", 0.0)
    assert main(["render", str(ball), "-l", "0", "--size", "160x120", "-o", str(picture)]) == 0
    assert re.fullmatch(
        r"isospline: soft light and shadows take about \d+ s; --fast leaves them out\n", capsys.readouterr().err
    )


def test_a_ct_of_a_patient_shows_bones(tmp_path, picture, capsys):
    nibabel = pytest.importorskip("nibabel")
    data = np.full((20, 22, 24), -1000, np.int16)
    data[4:16, 4:18, 4:20] = 40
    data[8:12, 8:14, 8:16] = 700
    nibabel.save(nibabel.Nifti1Image(data, np.eye(4)), tmp_path / "a.nii")
    np.save(tmp_path / "a.npy", data)
    suggested = isospline.suggest_levels(data)
    assert suggested[0] < 0 < suggested[1]
    for name, level in (("a.nii", suggested[1]), ("a.npy", suggested[0])):
        assert main(["render", str(tmp_path / name), "--size", "16x9", "--fast", "-o", str(picture)]) == 0
        assert capsys.readouterr().err.startswith(f"isospline: level {level:g}, the first one ")


def test_a_ct_is_rendered_without_its_table(tmp_path, scan_with_table, capsys):
    path, bone = scan_with_table

    def cells(*options):
        given = ["render", str(path), "--size", "32x24", "--fast", "-o", str(tmp_path / "a.png")]
        assert main([*given, *options]) == 0
        printed = capsys.readouterr()
        return int(re.search(r"(\d+) cells", printed.out)[1]), printed.err

    few, told = cells()
    assert "above water, for bones" in told and "the body, is shown" in told
    assert few < 1.2 * bone  # the suggested level is another one
    assert cells("--largest", "1")[0] == few
    every, told = cells("--largest", "all")
    assert every > 2 * few and "the body" not in told


def test_a_store_of_a_patient_is_rendered_as_its_file(tmp_path, capsys):
    nibabel = pytest.importorskip("nibabel")
    pytest.importorskip("zarr")
    z, y, x = np.mgrid[0:40, 0:44, 0:48]
    data = np.where(np.hypot(x - 24, y - 22) < 15, 40, -1000).astype(np.int16)
    data[np.hypot(x - 20, y - 30) < 5] = 700
    data[z > 30] = -1000
    nibabel.save(nibabel.Nifti1Image(data.T, np.diag([-0.5, 0.5, -0.75, 1])), tmp_path / "scan.nii.gz")
    assert main(["convert", str(tmp_path / "scan.nii.gz"), str(tmp_path / "scan.zarr"), "--quiet"]) == 0
    pictures = []
    for name in ("scan.nii.gz", "scan.zarr"):
        out = tmp_path / f"{name}.png"
        given = ["render", str(tmp_path / name), "--size", "64x48", "--fast", "--quiet", "-o", str(out)]
        given += ["--annotate", "scale_bar"]
        capsys.readouterr()
        assert main([*given, "--exact"]) == 0
        assert "above water, for bones" in capsys.readouterr().err
        assert main([*given, "--exact", "--view", "anterior", "--level", "300"]) == 0
        assert "upwards" not in capsys.readouterr().err
        pictures.append(out.read_bytes())
    assert pictures[0] == pictures[1]


def test_a_solid_is_closed_where_the_volume_ends(tmp_path, picture):
    np.save(tmp_path / "full.npy", np.pad(np.full((12, 14, 16), 100, np.int16), ((0, 0), (0, 0), (0, 5))))
    common = [
        "render",
        str(tmp_path / "full.npy"),
        "-l",
        "50",
        "--size",
        "40x30",
        "--fast",
        "--background",
        "none",
        "-o",
        str(picture),
    ]
    assert main([*common, "--view", "front"]) == 0
    closed = pixels(picture)[..., 3] > 0
    assert main([*common, "--view", "front", "--no-capped"]) == 0
    assert closed.mean() > 0.5 and (pixels(picture)[..., 3] > 0).mean() < 0.5 * closed.mean()


def test_a_solid_in_an_oblique_volume_is_closed():
    from isospline.pictures import border, closed_surface

    turn = np.array([(0.6, -0.8, 0), (0.8, 0.6, 0), (0, 0, 1)])
    for degree in (1, 2, 3):
        for axes in ("zyx", "xyz"):
            place = dict(spacing=(1, 2, 0.5), direction=turn, origin=(3, 4, 5))
            volume = isospline.Volume(np.ones((6, 7, 8), np.float32), degree=degree, axes=axes, **place)
            surface = closed_surface(volume, 0.5)
            cells = np.array([8, 7, 6] if axes == "zyx" else [6, 7, 8]) - (degree % 2)
            assert surface.enclosed_volume().value == pytest.approx(cells.prod() * 1.0, rel=1e-6)
            assert len(border(volume)) == 6


@pytest.mark.parametrize("color", ["#d9c7a8", "ivory", "tab:blue", "r", "0.2,0.3,0.4", "0.5"])
def test_colors_of_the_command_line(ball, picture, color):
    common = ["render", str(ball), "-l", "0", "--size", "48x32", "--samples", "1", "--shading", "phong"]
    assert main([*common, "--color", color, "--background", color, "-o", str(picture)]) == 0
    parts = color.split(",")
    with_numbers = parts[0][0] == "0"
    linear = ([float(part) for part in parts] * 3)[:3] if with_numbers else isospline.Phong(color=color).color
    volume = isospline.Volume(np.load(ball))
    expected = isospline.render(
        isospline.Isosurface(volume, 0), size=(48, 32), shading=isospline.Phong(color=linear), background=linear
    )
    np.testing.assert_array_equal(pixels(picture), expected.to_srgb())


def test_marks_of_the_command_line(ball, picture):
    common = ["render", str(ball), "-l", "0", "--size", "96x72", "--fast", "-o", str(picture)]
    images = []
    for options in ([], ["--annotate"], ["--annotate", "scale-bar"], ["--color-by", "depth", "--annotate"]):
        assert main([*common, *options]) == 0
        images.append(pixels(picture))
    assert (images[0] != images[1]).any() and (images[1] == images[2]).all() and (images[2] != images[3]).any()
    traced = ["render", str(ball), "-l", "0", "--size", "96x72", "--shading", "path-trace", "--samples", "2"]
    for options in ([], ["--annotate", "scale-bar"]):
        assert main([*traced, *options, "-o", str(picture)]) == 0
        images.append(pixels(picture))
    differs = (images[-1] != images[-2]).any(axis=(1, 2))
    assert differs.any() and not differs[:55].any()


@pytest.mark.parametrize(("option", "up"), [("-z", (0, 0, -1)), ("+y", (0, 1, 0)), ("1,0,1", (1, 0, 1))])
def test_upward_direction(ball, picture, option, up):
    assert (
        main(
            [
                "render",
                str(ball),
                "-l",
                "0",
                "--size",
                "48x32",
                "--samples",
                "1",
                "--shading",
                "phong",
                "--up",
                option,
                "--color-by",
                "normal",
                "-o",
                str(picture),
            ]
        )
        == 0
    )
    volume = isospline.Volume(np.load(ball))
    camera = isospline.camera_for(isospline.Isosurface(volume, 0), up=up, size=(48, 32))
    expected = isospline.render(
        isospline.Isosurface(volume, 0),
        camera,
        size=(48, 32),
        background=0,
        shading=isospline.Phong(color=isospline.ColorByNormal()),
    )
    np.testing.assert_array_equal(pixels(picture), expected.to_srgb())


def test_render_leaves_specks_out_and_explains_how_to_turn_the_picture(tmp_path, picture, capsys):
    grid = np.mgrid[0:24, 0:24, 0:24]
    data = np.full((24, 24, 24), 100.0)
    data[((grid - 12) ** 2).sum(axis=0) < 49] = 900
    for corner in ((2, 2, 2), (2, 2, 21), (21, 2, 2)):
        data[corner] = 900
    path = tmp_path / "specks.npy"
    np.save(path, data)

    def cells(*options):
        assert main(["render", str(path), "--fast", "-o", str(picture), "--size", "32x24", *options]) == 0
        printed = capsys.readouterr()
        return int(re.search(r"(\d+) cells", printed.out)[1]), printed.err

    few, told = cells()
    assert "showing 1 of 4 pieces, without the small ones; --largest all shows all of them" in told
    assert "z is upwards, as the file has no patient directions; --up -z turns the picture" in told
    every, told = cells("--largest", "all", "--up", "-z")
    assert "pieces" not in told and "upwards" not in told and every > few
    assert cells("--level", "500")[0] == cells("--level", "500", "--largest", "all")[0]
    with pytest.raises(SystemExit, match="2"):
        main(["render", str(path), "-o", str(picture), "--largest", "some"])
    assert "--largest: expected a number or all, got 'some'" in capsys.readouterr().err
