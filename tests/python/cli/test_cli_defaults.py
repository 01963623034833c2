"""Pictures for which no option is given: studio light, the level and the pieces that are worth looking at."""

import re

import numpy as np
import pytest
from command_line import pixels

import isospline
from isospline.cli.main import main
from isospline.levels import histogram
from isospline.suggest.presentation import suggested_surface

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


@pytest.mark.sweep(2)
@pytest.mark.slow
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


def test_the_default_picture_is_in_studio_light(ball, picture):
    assert main(["render", str(ball), "-l", "0", "--size", "48x36", "-o", str(picture)]) == 0
    volume = isospline.Volume(np.load(ball))
    surface = isospline.Isosurface(volume, 0, closed=True)
    expected = isospline.render(
        surface,
        size=(48, 36),
        samples=4,
        color="#d9c7a8",
        light=isospline.Studio(),
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
        color="#d9c7a8",
        light=isospline.Studio(fast=True),
    )
    difference = np.abs(pixels(picture).astype(int) - expected.to_srgb().astype(int))
    assert difference.max() <= 2  # the border that closes it is no part of this ball


@pytest.mark.parametrize("light", ["studio", "ambient-occlusion"])
def test_slow_pictures_announce_their_time(ball, picture, capsys, monkeypatch, light):
    """The time of a small picture, for all pixels: a clock that advances with each pixel is the oracle."""
    from isospline.cli import picture as cli_picture

    clock = [0.0]

    def render(scene, camera, *, size, **options):
        clock[0] += 1e-3 * size[0] * size[1]
        return isospline_render(scene, camera, size=size, **options)

    isospline_render = isospline.render
    monkeypatch.setattr(isospline, "render", render)
    monkeypatch.setattr(cli_picture.time, "perf_counter", lambda: clock[0])
    command = ["render", str(ball), "-l", "0", "-o", str(picture), "--light", light]
    for size, options, expected in (
        ("160x120", [], "19 s"),
        ("160x120", ["--opacity", "0.3", "--turntable", "2"], "38 s"),
        ("160x120", ["--quiet"], None),
        ("40x30", [], None),
    ):
        output = [] if "--turntable" not in options else ["-o", str(picture.with_name("turn-##.png"))]
        assert main([*command, "--size", size, *options, *output]) == 0
        said = re.findall(r"rendering takes about (\d+ s)(; --fast leaves shadows out)?", capsys.readouterr().err)
        hint = "; --fast leaves shadows out" if light == "studio" else ""
        assert said == ([] if expected is None else [(expected, hint)])


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
    assert "above water, for bones" in told and "only the body is kept" in told
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
    for name, exact in (("scan.nii.gz", ()), ("scan.zarr", ("--exact",))):
        out = tmp_path / f"{name}.png"
        given = ["render", str(tmp_path / name), "--size", "64x48", "--fast", "--quiet", "-o", str(out)]
        given += ["--annotate", "scale_bar"]
        capsys.readouterr()
        assert main([*given, *exact]) == 0
        assert "above water, for bones" in capsys.readouterr().err
        assert main([*given, *exact, "--view", "anterior", "--level", "300"]) == 0
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
    assert main([*common, "--view", "front", "--no-capped", "--clip", "0,0,-99,0,0,1"]) == 0
    np.testing.assert_array_equal(pixels(picture)[..., 3] > 0, closed)
    assert main([*common, "--view", "front", "--no-closed"]) == 0
    assert closed.mean() > 0.5 and (pixels(picture)[..., 3] > 0).mean() < 0.5 * closed.mean()


def test_a_solid_in_an_oblique_volume_is_closed():
    turn = np.array([(0.6, -0.8, 0), (0.8, 0.6, 0), (0, 0, 1)])
    for degree in (1, 2, 3):
        for axes in ("zyx", "xyz"):
            place = dict(spacing=(1, 2, 0.5), direction=turn, origin=(3, 4, 5))
            volume = isospline.Volume(np.ones((6, 7, 8), np.float32), degree=degree, axes=axes, **place)
            surface = isospline.Isosurface(volume, 0.5, closed=True)
            cells = np.array([8, 7, 6] if axes == "zyx" else [6, 7, 8]) - (degree % 2)
            assert surface.enclosed_volume().value == pytest.approx(cells.prod() * 1.0, rel=1e-6)
            assert surface.to_mesh().to_trimesh().is_watertight


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


def test_the_command_tells_what_stands_out(tmp_path, capsys):
    pytest.importorskip("websockets")  # of the viewer
    z, y, x = np.mgrid[0:48, 0:48, 0:48]
    values = np.where(np.hypot(np.hypot(x - 24, (y - 20) / 2), z - 24) < 7, 200, 0)
    values[:, 40:44] = 200
    path, picture, other = tmp_path / "ball.npy", tmp_path / "a.png", tmp_path / "b.png"
    np.save(path, values.astype(np.uint8))
    options = ["--fast", "--size", "48x36"]
    assert main(["render", str(path), *options, "-o", str(picture)]) == 0
    told = capsys.readouterr().err
    assert "it lies on a plate; --view three-quarter is the view by the directions of the file" in told
    assert "the plate on which it lies is left out; --largest all shows it" in told
    assert main(["render", str(path), *options, "--view", "three-quarter", "-o", str(other)]) == 0
    assert "lies on a plate;" not in capsys.readouterr().err
    assert not np.array_equal(pixels(picture), pixels(other))
    # The solid below the level of the negative values is the same.
    below = tmp_path / "below.npy"
    np.save(below, -values.astype(np.int16))
    assert main(["render", str(below), *options, "--inside", "below", "-o", str(other)]) == 0
    told = capsys.readouterr().err
    assert "it lies on a plate;" in told and "the plate on which it lies is left out" in told
    assert np.abs(pixels(picture).astype(int) - pixels(other)).max() <= 1
    # The same from Python, in the viewer and for a notebook: camera and pieces.
    volume = isospline.Volume(values.astype(np.uint8))
    surface = suggested_surface(volume)
    assert surface.bounds[1, 1] < 39
    with isospline.view(path, browser=False) as viewer:
        (shown,) = viewer.state.objects
        camera = viewer.camera_towards("home", (48, 36))
        assert shown.body_level == shown.level
        assert camera.up == (0, -1, 0)
        with viewer.making() as maker:
            maker.geometry_ids(viewer.state)
            np.testing.assert_allclose(maker.scene.bounds, surface.bounds)
    assert isospline.camera_for(surface).up.tolist() == [0, -1, 0]


@pytest.mark.parametrize(("options", "is_drawn"), [([], True), (["--annotate", "none"], False)])
def test_a_scale_bar_is_drawn_if_the_unit_is_known(tmp_path, ball, picture, options, is_drawn):
    nibabel = pytest.importorskip("nibabel")
    path = tmp_path / "ball.nii"
    image = nibabel.Nifti1Image(np.load(ball).T, np.eye(4))
    image.header.set_xyzt_units("mm")
    nibabel.save(image, path)
    common = ["-l", "0", "--fast", "--size", "160x48"]  # the corner is free, so that both cameras are the same
    assert main(["render", str(path), *common, *options, "-o", str(picture)]) == 0
    of_file = pixels(picture)
    assert main(["render", str(ball), *common, "-o", str(picture)]) == 0
    differs = (of_file != pixels(picture)).any(axis=-1)
    assert differs.any() == is_drawn and not differs[:30].any()
