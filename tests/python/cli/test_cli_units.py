"""Files in different units of length in one picture: those of `--mesh` and `--color-by`, and the viewer's."""

import numpy as np
import pytest
from command_line import fails, pixels, render, write_nrrd

import isospline
from isospline.viewer.document import Document, read_source, source_of

STUDIO = ("--fast", "-l", "0")


@pytest.fixture
def files(ball, tmp_path):
    """One ball in millimetres, micrometres and furlongs, and meshes of it."""
    data = np.load(ball)
    for name, spacing, unit in (("mm", 0.5, "mm"), ("um", 500.0, "um"), ("furlong", 0.5, "furlong")):
        write_nrrd(tmp_path / f"{name}.nrrd", data, spacing, unit)
    mesh = isospline.Isosurface(isospline.read_volume(tmp_path / "mm.nrrd").to_volume(), 0).to_mesh()
    mesh.write(tmp_path / "part.ply")
    return {path.name: path for path in tmp_path.iterdir()}


@pytest.fixture
def parts(files, tmp_path):
    """The same mesh in files of two units."""
    pytest.importorskip("lxml")
    pytest.importorskip("networkx")
    mesh = isospline.read_mesh(files["part.ply"])
    mesh.write(tmp_path / "mm.3mf", unit="mm")
    isospline.Mesh(mesh.vertices / 25.4, mesh.faces).write(tmp_path / "inch.3mf", unit="inch")
    return [tmp_path / "mm.3mf", tmp_path / "inch.3mf"]


@pytest.mark.parametrize("options", [("--color-by", "--limits=-0.1,0.1"), ("--mesh",)], ids=["distance", "mesh"])
def test_meshes_are_converted_to_the_unit_of_the_volume(files, parts, picture, capsys, options):
    shown = []
    for part in parts:
        render(files["mm.nrrd"], picture, *STUDIO, options[0], part, *options[1:])
        shown.append(pixels(picture).astype(int))
        is_told = f"{part}: coordinates in inch are converted to mm" in capsys.readouterr().err
        assert is_told == (part.name == "inch.3mf")
    # Where the mesh and the surface are at one place, rounding decides which of both is seen.
    assert np.abs(shown[0] - shown[1]).mean() < 3 and np.ptp(shown[0]) > 100
    if options[0] == "--mesh":
        place = files["mm.nrrd"].parent / "place.txt"
        np.savetxt(place, np.diag([25.4, 25.4, 25.4, 1]))  # which converts it already
        render(files["mm.nrrd"], picture, *STUDIO, "--mesh", f"{parts[1]}@{place}")
        assert np.abs(shown[0] - pixels(picture)).mean() < 3
        assert "converted" not in capsys.readouterr().err


def test_volumes_of_colors_are_converted(files, picture, capsys):
    shown = []
    for name in ("mm", "um"):
        render(files["mm.nrrd"], picture, *STUDIO, "--color-by", files[f"{name}.nrrd"], "--limits=-0.01,0.01")
        shown.append(pixels(picture).astype(int))
    assert "um.nrrd: coordinates in um are converted to mm" in capsys.readouterr().err
    assert np.abs(shown[0] - shown[1]).max() <= 1
    words = ("render", files["mm.nrrd"], "-o", picture, *STUDIO, "--color-by", files["furlong.nrrd"])
    fails(capsys, 2, r"furlong\.nrrd: expected coordinates in mm, as in .*mm\.nrrd, got furlong", *words)


def test_the_viewer_has_files_of_one_unit(files, parts):
    document = Document()
    document.add(read_source(files["mm.nrrd"]))
    for other in (files["um.nrrd"], files["furlong.nrrd"], parts[1]):
        unit = "inch" if other.suffix == ".3mf" else other.stem
        with pytest.raises(ValueError, match=rf"{other.name}: expected coordinates in mm, as in mm.nrrd, got {unit}"):
            document.add(read_source(other))
    data = np.load(files["ball.npy"])
    with pytest.raises(ValueError, match=r"expected coordinates in mm, as in mm\.nrrd, got µm"):
        document.add(source_of(isospline.Volume(data, unit="µm")))
    for same in (parts[0], files["part.ply"], files["ball.npy"]):
        document.add(read_source(same))
    assert len(list(document)) == 4


def test_the_viewer_shows_surfaces_that_are_converted(files):
    mm, um = (
        isospline.Isosurface(isospline.read_volume(files[f"{name}.nrrd"]).to_volume(), 0) for name in ("mm", "um")
    )
    scene = isospline.Scene([mm, (um, np.diag([0.001, 0.001, 0.001, 1]))])
    with isospline.view(scene, browser=False) as viewer:
        sources = list(viewer.document)
    assert [source.unit for source in sources] == ["mm", ""]
    np.testing.assert_allclose(sources[1].item.bounds, mm.volume.bounds, rtol=1e-12)
