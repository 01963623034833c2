"""OBJ files. The oracle is VTK's reader and positive indices."""

import numpy as np
import pytest

import isospline

pyvista = pytest.importorskip("pyvista")

RELATIVE = """v 0 0 0
v 1 0 0
v 1 1 0
f -3 -2 -1
v 5 5 5
v 6 5 5
v 5 6 5
f -3 -2 -1
"""


def corners_of(folder, text, **options):
    (folder / "a.obj").write_text(text, encoding="utf-8", newline="")
    mesh = isospline.read_mesh(folder / "a.obj", **options)
    return mesh.vertices[mesh.faces]


@pytest.mark.parametrize("is_confined", [False, True])
def test_negative_indices_count_back_from_their_face(tmp_path, is_confined):
    found = corners_of(tmp_path, RELATIVE, within=tmp_path if is_confined else None)
    expected = pyvista.read(tmp_path / "a.obj")
    np.testing.assert_array_equal(found, expected.points[expected.regular_faces])
    np.testing.assert_array_equal(found[1], [(5, 5, 5), (6, 5, 5), (5, 6, 5)])


@pytest.mark.parametrize(
    "first, second",
    [
        ("f -3/-3/-1 -2/-2/-1 -1/-1/-1", "f -3/-3/-1 -2/-2/-1 -1/-1/-1"),
        ("f -3//-1 -2//-1 -1//-1", "f 4//2 -2//-1 6//-1"),
        ("f -3/-3 -2/-2 -1/-1", "f -3/4 -2/-2\\\n -1/-1"),
        ("f\t-3 -2 -1\r", "f -3 \\\r\n-2 -1\r"),
        ("f 1 2 3", "f -3 -2 -1 -4"),
    ],
)
def test_negative_indices_of_any_kind_mean_the_positive_ones(tmp_path, first, second):
    texture, normals = "vt 0 0\nvt 1 0\nvt 1 1\n", ("vn 0 0 1\n", "vn 1 0 0\n")
    triangles = RELATIVE.split("f -3 -2 -1\n")
    begin, end = (points + texture + normal for points, normal in zip(triangles, normals))
    found = corners_of(tmp_path, f"{begin}{first}\n{end}{second}\n")
    absolute = "f 4 5 6 3" if second.endswith("-4") else "f 4/4/2 5/5/2 6/6/2"
    np.testing.assert_array_equal(found, corners_of(tmp_path, f"{begin}f 1/1/1 2/2/1 3/3/1\n{end}{absolute}\n"))


def test_normals_of_negative_indices_are_those_before_the_face(tmp_path):
    text = RELATIVE.replace("f -3 -2 -1", "f -3//-1 -2//-1 -1//-1").replace("v 0 0 0", "vn 0 0 1\nv 0 0 0")
    (tmp_path / "a.obj").write_text(text.replace("v 5 5 5", "vn 1 0 0\nv 5 5 5"), encoding="utf-8")
    mesh = isospline.read_mesh(tmp_path / "a.obj")
    np.testing.assert_array_equal(mesh.normals[mesh.faces], [[(0, 0, 1)] * 3, [(1, 0, 0)] * 3])


def test_negative_indices_before_the_first_are_refused(tmp_path):
    with pytest.raises(ValueError, match=r"a\.obj: .*expected an index of one of the 3 v before the face, got -4"):
        corners_of(tmp_path, RELATIVE.replace("f -3", "f -4", 1))


@pytest.mark.parametrize(
    "vertex, face",
    [
        ("v 1 0 0", "f 1 3 4 # a comment"),
        ("  v 1 0 0", "\tf 1 3 4"),
        ("v\t1 0\t0", "f\t1 3  4 "),
        ("v 1 \\\n0 0", "f 1 3\\\r\n4"),
        ("v 1 0 0 1", "fo 1 3 4"),
        ("v 1 0 0\nusemtl b", "usemtl a\nf 1 3 4\nusemtl b"),
    ],
)
def test_lines_have_words_between_any_blanks(tmp_path, vertex, face):
    text = f"\ufeffmtllib m.mtl\nv 0 0 0\n{vertex}\nv 1 1 0\nv 0 1 0\nf 1 2 3\n{face}\nf 4 3 2\n"
    found = corners_of(tmp_path, text)
    points = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    np.testing.assert_array_equal(found, points[[(0, 1, 2), (0, 2, 3), (3, 2, 1)]])


@pytest.mark.parametrize(
    "line, said",
    [
        ("f 0 1 2", "expected indices of v that are not 0"),
        ("f 1 2 4", "expected an index of one of the 3 v, got 4"),
        ("f 1//1 2//1 3//2", "expected an index of one of the 1 vn, got 2"),
        ("f 1 2 x", "expected numbers of a face, got '1 2 x'"),
        ("v 1 2", "expected at least 3 numbers of a vertex, got '1 2'"),
    ],
)
def test_wrong_lines_are_refused(tmp_path, line, said):
    with pytest.raises(ValueError, match=rf"a\.obj: .*{said}"):
        corners_of(tmp_path, f"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\n{line}\nf 1 2 3\n")


def test_colors_of_vertices_are_read_beside_materials(tmp_path):
    points = "v 0 0 0 {0} 0 0\nv 1 0 0 0 {0} 0\nv 1 1 0 0 0 {0}\n"
    for most in (1, 255):
        (tmp_path / "a.obj").write_text(points.format(most) + "usemtl a\nf 1/ 2/ 3/\n", encoding="utf-8")
        np.testing.assert_array_equal(isospline.read_mesh(tmp_path / "a.obj").colors, np.eye(3))


def test_colors_are_written_with_all_digits(tmp_path, rng):
    colors = rng.random((3, 3)) * [(1,), (1e-3,), (1,)]
    isospline.Mesh(np.eye(3), [(0, 1, 2)], colors=colors).write(tmp_path / "a.obj")
    lines = (tmp_path / "a.obj").read_text(encoding="utf-8").splitlines()
    found = [line.split()[4:] for line in lines if line.startswith("v ")]
    np.testing.assert_allclose(np.array(found, float), colors, atol=1e-11)
    np.testing.assert_allclose(isospline.read_mesh(tmp_path / "a.obj").colors, colors, atol=1e-11)


@pytest.mark.parametrize("suffix", [".obj", ".ply"])
def test_vertices_and_normals_are_read_bit_for_bit(tmp_path, rng, suffix):
    vertices = rng.normal(size=(300, 3)) * 10.0 ** rng.integers(-300, 20, (300, 3))
    vertices[:2] = [(1e-310, -0.0, 1 / 3), (1e22, 5e-324, -123456789.123456789)]
    normals = rng.normal(size=(300, 3)) * [1, 1e-9, 1]
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    faces = np.arange(300).reshape(-1, 3)
    isospline.Mesh(vertices, faces, normals=normals, colors=rng.random((300, 3))).write(tmp_path / f"a{suffix}")
    mesh = isospline.read_mesh(tmp_path / f"a{suffix}")
    assert mesh.vertices[mesh.faces].tobytes() == vertices[faces].tobytes()
    assert mesh.normals[mesh.faces].tobytes() == normals[faces].tobytes()
