"""Numbers at the vertices of meshes: they survive files, other libraries and pickle. The oracle is what was given."""

import pickle

import numpy as np
import pytest

import isospline

TETRAHEDRON = [(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3.0)]
OUTWARD = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
OUTER = [(-1, -1, -1), (2, -1, -1), (-1, 3, -1), (-1, -1, 4)]
VALUES = [37.5, -1e-3, np.nan, 1 / 3]


@pytest.fixture
def mesh():
    return isospline.Mesh(TETRAHEDRON, OUTWARD, colors="red", values=VALUES, values_name="temperature")


def check(found, name="temperature", rtol=0.0):
    """Compare the values at the corners of the faces, as files may have vertices in another order."""
    assert found.values_name == name and found.values.dtype == float
    corners = {tuple(position): value for position, value in zip(TETRAHEDRON, VALUES)}
    expected = [corners[tuple(position.tolist())] for position in found.vertices]
    np.testing.assert_allclose(found.values, expected, rtol=rtol)


def test_values_are_kept_as_given(mesh):
    check(mesh)
    assert not mesh.values.flags.writeable
    check(pickle.loads(pickle.dumps(mesh)))
    plain = isospline.Mesh(TETRAHEDRON, OUTWARD, values=np.arange(4, dtype=np.int8))
    assert plain.values_name == "values" and plain.values.tolist() == [0, 1, 2, 3]
    none = pickle.loads(pickle.dumps(isospline.Mesh(TETRAHEDRON, OUTWARD)))
    assert none.values is None and none.values_name == "values"


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ([1, 2, 3], r"values: expected shape \(4,\), one for each vertex, got \(3,\)"),
        ([[1], [2], [3], [4]], r"values: expected shape \(4,\), one for each vertex, got \(4, 1\)"),
        (["a", "b", "c", "d"], "values: expected"),
        ([1j, 2, 3, 4], "values: expected"),
    ],
)
def test_other_values_are_refused(values, said):
    with pytest.raises((ValueError, TypeError), match=said):
        isospline.Mesh(TETRAHEDRON, OUTWARD, values=values)


def test_a_name_is_not_empty():
    with pytest.raises(ValueError, match="values_name: expected a name"):
        isospline.Mesh(TETRAHEDRON, OUTWARD, values=VALUES, values_name="")


@pytest.mark.parametrize("name", ["trimesh", "pyvista", "meshio"])
def test_values_survive_libraries(mesh, name):
    pytest.importorskip(name)
    if name == "meshio":
        pytest.importorskip("pyvista")  # which converts the cells
    other = getattr(mesh, f"to_{name}")()
    check(getattr(isospline.Mesh, f"from_{name}")(other))
    if name == "pyvista":
        assert other.active_scalars_name == "temperature"
    replaced = getattr(isospline.Mesh, f"from_{name}")(other, values=[0, 1, 2, 3], values_name="other")
    assert replaced.values.tolist() == [0, 1, 2, 3] and replaced.values_name == "other"
    plain = getattr(isospline.Mesh(TETRAHEDRON, OUTWARD), f"to_{name}")()
    assert getattr(isospline.Mesh, f"from_{name}")(plain).values is None


@pytest.mark.parametrize(
    ("given", "written"),
    [("temperature", "temperature"), ("two words", "two_words"), ("x", None), ("à", "à"), (" \t", "values")],
)
def test_values_survive_ply(tmp_path, given, written):
    pytest.importorskip("trimesh")
    meshio = pytest.importorskip("meshio")
    mesh = isospline.Mesh(TETRAHEDRON, OUTWARD, normals=TETRAHEDRON, values=VALUES, values_name=given)
    mesh.write(tmp_path / "a.ply")
    name = written or "x_values"
    check(isospline.read_mesh(tmp_path / "a.ply"), name)
    np.testing.assert_array_equal(meshio.read(tmp_path / "a.ply").point_data[name], VALUES)


@pytest.mark.parametrize("name", ["colors", "normals", "Normals", "RGB", "s", "u", "x", "nx", "red", "alpha"])
def test_values_may_have_any_name(tmp_path, name):
    for library in ("trimesh", "pyvista", "meshio"):
        pytest.importorskip(library)
    for given in ({}, {"normals": OUTER, "colors": "red"}):
        mesh = isospline.Mesh(TETRAHEDRON, OUTWARD, values=VALUES, values_name=name, **given)
        mesh.write(tmp_path / "a.ply")
        found = {"ply": isospline.read_mesh(tmp_path / "a.ply")}
        for library in ("trimesh", "pyvista", "meshio"):
            found[library] = getattr(isospline.Mesh, f"from_{library}")(getattr(mesh, f"to_{library}")())
        for library, copy in found.items():
            assert copy.values_name in (name, f"{name}_values"), library
            check(copy, copy.values_name)
            assert (copy.colors is None, copy.normals is None) == ((False, False) if given else (True, True)), library


def test_columns_of_meshio_are_values():
    meshio = pytest.importorskip("meshio")
    pytest.importorskip("pyvista")
    given = {"s": np.zeros(4), "t": np.zeros(4), "temperature": np.array(VALUES)[:, None]}  # places in a texture first
    check(isospline.Mesh.from_meshio(meshio.Mesh(TETRAHEDRON, [("triangle", OUTWARD)], given)))


@pytest.mark.parametrize(
    ("suffix", "lost"),
    [(".stl", "values and colors"), (".3mf", "values and colors"), (".obj", "values"), (".glb", "values")],
)
def test_other_formats_have_no_values(tmp_path, mesh, suffix, lost):
    pytest.importorskip("trimesh")
    if suffix == ".3mf":
        pytest.importorskip("lxml")
    with pytest.warns(UserWarning, match=rf"a{suffix}: the format has no {lost} of vertices: they are left out"):
        mesh.write(tmp_path / f"a{suffix}")
    found = isospline.read_mesh(tmp_path / f"a{suffix}")
    assert found.values is None and (found.colors is None) == ("colors" in lost)


@pytest.mark.parametrize("suffix", [".vtk", ".vtp", ".vtu", ".xdmf", ".inp"])
def test_values_of_files_of_other_programs_are_read(tmp_path, mesh, suffix):
    meshio, pyvista = pytest.importorskip("meshio"), pytest.importorskip("pyvista")
    if suffix == ".xdmf":
        pytest.importorskip("h5py")
    path = tmp_path / f"a{suffix}"
    if suffix in (".vtk", ".vtp"):
        mesh.to_pyvista().save(path)
    elif suffix == ".vtu":
        pyvista.from_meshio(mesh.to_meshio()).save(path)
    else:
        meshio.write(path, mesh.to_meshio(), **({"data_format": "XML"} if suffix == ".xdmf" else {}))
    found = isospline.read_mesh(path)
    if suffix == ".inp":  # has no data of points
        assert found.values is None
    else:
        check(found)


def test_the_active_scalars_come_first():
    pyvista = pytest.importorskip("pyvista")
    shape = pyvista.PolyData(np.array(TETRAHEDRON), np.insert(OUTWARD, 0, 3, axis=1))
    shape.point_data["words"] = ["a", "b", "c", "d"]
    shape.point_data["vectors"] = np.zeros((4, 3))
    shape.point_data["first"] = [1.0, 2, 3, 4]
    shape.point_data["second"] = np.array([5, 6, 7, 8], np.uint8)
    for active, name, values in (("second", "second", [5, 6, 7, 8]), ("vectors", "first", [1, 2, 3, 4])):
        shape.set_active_scalars(active)
        mesh = isospline.Mesh.from_pyvista(shape)
        assert (mesh.values_name, mesh.values.tolist()) == (name, values)


def test_active_vectors_are_no_colors():
    pyvista = pytest.importorskip("pyvista")
    shape = pyvista.PolyData(np.array(TETRAHEDRON), np.insert(OUTWARD, 0, 3, axis=1))
    shape.point_data["velocity"] = np.full((4, 3), 0.5)
    shape.set_active_scalars("velocity")
    assert isospline.Mesh.from_pyvista(shape).colors is None
    shape.point_data["colors"] = np.full((4, 3), (255, 0, 0), np.uint8)
    shape.set_active_scalars("velocity")
    np.testing.assert_array_equal(isospline.Mesh.from_pyvista(shape).colors, [(1, 0, 0)] * 4)
    shape.point_data["bytes"] = np.full((4, 3), (0, 0, 255), np.uint8)
    shape.set_active_scalars("bytes")
    np.testing.assert_array_equal(isospline.Mesh.from_pyvista(shape).colors, [(0, 0, 1)] * 4)


def test_parts_of_a_scene_keep_values_that_all_of_them_have(mesh):
    trimesh = pytest.importorskip("trimesh")
    scene = trimesh.Scene([mesh.to_trimesh(), mesh.to_trimesh()])
    found = isospline.Mesh.from_trimesh(scene)
    np.testing.assert_array_equal(found.values, VALUES + VALUES)
    scene.add_geometry(trimesh.creation.box())
    assert isospline.Mesh.from_trimesh(scene).values is None


def test_ids_that_pyvista_adds_are_no_values():
    pyvista = pytest.importorskip("pyvista")
    split = pyvista.Sphere().compute_normals(split_vertices=True)
    assert "pyvistaOriginalPointIds" in split.point_data
    assert isospline.Mesh.from_pyvista(split).values is None
