"""docs/migration.md: every line runs, ours always and theirs where the library is installed."""

import re
import subprocess
import sys

import numpy as np
import pytest

import isospline
from isospline import volumes

SECTION = re.compile(r"^## (.+)\n\n`(.+)`\n\n((?:\|.*\n)+)", re.MULTILINE)
ROW = re.compile(r"^\| `(.+?)` \| `(.+)` \|$", re.MULTILINE)


def sections(repository):
    """Of each library, how it is imported and the lines of the table."""
    text = (repository / "docs" / "migration.md").read_text()
    return {name: (imports, ROW.findall(table), table) for name, imports, table in SECTION.findall(text)}


def test_every_line_is_run(repository):
    found = sections(repository)
    assert list(found) == ["PyVista", "trimesh", "Open3D", "Mitsuba 3"]
    for _, rows, table in found.values():
        assert len(rows) == len(table.splitlines()) - 2 > 8


@pytest.fixture
def names(tmp_path, monkeypatch):
    """The files and the names that the page speaks of."""
    pyvista = pytest.importorskip("pyvista")
    trimesh = pytest.importorskip("trimesh")
    field = volumes.sphere(0.7)
    grid = pyvista.ImageData(dimensions=(20,) * 3, **field.grid(20))
    grid["values"] = field.samples(20).ravel()
    grid.save(tmp_path / "volume.vti")
    trimesh.creation.icosphere(2, 0.8).export(tmp_path / "part.stl")
    monkeypatch.chdir(tmp_path)
    return {"np": np, "iso": isospline, "trimesh": trimesh, "samples": field.samples(20), "level": field.level}


@pytest.mark.parametrize("library", ["PyVista", "trimesh", "Open3D", "Mitsuba 3"])
def test_our_lines_run(repository, names, library):
    _, rows, _ = sections(repository)[library]
    for _, ours in rows:
        exec(ours, names)
    if library == "PyVista":
        assert names["pixels"].shape == (48, 64, 4) and names["distance"][0] == pytest.approx(2.3, abs=0.01)
    elif library == "Open3D":
        assert names["pinhole"].shape == (48, 64, 6) and np.isfinite(names["t"]).all()


def can_draw():
    """Whether PyVista can: without OpenGL it ends the process."""
    code = "import pyvista; plotter = pyvista.Plotter(off_screen=True); plotter.add_mesh(pyvista.Sphere()); "
    done = subprocess.run([sys.executable, "-c", code + "plotter.screenshot()"], capture_output=True, check=False)
    return done.returncode == 0


@pytest.mark.parametrize("library", ["PyVista", "trimesh", "Open3D", "Mitsuba 3"])
def test_their_lines_run(repository, names, library):
    imports, rows, _ = sections(repository)[library]
    pytest.importorskip(re.match(r"import (\w+)", imports).group(1))
    if library == "PyVista" and not can_draw():
        pytest.skip("PyVista cannot draw here")
    theirs, ours = {**names}, {**names}
    exec(imports, theirs)
    for left, right in rows:
        exec(left, theirs)
        exec(right, ours)
    if library == "PyVista":
        assert theirs["distance"]["implicit_distance"][0] == pytest.approx(ours["distance"][0], abs=0.02)
        assert len(theirs["point"]) == (ours["crossings"].geometry_ids == 0).sum() == 2
    elif library == "trimesh":
        np.testing.assert_allclose(np.sort(theirs["locations"], axis=0), ours["locations"], atol=1e-6)
        np.testing.assert_array_equal(theirs["hit"], ours["hit"])
        np.testing.assert_array_equal(theirs["inside"], ours["inside"])
    elif library == "Open3D":
        np.testing.assert_allclose(theirs["t"], ours["t"], rtol=1e-5)
        np.testing.assert_allclose(theirs["pinhole"].numpy()[..., :3], ours["pinhole"][..., :3], atol=1e-5)
        directions = (each / np.linalg.norm(each, axis=-1, keepdims=True)
                      for each in (theirs["pinhole"].numpy()[..., 3:], ours["pinhole"][..., 3:]))  # fmt: skip
        np.testing.assert_allclose(*directions, atol=1e-5)
