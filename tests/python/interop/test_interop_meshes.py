"""Meshes of other libraries and from files. The oracle is the areas, volumes and hits of the libraries."""

import base64
import json

import numpy as np
import pytest

import isospline
from isospline.colors import linear

meshio = pytest.importorskip("meshio")
pyvista = pytest.importorskip("pyvista")
trimesh = pytest.importorskip("trimesh")

TETRAHEDRON = np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3.0)])
OUTWARD = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])


def corners(mesh):
    """(F, 3, 3) corners of the faces."""
    return np.asarray(mesh.vertices)[np.asarray(mesh.faces)]


def area(mesh):
    a, b, c = np.moveaxis(corners(mesh), 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def volume(mesh):
    """The volume of a closed mesh; positive if its faces are counter-clockwise seen from outside."""
    return np.linalg.det(corners(mesh)).sum() / 6


# trimesh


def test_trimesh_is_taken_over_as_it_is():
    shape = trimesh.creation.icosphere(subdivisions=2, radius=3)
    mesh = isospline.Mesh.from_trimesh(shape)
    np.testing.assert_array_equal(mesh.vertices, shape.vertices)
    np.testing.assert_array_equal(mesh.faces, shape.faces)


def test_trimesh_scene_is_taken_over_in_place():
    box = trimesh.creation.box(extents=(1, 2, 3))
    places = [trimesh.transformations.rotation_matrix(0.5, (1, 2, 3)), np.diag([2.0, 1, -1, 1])]
    places[1][:3, 3] = 4, 5, 6
    scene = trimesh.Scene()
    for place in places:
        scene.add_geometry(box, transform=place, geom_name="box")
    mesh = isospline.Mesh.from_trimesh(scene)
    assert len(mesh.faces) == 24
    np.testing.assert_allclose(mesh.bounds, scene.bounds, atol=1e-12)
    moved = np.concatenate([trimesh.transform_points(box.vertices, place) for place in places])
    np.testing.assert_allclose(mesh.vertices, moved, atol=1e-12)
    # trimesh reverses the faces of mirrored instances, so that the outside stays outside.
    assert volume(mesh) == pytest.approx(6 + 12)


def test_instances_of_a_scene_may_be_flat():
    shape = trimesh.Trimesh(TETRAHEDRON, OUTWARD, vertex_normals=np.eye(4)[:, 1:], process=False)
    scene = trimesh.Scene()
    scene.add_geometry(shape, transform=np.diag([1.0, 2, 0, 1]))
    mesh = isospline.Mesh.from_trimesh(scene)
    np.testing.assert_array_equal(mesh.vertices, TETRAHEDRON * (1, 2, 0))
    np.testing.assert_array_equal(mesh.faces, OUTWARD)
    np.testing.assert_array_equal(mesh.normals, [(0, 0, 0), (0, 0, 0), (0, 0, 0), (0, 0, 2)])


def test_normals_that_trimesh_computes_are_not_those_of_the_mesh(rng, tmp_path):
    shape = trimesh.creation.icosphere(2)
    computed = np.array(shape.vertex_normals)  # and kept by trimesh
    assert isospline.Mesh.from_trimesh(shape).normals is None
    assert isospline.Mesh.from_trimesh(trimesh.Scene([shape])).normals is None
    mesh = isospline.Mesh.from_trimesh(shape, normals=computed)
    mesh.write(tmp_path / "a.obj")
    for each in (mesh, isospline.read_mesh(tmp_path / "a.obj")):
        np.testing.assert_array_equal(each.normals, computed)
    shape.apply_transform(trimesh.transformations.random_rotation_matrix(rng.random(3)))
    assert isospline.Mesh.from_trimesh(shape).normals is None
    shape.vertex_normals = computed
    np.testing.assert_array_equal(isospline.Mesh.from_trimesh(shape).normals, computed)


# PyVista and VTK


def test_pyvista_triangles_are_taken_over_as_they_are():
    shape = pyvista.Sphere(radius=2)
    mesh = isospline.Mesh.from_pyvista(shape)
    np.testing.assert_array_equal(mesh.vertices, shape.points)
    np.testing.assert_array_equal(mesh.faces, shape.regular_faces)


@pytest.mark.parametrize(
    "shape",
    [
        pyvista.Cube(x_length=2),
        pyvista.Cylinder(resolution=7),
        pyvista.Superquadric(),
        pyvista.Sphere().strip(),
        pyvista.Dodecahedron(),
    ],
    ids=["quads", "polygons", "points shared", "strips", "pentagons"],
)
def test_pyvista_polygons_are_cut_into_triangles(shape):
    mesh = isospline.Mesh.from_pyvista(shape)
    assert area(mesh) == pytest.approx(shape.area, rel=1e-5)
    assert volume(mesh) == pytest.approx(shape.volume, rel=1e-5)
    np.testing.assert_allclose(mesh.bounds.T.ravel(), shape.bounds, atol=1e-6)


def test_pyvista_polygons_need_not_be_convex():
    letter = np.array([(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)])
    shape = pyvista.PolyData(np.c_[letter, np.zeros(6)], faces=[6, *range(6)], lines=[2, 0, 3])
    mesh = isospline.Mesh.from_pyvista(shape)
    assert len(mesh.faces) == 4
    assert area(mesh) == pytest.approx(5)


@pytest.mark.parametrize("size", [1e-200, 1e-9, 1, 1e9])
def test_pyvista_polygons_may_be_of_any_size(size):
    angles = np.arange(40) * np.pi / 20
    star = np.c_[np.cos(angles), np.sin(angles), np.zeros(40)] * np.tile([1, 1.9], 20)[:, None]
    shape = pyvista.PolyData(star * size, faces=[40, *range(40)])
    mesh = isospline.Mesh.from_pyvista(shape)
    np.testing.assert_array_equal(mesh.vertices, shape.points)
    assert area(isospline.Mesh(mesh.vertices / size, mesh.faces)) == pytest.approx(20 * 1.9 * np.sin(np.pi / 20))


def test_pyvista_mesh_is_hit_where_pyvista_hits_it(rng):
    shape = pyvista.ParametricTorus(ringradius=1, crosssectionradius=0.4).rotate_x(40)
    scene = isospline.Scene([isospline.Mesh.from_pyvista(shape)])
    origins = rng.normal(size=(40, 3))
    origins *= 4 / np.linalg.norm(origins, axis=1)[:, None]
    targets = rng.uniform(-1, 1, (40, 3))
    hits = scene.cast_rays(np.hstack([origins, targets - origins]))["t_hit"]
    for origin, direction, t in zip(origins, targets - origins, hits):
        # PyVista does not sort its crossings along the ray.
        points, _ = shape.ray_trace(origin, origin + 3 * direction)
        expected = min((points - origin) @ direction / (direction @ direction), default=np.inf)
        assert t == pytest.approx(expected, abs=1e-5)
    assert 10 < np.isfinite(hits).sum() < 40


def test_vtk_surface_is_taken_over():
    from vtkmodules.vtkFiltersSources import vtkConeSource

    cone = vtkConeSource()
    cone.Update()
    assert volume(isospline.Mesh.from_vtk(cone.GetOutput())) == pytest.approx(pyvista.wrap(cone.GetOutput()).volume)


def test_of_grids_the_faces_are_taken_or_else_the_surface():
    blocks = pyvista.ImageData(dimensions=(3, 4, 5), spacing=(1, 2, 3))
    for grid in (blocks.cast_to_unstructured_grid(), blocks.cast_to_structured_grid()):
        mesh = isospline.Mesh.from_pyvista(grid)
        assert (area(mesh), volume(mesh)) == (pytest.approx(2 * (12 + 24 + 72)), pytest.approx(2 * 6 * 12))
    sheet = pyvista.ImageData(dimensions=(3, 4, 1), spacing=(1, 2, 3)).cast_to_structured_grid()
    assert area(isospline.Mesh.from_pyvista(sheet)) == pytest.approx(12)


def test_arrays_of_vtk_may_have_components_apart_or_be_computed():
    core = pytest.importorskip("vtkmodules.vtkCommonCore")
    apart, computed = (getattr(core, f"vtk{kind}Array", None) for kind in ("SOATypeFloat32", "AffineTypeFloat64"))
    if apart is None or computed is None:
        pytest.skip("since VTK 9.6")

    def array_of(rows):
        array = apart()
        array.SetNumberOfComponents(3)
        array.SetNumberOfTuples(len(rows))
        for place, row in enumerate(rows.tolist()):
            array.SetTuple(place, row)
        return array

    shape = pyvista.PolyData.from_regular_faces(TETRAHEDRON, OUTWARD)
    points = core.vtkPoints()
    points.SetData(array_of(TETRAHEDRON / 4))
    shape.SetPoints(points)
    shape.GetPointData().SetNormals(array_of(TETRAHEDRON + 0.25))
    values = computed()
    values.SetNumberOfTuples(4)
    values.ConstructBackend(0.5, 2.25)
    values.SetName("computed")
    shape.GetPointData().SetScalars(values)
    mesh = isospline.Mesh.from_vtk(shape)
    np.testing.assert_array_equal(mesh.vertices, TETRAHEDRON / 4)
    np.testing.assert_array_equal(mesh.normals, TETRAHEDRON + 0.25)
    np.testing.assert_array_equal(mesh.values, [values.GetValue(place) for place in range(4)])
    grid = pyvista.ImageData(dimensions=(2, 2, 1))
    grid.GetPointData().SetScalars(values)
    volume = isospline.Volume.from_vtk(grid, degree=1)
    np.testing.assert_allclose(volume.sample(np.asarray(grid.points)), mesh.values)


def test_pyvista_objects_without_faces_are_refused():
    for shape in (pyvista.PolyData(), pyvista.Line(), pyvista.PolyData(TETRAHEDRON)):
        with pytest.raises(ValueError, match="mesh: expected faces"):
            isospline.Mesh.from_pyvista(shape)
    with pytest.raises(TypeError, match=r"mesh: expected a surface or a grid"):
        isospline.Mesh.from_pyvista(pyvista.ImageData())


# meshio


def test_meshio_triangles_are_taken_over_in_their_order():
    cells = [("triangle", OUTWARD[:3]), ("line", [(0, 1)]), ("vertex", [(3,)]), ("triangle", OUTWARD[3:])]
    mesh = isospline.Mesh.from_meshio(meshio.Mesh(TETRAHEDRON, cells))
    np.testing.assert_array_equal(corners(mesh), TETRAHEDRON[OUTWARD])


def test_meshio_solids_have_a_surface_once():
    solid = ("tetra", [(0, 1, 2, 3)])
    for cells in ([solid], [solid, ("triangle", OUTWARD)]):
        mesh = isospline.Mesh.from_meshio(meshio.Mesh(TETRAHEDRON, cells))
        assert len(mesh.faces) == 4
        assert volume(mesh) == pytest.approx(1)


@pytest.mark.parametrize("suffix", ["", ".msh", ".inp", ".vtu"])
def test_meshio_wedges_face_outwards(tmp_path, suffix):
    points = [(0, 0, -1), (1, 0, -1), (0, 1, -1), (0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    given = meshio.Mesh(np.array(points, float), [("wedge", [(0, 1, 2, 3, 4, 5)]), ("tetra", [(3, 4, 5, 6)])])
    if suffix:
        given.write(tmp_path / f"a{suffix}")
    mesh = isospline.read_mesh(tmp_path / f"a{suffix}") if suffix else isospline.Mesh.from_meshio(given)
    assert volume(mesh) == pytest.approx(1 / 2 + 1 / 6)


def test_meshio_faces_of_all_kinds_are_cut_into_triangles():
    points = [(0, 0), (2, 0), (2, 1), (0, 1), (1, 0), (2, 0.5), (1, 1), (0, 0.5), (3, 0.5)]
    cells = [
        ("quad8", [(0, 1, 2, 3, 4, 5, 6, 7)]),
        ("triangle", [(1, 8, 2)]),
        ("polygon", [(0, 1, 8, 2, 3)]),
        ("quad", [(0, 4, 6, 3)]),
    ]
    given = meshio.Mesh(points, cells, cell_sets={"some": [np.array([0])] * 4})
    mesh = isospline.Mesh.from_meshio(given)
    assert area(mesh) == pytest.approx(2 + 0.5 + 2.5 + 1)
    assert volume(mesh) == 0
    assert list(given.cell_sets) == ["some"] and not given.cell_data and given.points.shape == (9, 2)


def test_meshio_mesh_without_faces_is_refused():
    for cells in ([], [("line", [(0, 1)])]):
        with pytest.raises(ValueError, match="mesh: expected faces"):
            isospline.Mesh.from_meshio(meshio.Mesh(TETRAHEDRON, cells))


def test_meshio_arrays_may_have_another_byte_order():
    data = {"normals": TETRAHEDRON + 0.25, "colors": TETRAHEDRON / 3, "heat": np.arange(4.0)}
    swapped = {name: array.astype(">f4") for name, array in data.items()}
    given = meshio.Mesh(TETRAHEDRON.astype(">f8"), [("triangle", OUTWARD.astype(">i4"))], point_data=swapped)
    mesh = isospline.Mesh.from_meshio(given)
    np.testing.assert_array_equal(corners(mesh), TETRAHEDRON[OUTWARD])
    np.testing.assert_array_equal(mesh.normals[mesh.faces], data["normals"][OUTWARD])
    np.testing.assert_allclose(mesh.colors[mesh.faces], data["colors"][OUTWARD], atol=1e-7)
    np.testing.assert_array_equal(mesh.values[mesh.faces], data["heat"][OUTWARD])


def test_meshio_cells_that_vtk_does_not_have_are_named():
    face = ("triangle", [(0, 1, 2)])
    mesh = isospline.Mesh.from_meshio(meshio.Mesh(np.eye(5, 3), [("line5", [range(5)]), face]))
    assert len(mesh.faces) == 1
    with pytest.raises(ValueError, match="mesh: expected cells of a type that VTK has, got triangle10"):
        isospline.Mesh.from_meshio(meshio.Mesh(np.zeros((10, 3)), [("triangle10", [range(10)]), face]))


# Files


@pytest.mark.parametrize("length", [1e-200, 1e-14, 3, 1e200])
def test_normals_of_gltf_have_the_length_one(tmp_path, length):
    directions = np.array([(1, 2, 3), (0, 0, -1), (-3, 0, 4), (1, 0, 0)], float)
    isospline.Mesh(TETRAHEDRON, OUTWARD, normals=length * directions).write(tmp_path / "a.glb")
    expected = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    (shape,) = trimesh.load_scene(tmp_path / "a.glb").geometry.values()
    np.testing.assert_allclose(shape.vertex_normals, expected, atol=1e-6)


@pytest.mark.parametrize("scale", [1e-9, 1, 1e9])
def test_stl_has_the_normals_of_its_faces(tmp_path, scale):
    isospline.Mesh(scale * TETRAHEDRON, OUTWARD).write(tmp_path / "a.stl")
    triangles = [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")]
    found = np.frombuffer((tmp_path / "a.stl").read_bytes(), triangles, offset=84)
    np.testing.assert_allclose(found["normal"], trimesh.Trimesh(TETRAHEDRON, OUTWARD).face_normals, atol=1e-6)


@pytest.mark.parametrize("size, said", [(50, "at least 84"), (99, "842150534 bytes of 16843009")])
def test_the_size_of_an_stl_file_is_named(tmp_path, size, said):
    (tmp_path / "a.stl").write_bytes(b"\1" * size)
    with pytest.raises(ValueError, match=rf"a\.stl: .*expected {said}.*, got {size}: the file is truncated"):
        isospline.read_mesh(tmp_path / "a.stl")


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".obj", ".off", ".glb", ".STL"])
def test_files_of_trimesh_are_read(tmp_path, suffix):
    shape = trimesh.creation.annulus(1, 2, 3)
    shape.export(tmp_path / f"a{suffix}", file_type=suffix[1:].lower())
    mesh = isospline.read_mesh(tmp_path / f"a{suffix}")
    np.testing.assert_allclose(corners(mesh), shape.triangles, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("suffix", [".vtk", ".vtp", ".vtu"])
def test_files_of_vtk_are_read(tmp_path, suffix):
    shape = pyvista.Sphere()
    (shape.cast_to_unstructured_grid() if suffix == ".vtu" else shape).save(tmp_path / f"a{suffix}")
    mesh = isospline.read_mesh(tmp_path / f"a{suffix}")
    np.testing.assert_array_equal(corners(mesh), shape.points[shape.regular_faces])


@pytest.mark.parametrize("suffix", [".msh", ".inp", ".mesh", ".avs", ".bdf"])
def test_files_of_meshio_are_read(tmp_path, suffix):
    meshio.Mesh(TETRAHEDRON, [("triangle", OUTWARD)]).write(tmp_path / f"a{suffix}")
    mesh = isospline.read_mesh(str(tmp_path / f"a{suffix}"))
    np.testing.assert_allclose(corners(mesh), TETRAHEDRON[OUTWARD], atol=1e-12)


@pytest.mark.parametrize(
    "name, text",
    [
        ("a.off", "OFF\n4 1 0\n0 0 0\n2 0 0\n2 1 0\n0 1 0\n4 0 1 2 3\n"),
        ("a.obj", "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf 1 2 3 4\n"),
        (
            "a.ply",
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
            "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
            "0 0 0\n2 0 0\n2 1 0\n0 1 0\n4 0 1 2 3\n",
        ),
        (
            "a.vtk",
            "# vtk DataFile Version 3.0\nsquare\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n"
            "0 0 0 2 0 0 2 1 0 0 1 0\nPOLYGONS 1 5\n4 0 1 2 3\n",
        ),
        (
            "a.mesh",
            "MeshVersionFormatted 2\nDimension 3\nVertices\n4\n0 0 0 0\n2 0 0 0\n2 1 0 0\n0 1 0 0\n"
            "Quadrilaterals\n1\n1 2 3 4 0\nEnd\n",
        ),
    ],
)
def test_polygons_of_files_are_cut_into_triangles(tmp_path, name, text):
    (tmp_path / name).write_text(text, encoding="utf-8")
    mesh = isospline.read_mesh(tmp_path / name)
    assert (len(mesh.faces), area(mesh)) == (2, pytest.approx(2))


@pytest.fixture
def colored(rng):
    """A ball with normals that are not those of its faces, and a colour for each vertex."""
    ball = trimesh.creation.icosphere(1)
    normals = rng.normal(size=ball.vertices.shape)
    return isospline.Mesh(ball.vertices, ball.faces, normals=normals, colors=rng.random(ball.vertices.shape))


def check_attributes(mesh, expected, color_step):
    """Compare at the corners of faces: normals in float32 at least, of any length, and colours."""
    unit = [(m.normals / np.linalg.norm(m.normals, axis=1, keepdims=True))[m.faces] for m in (mesh, expected)]
    np.testing.assert_allclose(*unit, atol=1e-6)
    np.testing.assert_allclose(mesh.colors[mesh.faces], expected.colors[expected.faces], atol=color_step)


@pytest.mark.parametrize("name", ["trimesh", "pyvista", "meshio"])
def test_normals_and_colors_survive_libraries(colored, name):
    mesh = getattr(isospline.Mesh, f"from_{name}")(getattr(colored, f"to_{name}")())
    check_attributes(mesh, colored, 1e-12 if name == "meshio" else 0.005)
    plain = isospline.Mesh(colored.vertices, colored.faces)
    mesh = getattr(isospline.Mesh, f"from_{name}")(getattr(plain, f"to_{name}")())
    assert mesh.normals is None and mesh.colors is None
    replaced = getattr(isospline.Mesh, f"from_{name}")(getattr(colored, f"to_{name}")(), colors="red")
    np.testing.assert_array_equal(replaced.colors[0], (1, 0, 0))


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".glb"])
def test_normals_and_colors_survive_files(tmp_path, colored, suffix):
    colored.write(tmp_path / f"a{suffix}")
    # The bytes of glTF are linear, with larger steps where it is dark.
    check_attributes(isospline.read_mesh(tmp_path / f"a{suffix}"), colored, 1e-6 if suffix == ".glb" else 0.005)


def test_normals_and_colors_of_vtk_files_are_read(tmp_path, colored):
    for suffix in (".vtk", ".vtp"):
        colored.to_pyvista().save(tmp_path / f"a{suffix}")
        check_attributes(isospline.read_mesh(tmp_path / f"a{suffix}"), colored, 0.005)
    pyvista.Sphere().save(tmp_path / "sphere.vtp")
    normals = np.asarray(pyvista.Sphere()["Normals"])
    np.testing.assert_array_equal(isospline.read_mesh(tmp_path / "sphere.vtp").normals, normals)


def test_colors_of_gltf_are_linear(tmp_path):
    triangle = TETRAHEDRON[:3], [(0, 1, 2)]
    isospline.Mesh(*triangle, colors=linear([(0.2, 0.5, 1.0)] * 3)).write(tmp_path / "a.glb")
    # The oracle is trimesh, which takes the bytes of a file as they are.
    stored = next(iter(trimesh.load_scene(tmp_path / "a.glb", process=False).geometry.values())).visual.vertex_colors
    assert stored[0].tolist() == [51, 128, 255, 255]
    np.testing.assert_allclose(isospline.read_mesh(tmp_path / "a.glb")._colors()[0], (0.2, 0.5, 1.0), atol=1e-6)


def test_dark_colors_of_gltf_are_kept(tmp_path):
    """In linear light, the darkest of 256 steps are far apart."""
    grey = np.linspace(0, 1, 511)
    colors = np.stack([grey, np.full(511, 0.04), np.append(grey[::2], grey[1::2]) ** 2], axis=1)
    faces = np.arange(510)[:, None] % 509 + [0, 1, 2]
    isospline.Mesh(np.arange(3 * 511).reshape(-1, 3) ** 2, faces, colors=colors).write(tmp_path / "a.glb")
    np.testing.assert_allclose(isospline.read_mesh(tmp_path / "a.glb").colors, colors, atol=1e-6)
    # The oracle is the type and the numbers in the file, by the standard's formula.
    shape = pyvista.read(tmp_path / "a.glb").combine().extract_surface(algorithm=None)
    stored = shape.point_data["COLOR_0"][:, :3]
    srgb = np.where(stored <= 0.0031308, 12.92 * stored, 1.055 * stored ** (1 / 2.4) - 0.055)
    np.testing.assert_allclose(srgb, colors, atol=1e-6)


@pytest.mark.parametrize("kind, code", [("<f4", 5126), ("u1", 5121), ("<u2", 5123)])
def test_colors_of_gltf_of_any_type_are_right(tmp_path, kind, code):
    colors = np.array([(0.2, 0.5, 1.0), (0, 0.7, 0.1), (1, 1, 1)])
    most = 1 if code == 5126 else np.iinfo(kind).max
    stored = np.pad((colors * most).astype(kind), ((0, 0), (0, 1)))
    arrays = [TETRAHEDRON[:3].astype("<f4"), stored]
    buffer = b"".join(array.tobytes() for array in arrays)
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 1}}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": code, "normalized": code != 5126, "count": 3, "type": "VEC4"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": arrays[0].nbytes},
            {"buffer": 0, "byteOffset": arrays[0].nbytes, "byteLength": stored.nbytes},
        ],
        "buffers": [{"byteLength": len(buffer), "uri": "data:;base64," + base64.b64encode(buffer).decode()}],
    }
    (tmp_path / "a.gltf").write_text(json.dumps(tree), encoding="utf-8")
    mesh = isospline.read_mesh(tmp_path / "a.gltf")
    np.testing.assert_allclose(mesh._colors()[mesh.faces[0]], colors, atol=1 / most if code != 5126 else 1e-6)


def test_parts_of_a_scene_keep_what_all_of_them_have(colored):
    mirror = np.diag([-1.0, 2, 3, 1])
    scene = trimesh.Scene()
    scene.add_geometry(colored.to_trimesh())
    scene.add_geometry(colored.to_trimesh(), transform=mirror)
    mesh = isospline.Mesh.from_trimesh(scene)
    count = len(colored.vertices)
    expected = colored.normals / np.array([-1, 2, 3])
    expected = isospline.Mesh(mesh.vertices[count:], OUTWARD, normals=expected, colors=colored.colors)
    moved = isospline.Mesh(mesh.vertices[count:], OUTWARD, normals=mesh.normals[count:], colors=mesh.colors[count:])
    check_attributes(moved, expected, 0.005)
    scene.add_geometry(trimesh.creation.box())
    mesh = isospline.Mesh.from_trimesh(scene)
    assert mesh.normals is None and mesh.colors is None


def test_attributes_that_cannot_be_used_are_left_out():
    shape = pyvista.PolyData(TETRAHEDRON, np.insert(OUTWARD, 0, 3, axis=1))
    shape.point_data.active_normals = np.full((4, 3), np.nan)
    shape.point_data["colors"] = np.full((4, 3), 7.0)
    mesh = isospline.Mesh.from_pyvista(shape)
    assert mesh.normals is None and mesh.colors is None


def test_corners_of_stl_with_equal_positions_are_one_vertex(tmp_path):
    ball = trimesh.creation.icosphere(3)
    for kind in ("stl", "stl_ascii"):
        ball.export(tmp_path / "a.stl", file_type=kind)
        mesh = isospline.read_mesh(tmp_path / "a.stl")
        assert (len(mesh.vertices), len(mesh.faces)) == (len(ball.vertices), len(ball.faces))
        np.testing.assert_allclose(corners(mesh), ball.triangles, atol=1e-6)


def test_vertices_of_files_are_not_merged_or_dropped(tmp_path):
    small = 1e-12 * TETRAHEDRON
    trimesh.Trimesh(small, OUTWARD, process=False).export(tmp_path / "a.ply")
    np.testing.assert_allclose(isospline.read_mesh(tmp_path / "a.ply").vertices, small, rtol=1e-6)
    text = "v 0 0 0\nv 1 0 0\nv nan 1 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n"
    (tmp_path / "a.obj").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=r"a\.obj: .*vertices: expected finite numbers, got nan in vertex 2"):
        isospline.read_mesh(tmp_path / "a.obj")


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".obj", ".off", ".glb", ".vtk", ".vtp", ".vtu", ".msh", ".inp"])
def test_broken_files_are_refused(tmp_path, rng, suffix, capfd):
    for content in (b"", b"hello\nworld\n", rng.bytes(3000)):
        (tmp_path / f"a{suffix}").write_bytes(content)
        with pytest.raises(ValueError, match=rf"a\{suffix}: cannot be read as a mesh: ."):
            isospline.read_mesh(tmp_path / f"a{suffix}")
    assert capfd.readouterr() == ("", "")


def test_files_without_a_mesh_are_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"missing\.stl"):
        isospline.read_mesh(tmp_path / "missing.stl")
    (tmp_path / "a.txt").write_text("hello", encoding="utf-8")
    with pytest.raises(ValueError, match=r"a\.txt: cannot be read as a mesh: expected a name that ends in \.3mf"):
        isospline.read_mesh(tmp_path / "a.txt")
    trimesh.PointCloud(TETRAHEDRON).export(tmp_path / "cloud.ply")
    with pytest.raises(ValueError, match=r"cloud\.ply: cannot be read as a mesh: expected faces, got none"):
        isospline.read_mesh(tmp_path / "cloud.ply")
    with pytest.raises((FileNotFoundError, IsADirectoryError)):
        isospline.read_mesh(tmp_path)


@pytest.mark.parametrize("name", ["from_meshio", "from_pyvista", "from_trimesh", "from_vtk"])
def test_other_objects_are_refused(name):
    for wrong in (TETRAHEDRON, trimesh.PointCloud(TETRAHEDRON), None):
        with pytest.raises(TypeError, match="mesh: expected a.*, got (ndarray of shape|trimesh.*PointCloud|None)"):
            getattr(isospline.Mesh, name)(wrong)


def test_vertices_and_faces_in_trimesh_can_be_changed():
    """Open3D's vectors refuse arrays that cannot."""
    pytest.importorskip("trimesh")
    mesh = isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    converted = mesh.to_trimesh()
    assert converted.vertices.flags.writeable and converted.faces.flags.writeable
    converted.vertices[0] = 7
    np.testing.assert_array_equal(mesh.vertices[0], 0)
