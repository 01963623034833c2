"""Arrays of glTF files. The oracles are VTK's reader and the formulas of the standard."""

import base64
import json
from importlib.util import find_spec

import numpy as np
import pytest

import isospline

pytest.importorskip("trimesh")
pyvista = pytest.importorskip("pyvista")

POINTS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0.5, 2, 0), (0, 1, 0)], "<f4")
CODES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}


class Tree:
    """A glTF file with one mesh."""

    def __init__(self, **fields):
        self.buffer, self.views, self.accessors, self.parts, self.fields = b"", [], [], [], fields

    def view(self, array):
        self.buffer += b"\0" * (-len(self.buffer) % 4)
        self.views.append({"buffer": 0, "byteOffset": len(self.buffer), "byteLength": array.nbytes})
        self.buffer += array.tobytes()
        return {"bufferView": len(self.views) - 1, "componentType": CODES[array.dtype.str[1:]]}

    def array(self, array, **fields):
        """The index of an accessor."""
        kind = {1: "SCALAR", 2: "VEC3"}[array.ndim]
        limits = {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()} if array.ndim == 2 else {}
        self.accessors.append({**self.view(array), "count": len(array), "type": kind, **limits, **fields})
        return len(self.accessors) - 1

    def sparse(self, places, values):
        """What replaces some rows of an array."""
        places, values = self.view(np.array(places, "<u2")), self.view(np.array(values, "<f4"))
        del values["componentType"]
        return {"count": 2, "indices": places, "values": values}

    def part(self, attributes, **fields):
        self.parts.append({"attributes": attributes, **fields})
        return self

    def write(self, path):
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.buffer).decode()
        tree = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "scale": [2, 2, 2]}],
            "meshes": [{"primitives": self.parts}],
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": len(self.buffer), "uri": uri}],
            **self.fields,
        }
        path.write_text(json.dumps(tree), encoding="utf-8")
        return path


def check_as_vtk(path):
    """Compare the centres and normals of the faces, in the order of the file, with VTK's."""
    mesh = isospline.read_mesh(path)
    expected = pyvista.read(path).combine().extract_surface(algorithm="dataset_surface").triangulate()
    for of in (
        lambda corners: corners.mean(axis=1),
        lambda corners: np.cross(*np.diff(corners, axis=1).swapaxes(0, 1)),
    ):
        found = of(mesh.vertices[mesh.faces])
        np.testing.assert_allclose(found, of(np.asarray(expected.points)[expected.regular_faces]), atol=1e-6)
    return mesh


@pytest.mark.parametrize("mode", [4, 5, 6])
@pytest.mark.parametrize("indices", [None, [0, 1, 2, 4, 3, 2]])
def test_faces_of_all_modes_are_read(tmp_path, mode, indices):
    tree = Tree()
    points = POINTS if indices or mode != 4 else POINTS[:3]
    fields = {"mode": mode, **({"indices": tree.array(np.array(indices, "<u2"))} if indices else {})}
    tree.part({"POSITION": tree.array(points)}, **fields)
    path = tree.part({"POSITION": tree.array(POINTS[:3] + np.float32(5))}).write(tmp_path / "a.gltf")
    assert len(check_as_vtk(path).faces) > 1


def test_normals_of_fans_are_kept(tmp_path):
    tree = Tree()
    tree.part({"POSITION": tree.array(POINTS), "NORMAL": tree.array(np.roll(POINTS, 1, axis=1))}, mode=6)
    mesh = check_as_vtk(tree.write(tmp_path / "a.gltf"))
    np.testing.assert_array_equal(mesh.normals, np.roll(POINTS, 1, axis=1) / 2)  # by the scale of the node


@pytest.mark.parametrize("has_rows", [True, False])
def test_sparse_positions_and_normals_are_read(tmp_path, has_rows):
    tree = Tree()
    given = [(9, 8, 7), (1, 3, 2)]
    attributes = {name: tree.array(POINTS, sparse=tree.sparse([2, 4], given)) for name in ("POSITION", "NORMAL")}
    expected = POINTS.copy()
    if not has_rows:  # they are 0
        for accessor in tree.accessors:
            del accessor["bufferView"]
        expected[:] = 0
    expected[[2, 4]] = given
    indices = tree.array(np.array([0, 1, 2, 2, 3, 4], "<u2"))
    mesh = isospline.read_mesh(tree.part(attributes, indices=indices).write(tmp_path / "a.gltf"))
    np.testing.assert_array_equal(mesh.vertices, 2 * expected)
    np.testing.assert_array_equal(mesh.normals, expected / 2)


@pytest.mark.parametrize("kind", ["i1", "u1", "<i2", "<u2"])
@pytest.mark.parametrize("is_normalized", [True, False])
def test_quantized_positions_are_read(tmp_path, kind, is_normalized):
    most = np.iinfo(kind).max
    stored = np.rint(POINTS / 2 * most).astype(kind)
    stored[0] = np.iinfo(kind).min
    name = "KHR_mesh_quantization"
    tree = Tree(extensionsUsed=[name], extensionsRequired=[name])
    positions = tree.array(np.pad(stored, ((0, 0), (0, 1))), normalized=is_normalized)
    tree.accessors[0]["type"], tree.views[0]["byteStride"] = "VEC3", 4 * stored.itemsize
    tree.part({"POSITION": positions}, indices=tree.array(np.array([0, 1, 2], "<u2")))
    mesh = isospline.read_mesh(tree.write(tmp_path / "a.gltf"))
    expected = np.maximum(stored / most, -1) if is_normalized else stored.astype(float)
    np.testing.assert_allclose(mesh.vertices, 2 * expected, atol=1e-12)


@pytest.mark.parametrize(
    "fields, part, said",
    [
        ({"extensionsRequired": ["EXT_meshopt_compression"]}, {}, "required extensions, got EXT_meshopt_compression"),
        ({"extensionsRequired": ["KHR_materials_unlit"]}, {"mode": 7}, "a mode of primitives from 0 to 6, got 7"),
        ({}, {"indices": 1}, "expected indices of faces that are not sparse"),
    ],
)
def test_what_is_not_known_is_refused(tmp_path, fields, part, said):
    tree = Tree(**fields)
    tree.part({"POSITION": tree.array(POINTS[:3])}, **part)
    tree.array(np.array([0, 1, 2], "<u2"), sparse={})
    with pytest.raises(ValueError, match=rf"a\.gltf: .*{said}"):
        isospline.read_mesh(tree.write(tmp_path / "a.gltf"))


@pytest.mark.skipif(find_spec("DracoPy") is not None, reason="DracoPy is installed")
def test_compressed_positions_need_a_package(tmp_path):
    tree = Tree()
    compressed = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}}
    tree.part({"POSITION": tree.array(POINTS[:3])}, extensions=compressed)
    del tree.accessors[0]["bufferView"]
    with pytest.raises(ModuleNotFoundError, match=r"a\.gltf: read_mesh needs the package DracoPy"):
        isospline.read_mesh(tree.write(tmp_path / "a.gltf"))
