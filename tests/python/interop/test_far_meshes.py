"""Files of meshes far from the origin, and of tiny ones. The oracles are trimesh's readers and NumPy in float64."""

import warnings

import numpy as np
import pytest

import isospline

trimesh = pytest.importorskip("trimesh")

UTM = np.array([5e5, 4.5e6, 300.0])


@pytest.fixture(scope="module")
def ball():
    line = np.linspace(-1.3, 1.3, 16)
    z, y, x = np.meshgrid(line, line, line, indexing="ij")
    volume = isospline.Volume(1 - np.sqrt(x * x + y * y + z * z), spacing=line[1] - line[0], origin=(-1.3,) * 3)
    return isospline.Isosurface(volume, 0.0).to_mesh()


def moved(mesh, scale, place):
    return isospline.Mesh(scale * mesh.vertices + place, mesh.faces, normals=mesh.normals)


def written(mesh, path):
    """The corners of the faces that trimesh reads, and the warnings of writing."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        mesh.write(path)
    read = trimesh.load(path, force="mesh", process=False)
    return np.asarray(read.vertices, float)[read.faces], [str(each.message) for each in told]


def check(corners, mesh, tolerance):
    """Compare corners with those of a mesh, and find no face that has collapsed."""
    np.testing.assert_allclose(corners, mesh.vertices[mesh.faces], rtol=0, atol=tolerance)
    assert not np.any(np.all(corners == np.roll(corners, 1, axis=1), axis=2))


@pytest.mark.parametrize("scale", [100.0, 1.0, 0.01])
@pytest.mark.parametrize("suffix", [".glb", ".ply", ".obj"])
def test_formats_with_a_place_keep_it(tmp_path, ball, suffix, scale):
    mesh = moved(ball, scale, UTM)
    path = tmp_path / f"a{suffix}"
    corners, told = written(mesh, path)
    # float64 has steps of 1e-9 at these coordinates.
    check(corners, mesh, (1e-4 if suffix == ".glb" else 0) * scale + 1e-9)
    assert told == []
    read = isospline.read_mesh(path)
    check(read.vertices[read.faces], mesh, (1e-4 if suffix == ".glb" else 0) * scale + 1e-9)
    normals = read.normals / np.linalg.norm(read.normals, axis=1, keepdims=True) if suffix != ".ply" else read.normals
    np.testing.assert_allclose(normals[read.faces], ball.normals[ball.faces], atol=1e-6)


@pytest.mark.parametrize("scale", [100.0, 1.0, 0.01])
@pytest.mark.parametrize("place", [UTM, -UTM, (1e9, 0.1, -1e9 / 3)])
def test_stl_is_relative_to_an_offset_that_is_named(tmp_path, ball, scale, place):
    mesh = moved(ball, scale, place)
    path = tmp_path / "a.stl"
    corners, (warning,) = written(mesh, path)
    header = path.read_bytes()[:80].decode().split()
    offset = np.array([float(number) for number in header[1:]])
    assert header[0] == "offset" and f"a.stl: the vertices are written relative to ({', '.join(header[1:])})" in warning
    step = np.spacing(np.abs(place).max())
    check(corners + offset, mesh, 1e-3 * scale + 2 * step)
    read = isospline.read_mesh(path)
    np.testing.assert_array_equal(read.vertices[read.faces], corners + offset)


def test_meshes_of_the_same_place_have_the_same_offset(tmp_path, ball):
    for name, move in (("a", 0), ("b", (17.2, -31.4, 12))):
        written(moved(ball, 1, UTM + move), tmp_path / f"{name}.stl")
    assert (tmp_path / "a.stl").read_bytes()[:80] == (tmp_path / "b.stl").read_bytes()[:80]


@pytest.mark.parametrize("place", [(0, 0, 0), (30, -20, 100)])
def test_near_the_origin_files_have_the_rounded_vertices(tmp_path, ball, place):
    mesh = moved(ball, 1, place)
    for suffix in (".stl", ".glb"):
        corners, told = written(mesh, tmp_path / f"a{suffix}")
        np.testing.assert_array_equal(corners, mesh.vertices[mesh.faces].astype(np.float32))
        assert told == []
    assert (tmp_path / "a.stl").read_bytes()[:80] == bytes(80)


@pytest.mark.parametrize("suffix", [".stl", ".glb"])
def test_what_no_offset_can_keep_is_told(tmp_path, ball, suffix):
    far = ball.vertices + (3e9, 0, 0)
    both = isospline.Mesh(
        np.concatenate([ball.vertices, far]), np.concatenate([ball.faces, ball.faces + len(ball.vertices)])
    )
    corners, told = written(both, tmp_path / f"a{suffix}")
    assert np.ptp(corners[len(ball.faces) :, :, 0]) == 0  # flat, as float32 has steps of 256 there
    assert (
        f"a{suffix}: rounding to single precision moves corners of {len(ball.faces)} of {len(both.faces)} faces"
        in told[-1]
    )


@pytest.mark.parametrize("suffix", [".stl", ".glb"])
def test_coordinates_beyond_single_precision_are_refused(tmp_path, ball, suffix):
    with pytest.raises(ValueError, match=rf"a\{suffix}: expected coordinates up to 3\.4e\+38 .*, got 1e\+39: \.ply"):
        moved(ball, 1e39 / np.abs(ball.vertices).max(), 0).write(tmp_path / f"a{suffix}")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", [".stl", ".glb"])
@pytest.mark.filterwarnings("error")
def test_coordinates_whose_squares_overflow_are_refused(tmp_path, ball, suffix):
    with pytest.raises(ValueError, match=rf"a\{suffix}: expected coordinates up to 3\.4e\+38 .*, got 1e\+300: \.ply"):
        moved(ball, 1e300 / np.abs(ball.vertices).max(), 0).write(tmp_path / f"a{suffix}")


@pytest.mark.parametrize("scale", [1e-9, 1e-15, 1e-24])
def test_obj_has_digits_for_tiny_meshes(tmp_path, ball, scale):
    mesh = moved(ball, scale, 0)
    check(written(mesh, tmp_path / "a.obj")[0], mesh, 1e-14 * scale)


@pytest.mark.parametrize("header", [b"offset 1 2", b"offset 1 2 x", b"offset inf 0 0", b"offset", b"offsets 1 2 3"])
def test_other_headers_of_stl_are_no_offset(tmp_path, ball, header):
    content = trimesh.Trimesh(ball.vertices, ball.faces, process=False).export(file_type="stl")
    (tmp_path / "a.stl").write_bytes(header.ljust(80, b" ") + content[80:])
    np.testing.assert_allclose(isospline.read_mesh(tmp_path / "a.stl").bounds, ball.bounds, atol=1e-6)
