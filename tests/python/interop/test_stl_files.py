"""STL files that are written."""

import sys

import numpy as np
import pytest

import isospline

trimesh = pytest.importorskip("trimesh")


def test_stl_is_written_without_other_packages_as_trimesh_writes_it(tmp_path, monkeypatch):
    field = isospline.volumes.torus()
    surface = isospline.Isosurface(field.volume(24), field.level)
    expected = surface.to_trimesh().export(file_type="stl")
    with monkeypatch.context() as without:
        without.setitem(sys.modules, "trimesh", None)
        surface.write(tmp_path / "a.stl")
    written = (tmp_path / "a.stl").read_bytes()
    assert written[:84] == expected[:84] and len(written) == len(expected)
    kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    triangles, others = (np.frombuffer(each, kind, offset=84) for each in (written, expected))
    np.testing.assert_array_equal(triangles["corners"], others["corners"])
    np.testing.assert_allclose(triangles["normal"], others["normal"], atol=1e-6)
