"""Polygons of OBJ, OFF and PLY files. The oracles are the shoelace formula, what was written, and VTK."""

import struct

import numpy as np
import pytest

import isospline
from isospline.interop.polygons import cut_polygons

ARROW = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (1, 0.5, 0), (0, 2, 0)]
FRAME = [(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0), (1, 1, 0), (1, 3, 0), (3, 3, 0), (3, 1, 0)]
BRIDGED = [0, 1, 2, 3, 0, 4, 5, 6, 7, 4]
MIXED = [(0, 1, 2), (0, 1, 3, 4), (2, 3, 1)]
BINARY = {"binary_little_endian": "<", "binary_big_endian": ">"}


def areas(points, faces):
    """The areas of triangles in the plane z = 0, positive if they are counter-clockwise."""
    first, second, third = np.moveaxis(np.asarray(points)[faces, :2], 1, 0)
    return np.linalg.det(np.stack([second - first, third - first], axis=1)) / 2


def shoelace(points):
    x, y = np.asarray(points)[:, :2].T
    return (x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def rows(values):
    return "".join(" ".join(map(str, row)) + "\n" for row in values)


def obj_of(polygons):
    return "".join(f"v {row}\n" for row in rows(ARROW).splitlines()) + "".join(
        f"f {' '.join(str(index + 1) for index in polygon)}\n" for polygon in polygons
    )


def off_of(polygons):
    return f"OFF\n{len(ARROW)} {len(polygons)} 0\n{rows(ARROW)}" + rows((len(each), *each) for each in polygons)


def ply_header(count, face_count, kind="ascii", vertex="", face=""):
    return (
        f"ply\nformat {kind} 1.0\nelement vertex {count}\nproperty double x\nproperty double y\nproperty double z\n"
        f"{vertex}element face {face_count}\nproperty list uchar int vertex_indices\n{face}end_header\n"
    )


def ply_of(polygons):
    return ply_header(len(ARROW), len(polygons)) + rows(ARROW) + rows((len(each), *each) for each in polygons)


def read(folder, name, content):
    (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    return isospline.read_mesh(folder / name)


FORMATS = pytest.mark.parametrize("name, written", [("a.obj", obj_of), ("a.off", off_of), ("a.ply", ply_of)])


@FORMATS
@pytest.mark.parametrize("begin", range(5))
def test_polygons_need_not_be_convex(tmp_path, name, written, begin):
    for polygon in (np.roll(range(5), begin), np.roll([0, 1, 2, 3], begin), np.roll([4, 3, 2, 1, 0], begin)):
        mesh = read(tmp_path, name, written([polygon.tolist()]))
        expected = shoelace(np.array(ARROW)[polygon])
        found = areas(mesh.vertices, mesh.faces)
        assert found.sum() == pytest.approx(expected) and (found * expected > 0).all()


@FORMATS
def test_faces_keep_the_order_of_the_file(tmp_path, name, written):
    mesh = read(tmp_path, name, written(MIXED))
    np.testing.assert_array_equal(mesh.faces, [(0, 1, 2), (0, 1, 3), (0, 3, 4), (2, 3, 1)])


@pytest.mark.parametrize("kind", BINARY)
def test_binary_ply_has_faces_of_any_sizes(tmp_path, kind):
    order, face = BINARY[kind], "property float q\nproperty list uchar float texcoord\n"
    content = ply_header(len(ARROW), len(MIXED), kind, "property uchar flag\n", face).encode()
    content += b"".join(struct.pack(f"{order}3dB", *point, 7) for point in ARROW)
    for size, polygon in enumerate(MIXED):
        content += struct.pack(f"{order}B{len(polygon)}ifB{size}f", len(polygon), *polygon, 0.5, size, *range(size))
    mesh = read(tmp_path, "a.ply", content)
    np.testing.assert_array_equal(mesh.vertices, ARROW)
    np.testing.assert_array_equal(mesh.faces, [(0, 1, 2), (0, 1, 3), (0, 3, 4), (2, 3, 1)])
    assert (mesh.values_name, mesh.values.tolist()) == ("flag", [7] * 5)
    for wrong in (content[:-1], content + b"1"):
        with pytest.raises(ValueError, match=r"a\.ply: .*expected (3 elements face, got 2|\d+ bytes)"):
            read(tmp_path, "a.ply", wrong)


def test_ascii_ply_has_lists_of_textures_and_colors_of_any_type(tmp_path):
    for kind, white in (("uchar", 255), ("ushort", 65535), ("float", 1)):
        vertex = "".join(f"property {kind} {name}\n" for name in ("red", "green", "blue"))
        points = rows((*point, white, 0, white) for point in ARROW)
        face = "property list uchar float texcoord\n"
        text = ply_header(5, 1, vertex=vertex, face=face) + points + "3 0 1 2 6 0 0 1 0 1 1\n"
        mesh = read(tmp_path, "a.ply", text)
        np.testing.assert_array_equal(mesh.colors, [(1, 0, 1)] * 5)
    for wrong, said in (
        (text + "3 0 1 2 0\n", "expected no more lines than elements, got '3 0 1 2 0'"),
        (text.replace("3 0 1 2 6", "3 0 1 2.5 6"), "expected whole numbers of 32 bits for vertex_indices, got 2.5"),
        (text.replace("3 0 1 2 6", "3 0 1 b 6"), "expected numbers of elements face, got '3 0 1 b"),
        (text.replace("3 0 1 2 6", "3 0 1 2 5"), "expected 10 numbers in a line of elements face, got 11"),
        (text.replace("3 0 1 2 6", "3 0 1 5 6"), "expected vertex indices from 0 to 5 - 1, got 5"),
        (text.replace("double x", "half x"), "expected a property with known types and a name, got property half x"),
        (text.replace("double x", "double w"), "expected elements vertex with the properties x, y and z"),
        (text.replace("ascii", "text"), "expected a header with ply and a format of ascii, binary_little_endian"),
    ):
        with pytest.raises(ValueError, match=rf"a\.ply: .*{said}"):
            read(tmp_path, "a.ply", wrong)


STRIPS = [[0, 1, 2, 3, 4, 5], [6, 7, 8], [8, 7, 6, 1], [2, 3], [4, 2, 3, 1, 0, 7]]


@pytest.mark.parametrize("kind", ["ascii", *BINARY])
@pytest.mark.parametrize("form", ["one list", "lists", "both"])
def test_ply_has_strips_of_triangles(rng, tmp_path, kind, form):
    util = pytest.importorskip("trimesh.util")
    points = rng.normal(size=(9, 3)).astype(np.float32).astype(float)
    lists = {
        "one list": [[index for strip in STRIPS for index in (*strip, -1)][:-1]],
        "lists": STRIPS,
        "both": [STRIPS[0], [], [index for strip in STRIPS[1:] for index in (*strip, -1)]],
    }[form]
    header = ply_header(9, 1, kind).replace(
        "end_header", f"element tristrips {len(lists)}\nproperty list int int vertex_indices\nend_header"
    )
    if kind == "ascii":
        content = rows(points) + "3 8 0 4\n" + rows((len(each), *each) for each in lists)
        content = (header + content).encode()
    else:
        order = BINARY[kind]
        content = header.encode() + points.astype(f"{order}f8").tobytes() + struct.pack(f"{order}B3i", 3, 8, 0, 4)
        content += b"".join(struct.pack(f"{order}{1 + len(each)}i", len(each), *each) for each in lists)
    faces = read(tmp_path, "a.ply", content).faces
    expected = [(8, 0, 4), *util.triangle_strips_to_faces([strip for strip in STRIPS if len(strip) > 2])]
    # The first corner of a triangle does not matter; the orientation does.
    turned = [[np.roll(face, -np.argmin(face)).tolist() for face in each] for each in (faces, expected)]
    assert turned[0] == turned[1]


def test_strips_of_ply_leave_out_triangles_that_join_them(tmp_path):
    header = ply_header(5, 0).replace("end_header", "element tristrips 1\nproperty list int int vertices\nend_header")
    mesh = read(tmp_path, "a.ply", header + rows(ARROW) + "8 0 1 2 2 3 3 4 1\n")
    np.testing.assert_array_equal(mesh.faces, [(0, 1, 2), (4, 3, 1)])
    for wrong in ("3 0 1 5\n", "3 0 -2 1\n"):
        with pytest.raises(ValueError, match=r"a\.ply: .*expected vertex indices from 0 to 5 - 1, got"):
            read(tmp_path, "a.ply", header + rows(ARROW) + wrong)


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
def test_ply_has_names_of_any_letters(tmp_path, encoding):
    for name in ("été", "à", "Å"):  # bytes of the last two in UTF-8 are blanks or controls in Latin-1
        text = ply_header(5, 1, vertex=f"property float {name}\n") + rows((*point, 7) for point in ARROW) + "3 0 1 2\n"
        assert read(tmp_path, "a.ply", text.encode(encoding)).values_name == name


@pytest.mark.parametrize("red, blue", [("255 0 0 255", "0 0 255"), ("1.0 0 0", "0 0 1 1"), ("1 0 0", "0 0 1")])
def test_colors_and_normals_of_off_are_read(tmp_path, red, blue):
    faces = "3 0 1 2 0 255 0\n2 0 1\n"
    points = (f"0 0 0 {red}", f"1 0 0 {blue}  # a comment", f"1 1 0 {red}")
    mesh = read(tmp_path, "a.off", "COFF # colours\n\n3 2 0\n" + "\n".join(points) + "\n" + faces)
    np.testing.assert_array_equal(mesh.colors, [(1, 0, 0), (0, 0, 1), (1, 0, 0)])
    assert mesh.normals is None and len(mesh.faces) == 1
    text = "STCNOFF 3 2 0\n" + "\n".join(point[:5] + " 0 0 1 " + point[6:] for point in points) + "\n" + faces
    mesh = read(tmp_path, "a.off", text)
    np.testing.assert_array_equal(mesh.colors, [(1, 0, 0), (0, 0, 1), (1, 0, 0)])
    np.testing.assert_array_equal(mesh.normals, [(0, 0, 1)] * 3)


@pytest.mark.parametrize(
    "text, said",
    [
        ("4OFF\n1 0 0\n0 0 0 1\n", "expected a text file that begins with OFF, COFF"),
        ("OFF BINARY\n", "expected a text file that begins with OFF, COFF"),
        ("OFF\n3 -1 0\n", "expected numbers of vertices and faces, got 3 and -1"),
        ("COFF\n1 0 0\n0 0 0\n", "expected at least 6 numbers of a vertex, got '0 0 0'"),
        ("OFF\n1 1 0\n0 0 0\n3 0 0\n", "expected at least 3 numbers of a face, got '0 0'"),
        ("OFF\n1 1 0\n0 0 0\n3 0 0 1\n", "expected vertex indices from 0 to 1 - 1, got 1"),
        ("OFF\n2 1 0\n0 0 0\n3 0 0 1\n", "expected 2 vertices and 1 faces, got 2 lines: the file is truncated"),
    ],
)
def test_other_off_files_are_refused(tmp_path, text, said):
    with pytest.raises(ValueError, match=rf"a\.off: .*{said}"):
        read(tmp_path, "a.off", text)


def stars(rng, count):
    """Polygons around the origin, with spikes."""
    for _ in range(count):
        angles = np.sort(rng.permutation(40)[: rng.integers(4, 30)]) * np.pi / 20
        if np.diff(angles, append=angles[0] + 2 * np.pi).max() < np.pi:
            yield (0.1 + rng.random(len(angles))[:, None]) * np.c_[np.cos(angles), np.sin(angles), 0 * angles]


def test_triangles_of_a_polygon_cover_it_once(rng):
    for points in stars(rng, 200):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        for size in (1e-200, 1, 1e100):
            faces = cut_polygons(size * points @ turn, [len(points)], range(len(points)))
            found = areas(points, faces)
            assert len(faces) == len(points) - 2 and (found > -1e-15).all()
            assert found.sum() == pytest.approx(shoelace(points), rel=1e-12)


@pytest.mark.parametrize("begin", range(10))
def test_polygons_may_have_a_bridge_to_a_hole(begin):
    found = areas(FRAME, cut_polygons(np.array(FRAME), [10], np.roll(BRIDGED, begin)))
    assert found.sum() == 12 and (found > 0).all()


def test_polygons_of_vtk_may_have_a_bridge_to_a_hole():
    pyvista = pytest.importorskip("pyvista")
    points = np.array(FRAME + ARROW)
    mesh = isospline.Mesh.from_pyvista(pyvista.PolyData(points, faces=[10, *BRIDGED, 5, *range(8, 13)]))
    found = areas(points, mesh.faces)
    assert (len(found), found[:8].sum(), found[8:].sum()) == (11, 12, 2.5) and (found > 0).all()


def test_polygons_without_an_inside_have_triangles_without_area():
    line = np.c_[np.arange(6), np.zeros((6, 2))]
    for polygon in ([0, 1, 2, 3], [0, 2, 1, 4, 3, 5]):
        faces = cut_polygons(line, [len(polygon)], polygon)
        assert len(faces) == len(polygon) - 2 and not areas(line, faces).any()
    for wrong in (np.nan, np.inf, 1.5e308):
        points = np.array(ARROW, float)
        points[1], points[3] = wrong, -wrong
        assert cut_polygons(points, [5], range(5)).shape == (3, 3)
    assert cut_polygons(line, [1, 2, 3, 0], [0, 0, 1, 0, 1, 2]).tolist() == [[0, 1, 2]]


def test_repeated_corners_of_polygons_are_dropped():
    sizes, corners = [4, 4, 0, 4, 5, 3], [0, 1, 1, 2, 0, 0, 1, 1, 0, 1, 2, 0, 3, 3, 3, 3, 3, 0, 0, 1]
    found = cut_polygons(np.array(ARROW, float), sizes, corners)
    assert [set(face) for face in found.tolist()] == [{0, 1, 2}, {0, 1, 2}, {0, 1}]  # triangles are not changed


def test_grids_with_blanked_cells_have_the_surface_of_the_others():
    pyvista = pytest.importorskip("pyvista")
    grid = pyvista.StructuredGrid(*np.mgrid[0:4, 0:4, 0:2].astype(float))
    grid.hide_cells([0, 4], inplace=True)
    mesh = isospline.Mesh.from_pyvista(grid)
    assert (np.diff(np.sort(mesh.faces, axis=1), axis=1) > 0).all()
    # 7 cells, with 12 outer sides, of which 2 are gone, and 2 + 4 around the holes.
    assert len(mesh.faces) == 2 * (2 * 7 + 10 + 6)


def test_hidden_and_doubled_cells_of_surfaces_are_left_out():
    pyvista = pytest.importorskip("pyvista")
    hidden, doubled = 32, 1  # of VTK
    plane = pyvista.Plane(i_resolution=2, j_resolution=2).triangulate()
    assert len(isospline.Mesh.from_pyvista(plane).faces) == 8
    ghosts = np.zeros(8, np.uint8)
    ghosts[[0, 3, 5]] = hidden, doubled, hidden
    plane.cell_data["vtkGhostType"] = ghosts
    faces = isospline.Mesh.from_pyvista(plane).faces
    np.testing.assert_array_equal(faces, plane.faces.reshape(-1, 4)[ghosts == 0, 1:])
    strips = pyvista.PolyData(np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (0, 2, 0)], float), lines=[2, 0, 1])
    strips.strips = np.array([4, 0, 1, 2, 3, 3, 2, 3, 4])
    assert len(isospline.Mesh.from_pyvista(strips).faces) == 3
    strips.cell_data["vtkGhostType"] = np.array([0, hidden, 0], np.uint8)  # of the line and of both strips
    assert isospline.Mesh.from_pyvista(strips).faces.tolist() == [[2, 3, 4]]
    short = pyvista.convert_array(np.array([hidden], np.uint8), "vtkGhostType")
    strips.GetCellData().AddArray(short)
    with pytest.raises(ValueError, match="mesh: expected 3 values of vtkGhostType, one for each cell, got 1"):
        isospline.Mesh.from_vtk(strips)
