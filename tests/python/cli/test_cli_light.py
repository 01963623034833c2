"""The command line's light, materials and placed meshes, compared with the library's results."""

import numpy as np
import pytest
from command_line import fails, pixels, rendered
from environment_files import write_exr, write_hdr

import isospline
from isospline.cli.main import main
from isospline.cli.parser import join_negative

COMMON = ("-l", "0", "--size", "48x32", "--samples", "2", "--light", "phong")
TRACED = (*COMMON, "--light", "path-trace")


def draw(ball, picture, *options):
    assert main(["render", str(ball), "-o", str(picture), *map(str, options)]) == 0
    return pixels(picture)


def traced(ball, materials=None, lights=None, meshes=(), samples=2, **options):
    integrator = isospline.PathTracer(materials=materials or {}, lights=lights, **options)
    return rendered(ball, samples=samples, light=integrator, meshes=meshes).to_srgb()


def test_command_line_materials_equal_those_of_the_library(ball, plate, picture):
    got = draw(
        ball,
        picture,
        *TRACED,
        "--mesh",
        plate,
        "--color",
        "1,0.7,0.3",
        "--metallic",
        1,
        "--metallic",
        0,
        "--roughness",
        0.2,
        "--specular",
        0.1,
        "--specular",
        0.9,
        "--max-bounces",
        3,
        "--seed",
        7,
    )
    color = (1, 0.7, 0.3)
    materials = {
        0: isospline.Material(color, metallic=1, roughness=0.2, specular=0.1),
        1: isospline.Material(color, metallic=0, roughness=0.2, specular=0.9),
    }
    expected = traced(ball, materials, meshes=[isospline.read_mesh(plate)], max_bounces=3, seed=7)
    np.testing.assert_array_equal(got, expected)


@pytest.fixture
def sky(tmp_path, rng):
    image = rng.uniform(0, 1, (8, 16, 3)).astype(np.float32)
    write_exr(tmp_path / "sky.exr", {"RGB": image})
    write_hdr(tmp_path / "sky.hdr", image)
    return image


def about_z(degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([(c, -s, 0), (s, c, 0), (0, 0, 1)])


def test_environments_of_files(ball, picture, sky):
    files = picture.parent
    got = draw(
        ball,
        picture,
        *TRACED,
        "--environment",
        files / "sky.exr",
        "--environment-intensity",
        2,
        "--environment-rotation",
        30,
        "--environment-visible",
    )
    light = isospline.EnvironmentLight(2, image=sky, rotation=about_z(30), visible=True)
    np.testing.assert_array_equal(got, traced(ball, lights=[light]))
    assert (got[..., :3] > 0).all()  # it is behind the ball

    got = draw(ball, picture, *TRACED, "--environment", files / "sky.hdr")
    light = isospline.EnvironmentLight(image=isospline.read_environment(files / "sky.hdr"))
    np.testing.assert_array_equal(got, traced(ball, lights=[light]))


@pytest.mark.parametrize("up", [(0, 0, -1), (0, 1, 0), (1, 2, 3)])
def test_the_sky_is_upwards(ball, picture, sky, up):
    """The zenith of the file is in the direction of --up, and the rotation is about it."""
    from isospline.picture.environments import upright_rotation

    rotation = upright_rotation(up, 40)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1)
    np.testing.assert_allclose(rotation[:, 2], up / np.linalg.norm(up), atol=1e-12)
    np.testing.assert_allclose(upright_rotation(up, 0) @ about_z(40), rotation, atol=1e-12)
    text = ",".join(map(str, up))
    got = draw(
        ball,
        picture,
        *TRACED,
        "--environment",
        picture.parent / "sky.exr",
        "--environment-rotation",
        40,
        "--up",
        text,
        "--view",
        "1,0.2,0.1",
    )
    light = isospline.EnvironmentLight(image=sky, rotation=rotation)
    volume = isospline.Volume(np.load(ball))
    scene = isospline.Scene([isospline.Isosurface(volume, 0)])
    camera = isospline.camera_for(scene, view=(1, 0.2, 0.1), up=up, size=(48, 32))
    expected = isospline.render(
        scene, camera, size=(48, 32), samples=2, background=0, light=isospline.PathTracer(lights=[light])
    )
    np.testing.assert_array_equal(got, expected.to_srgb())


def test_an_even_environment_has_an_intensity(ball, picture):
    got = draw(
        ball, picture, *TRACED, "--environment", "0.5,0.25,0.1", "--environment-intensity", 2, "--environment-visible"
    )
    light = isospline.EnvironmentLight((1, 0.5, 0.2), visible=True)
    np.testing.assert_array_equal(got, traced(ball, lights=[light]))
    got = draw(ball, picture, *TRACED, "--environment", "0.5", "--environment-intensity", 0.5)
    np.testing.assert_array_equal(got, traced(ball, lights=[isospline.EnvironmentLight(0.25)]))


@pytest.mark.parametrize("shading", [isospline.Phong, isospline.Outline, isospline.AmbientOcclusion])
def test_command_line_silhouettes_equal_those_of_the_library(ball, picture, shading):
    name = {isospline.Phong: "phong", isospline.Outline: "outline"}.get(shading, "ambient-occlusion")
    got = draw(
        ball,
        picture,
        "-l",
        0,
        "-l",
        400,
        "--size",
        "48x32",
        "--samples",
        1,
        "--light",
        name,
        "--opacity",
        0.2,
        "--opacity",
        1,
        "--silhouette-opacity",
        1,
        "--silhouette-exponent",
        2,
    )
    look = {
        number: shading(opacity=opacity, silhouette_opacity=1, silhouette_exponent=2)
        for number, opacity in enumerate((0.2, 1))
    }
    np.testing.assert_array_equal(got, rendered(ball, (0, 400), light=look).to_srgb())


@pytest.mark.parametrize("shading", ["phong", "ambient-occlusion", "path-trace"])
@pytest.mark.parametrize("up", [None, (0, -1, 0)])
def test_the_ground_is_below(ball, picture, shading, up):
    options = ["--light", shading, "--ground", "--ground-color", "0.2,0.3,0.4"]
    options += ["--up", ",".join(map(str, up)), "--view", "1,-1,1"] if up else ["--view", "1,-1,1"]
    got = draw(ball, picture, *COMMON, *options)
    surface = isospline.Isosurface(isospline.Volume(np.load(ball)), 0)
    scene = isospline.Scene(surface)
    camera = isospline.camera_for(scene, view=(1, -1, 1), up=up, size=(48, 32))
    ground = scene.add(isospline.ground_for(scene, up=up or (0, 0, 1)))
    color = (0.2, 0.3, 0.4)
    if shading == "path-trace":
        materials = {0: isospline.Material(), ground: isospline.Material(color, specular=0)}
        look = dict(light=isospline.PathTracer(materials=materials))
    elif shading == "phong":
        look = dict(light={0: isospline.Phong(), ground: isospline.Phong(color=color, specular=0)})
    else:
        look = dict(light={0: isospline.AmbientOcclusion(), ground: isospline.AmbientOcclusion(color=color)})
    image = isospline.render(scene, camera, size=(48, 32), samples=2, background=0, layers=("geometry_ids",), **look)
    np.testing.assert_array_equal(got, image.to_srgb())
    assert (image.geometry_ids == ground).sum() > 100


def test_light_is_tone_mapped_and_the_background_is_not(ball, picture):
    got = draw(
        ball,
        picture,
        *TRACED,
        "--environment",
        "3",
        "--tone-map",
        "neutral",
        "--exposure",
        "-0.5",
        "--background",
        "white",
    )
    volume = isospline.Volume(np.load(ball))
    scene = isospline.Scene([isospline.Isosurface(volume, 0)])
    camera = isospline.camera_for(scene, size=(48, 32))
    integrator = isospline.PathTracer(lights=[isospline.EnvironmentLight(3)])
    image = isospline.render(scene, camera, size=(48, 32), light=integrator, samples=2)
    np.testing.assert_array_equal(got, image.tone_map("neutral", exposure=-0.5).over("white").to_srgb())
    assert (got[0, 0] == 255).all()

    got = draw(ball, picture, *COMMON, "--exposure", "1", "--background", "none")
    expected = isospline.render(scene, camera, size=(48, 32), samples=2, light="phong")
    np.testing.assert_array_equal(got, expected.tone_map("linear", exposure=1).to_srgb())


MATRIX = np.array([(0.5, 0, 0, 3), (0, -1, 0, 20), (0, 0, 2, 1), (0, 0, 0, 1)])


@pytest.mark.parametrize("place", ["1,-2,3.5", "-1e0,2,3", "matrix.txt", "matrix.csv", "matrix.npy"])
def test_meshes_are_placed(ball, plate, picture, place, monkeypatch):
    monkeypatch.chdir(picture.parent)
    np.savetxt("matrix.txt", MATRIX)
    np.savetxt("matrix.csv", MATRIX, delimiter=",")
    np.save("matrix.npy", MATRIX)
    matrix = MATRIX
    if not place.startswith("m"):
        matrix = np.eye(4)
        matrix[:3, 3] = [float(part) for part in place.split(",")]
    got = draw(ball, picture, *COMMON, "--mesh", f"{plate}@{place}")
    expected = rendered(ball, samples=2, meshes=[(isospline.read_mesh(plate), matrix)], light=isospline.Phong())
    np.testing.assert_array_equal(got, expected.to_srgb())


def test_a_name_may_have_an_at(ball, plate, picture):
    other = plate.rename(plate.with_name("plate@home.off"))
    got = draw(ball, picture, *COMMON, "--mesh", other)
    expected = rendered(ball, samples=2, meshes=[isospline.read_mesh(other)], light=isospline.Phong())
    np.testing.assert_array_equal(got, expected.to_srgb())
    draw(ball, picture, *COMMON, "--mesh", f"{other}@0,0,0")
    np.testing.assert_array_equal(pixels(picture), expected.to_srgb())


def test_incompatible_options_are_refused(ball, plate, picture, capsys, tmp_path):
    render = ("render", ball, "-o", picture, "--light", "phong")
    sky = tmp_path / "sky.exr"

    def bad(message, *options):
        fails(capsys, 2, message, *render, *options)

    for name in ("metallic", "roughness", "specular", "environment-intensity", "seed", "max-bounces"):
        bad(f"--{name}: expected --light path-trace with it, got phong", "-l", 0, f"--{name}", 1)
    bad("--environment-visible: expected --environment with it", *TRACED, "--environment-visible")
    bad(
        "--environment-rotation: expected an image in --environment with it, got 1",
        *TRACED,
        "--environment",
        "1",
        "--environment-rotation",
        30,
    )
    bad(
        "--environment-intensity: expected a finite number of at least 0, got -1",
        *TRACED,
        "--environment",
        "1",
        "--environment-intensity",
        -1,
    )
    bad(
        "--environment-rotation: expected finite degrees",
        *TRACED,
        "--environment",
        sky,
        "--environment-rotation",
        "nan",
    )
    bad(r"sky\.exr: No such file", *TRACED, "--environment", sky)
    bad("--roughness: expected 1, or 2 for all levels and meshes, got 3", *TRACED, "-l", 400, *["--roughness", 0.5] * 3)
    bad("metallic: expected a number from 0 to 1, got 2", *TRACED, "--metallic", 2)
    bad("--silhouette-exponent: expected --silhouette-opacity with it, got none", "--silhouette-exponent", 2)
    bad("silhouette_opacity: expected a number from 0 to 1, got 2", "-l", 0, "--silhouette-opacity", 2)
    bad(
        "--silhouette-opacity: expected --light ambient-occlusion, outline or phong|phong, unlit, outline or ambient",
        *TRACED,
        "--silhouette-opacity",
        1,
    )

    bad("--mesh: expected FILE@x,y,z or FILE@MATRIX, got '1,2' after the @", "--mesh", f"{plate}@1,2")
    bad(r"no\.txt: No such file", "--mesh", f"{plate}@no.txt")
    bad(r"no\.off: No such file", "--mesh", "no.off@1,2,3")
    (tmp_path / "three.txt").write_text("1 0 0\n0 1 0\n0 0 1\n", encoding="utf-8")
    bad(
        r"three\.txt: expected four rows of four numbers, got shape \(3, 3\)", "--mesh", f"{plate}@{tmp_path}/three.txt"
    )
    (tmp_path / "text.txt").write_text("1 0 0 a\n0 1 0 0\n0 0 1 0\n0 0 0 1\n", encoding="utf-8")
    bad(r"text\.txt: cannot be read as a matrix", "--mesh", f"{plate}@{tmp_path}/text.txt")
    (tmp_path / "ragged.txt").write_text("1 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n", encoding="utf-8")
    bad(r"ragged\.txt: cannot be read as a matrix", "--mesh", f"{plate}@{tmp_path}/ragged.txt")
    (tmp_path / "no.npy").write_bytes(b"nonsense")
    bad(r"no\.npy: cannot be read as a matrix", "--mesh", f"{plate}@{tmp_path}/no.npy")
    (tmp_path / "flat.txt").write_text("0 0 0 0\n" * 3 + "0 0 0 1\n", encoding="utf-8")
    bad("transform", "-l", 0, "--mesh", f"{plate}@{tmp_path}/flat.txt")
    bad(
        "--ground: expected --light ambient-occlusion|phong, unlit, ambient-occlusion or path",
        "-l",
        0,
        "--light",
        "outline",
        "--ground",
    )
    for option in (("--ground",), ("--exposure", 1), ("--tone-map", "aces")):  # it has all that
        bad(f"{option[0]}: expected --light .* with it, got studio", "-l", 0, "--light", "studio", *option)
    bad("--ground-color: expected --ground with it", "-l", 0, "--ground-color", "1,1,1")
    bad("exposure: expected stops from -64 to 64, got nan", "-l", 0, "--exposure", "nan")
    bad("--tone-map: invalid choice: 'film'", "-l", 0, "--tone-map", "film")
    assert not picture.exists()


def test_exposure_is_checked_before_the_work(ball, picture, capsys, monkeypatch):
    monkeypatch.setattr(isospline, "render", lambda *_, **__: pytest.fail("has rendered"))
    options = "-l", 0, "--light", "phong", "--exposure", 65
    fails(capsys, 2, "exposure: expected stops", "render", ball, *options, "-o", picture)


@pytest.mark.parametrize("matrix", ["1 0 0 nan", "1 0 0 0"])
def test_a_bad_matrix_of_a_mesh_has_an_error_that_names_its_file(ball, plate, picture, tmp_path, capsys, matrix):
    rows = [matrix, "0 1 0 0", "0 0 1 0", "0 0 0 1" if "nan" in matrix else "0 0 1 1"]
    (tmp_path / "m.txt").write_text("\n".join(rows), encoding="utf-8")
    message = r"m\.txt: expected finite numbers and the last row 0 0 0 1, got \[\[1\.0"
    fails(capsys, 2, message, "render", ball, "-o", picture, "--mesh", f"{plate}@{tmp_path / 'm.txt'}")
    message = r"--mesh: expected FILE@x,y,z or FILE@MATRIX, got '1,2,nan' after the @"
    fails(capsys, 2, message, "render", ball, "-o", picture, "--mesh", f"{plate}@1,2,nan")


def test_negative_levels_in_capitals():
    assert join_negative(["render", "--level", "-1E-3", "-l", "-2e1"]) == ["render", "--level=-1E-3", "-l-2e1"]
