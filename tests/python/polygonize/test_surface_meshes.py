"""Meshes of isosurfaces: trimesh checks whether they are closed; closed forms and `closest_points` check positions."""

import itertools

import numpy as np
import pytest
import scipy.sparse

import isospline
from isospline import volumes

meshio = pytest.importorskip("meshio")
pyvista = pytest.importorskip("pyvista")
trimesh = pytest.importorskip("trimesh")

TURN = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
GRIDS = {
    "plain": {},
    "spacing": dict(spacing=(0.5, 2.0, 1.25), origin=(10, -20, 30)),
    "oblique": dict(spacing=(0.5, 2.0, 1.25), origin=(10, -20, 30), direction=TURN * np.sign(np.linalg.det(TURN))),
    "mirrored": dict(spacing=(0.5, 2.0, 1.25), direction=np.diag([1.0, -1.0, 1.0])),
}


def check_closed(mesh):
    """Each edge has two faces, in opposite directions; each vertex has one fan of faces; faces point outwards."""
    shape = mesh.to_trimesh()
    assert shape.is_watertight
    assert shape.is_winding_consistent
    assert shape.volume > 0
    _, counts = np.unique(np.sort(shape.edges, axis=1), axis=0, return_counts=True)
    assert (counts == 2).all()
    # The faces of a vertex are connected: there are as many fans as vertices.
    corners = mesh.faces.astype(np.int64)
    first = np.arange(corners.size).reshape(corners.shape)
    edges = {}
    for a, b in ((0, 1), (1, 2), (2, 0)):
        low, high = corners[:, a] < corners[:, b], corners[:, a] >= corners[:, b]
        key = np.where(low, corners[:, a] << 32 | corners[:, b], corners[:, b] << 32 | corners[:, a])
        edges.setdefault("key", []).append(key)
        edges.setdefault("lower", []).append(np.where(low, first[:, a], first[:, b]))
        edges.setdefault("upper", []).append(np.where(high, first[:, a], first[:, b]))
    order = np.argsort(np.concatenate(edges["key"]), kind="stable")
    pairs = [np.concatenate(edges[name])[order].reshape(-1, 2) for name in ("lower", "upper")]
    links = np.concatenate(pairs)
    graph = scipy.sparse.coo_matrix((np.ones(len(links)), links.T), shape=(corners.size, corners.size))
    assert scipy.sparse.csgraph.connected_components(graph, directed=False)[0] == len(mesh.vertices)
    return shape


def closed_noise(rng, degree, grid, shape=(9, 10, 11)):
    data = np.pad(rng.normal(size=shape), 4, constant_values=-2.0)
    return isospline.Volume(data, degree=degree, **grid)


@pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_noise_has_a_closed_mesh_on_the_surface(rng, degree, grid):
    volume = closed_noise(rng, degree, grid)
    surface = isospline.Isosurface(volume, 0.2)
    mesh = surface.to_mesh()
    check_closed(mesh)
    edge = min(volume.spacing)
    assert surface.closest_points(mesh.vertices[::7])["distances"].max() < 1e-9 * edge

    def along_gradient(points):
        gradient = volume.sample(points, derivative=1)
        return np.einsum("ij,ij->i", mesh.normals, -gradient) / np.linalg.norm(gradient, axis=1)

    if degree > 1:
        assert along_gradient(mesh.vertices).min() > 1 - 1e-9
    else:  # the gradient jumps between the cells at a vertex; the gradient of any of them is right
        offsets = 1e-8 * np.array(list(itertools.product((-1, 1), repeat=3))) @ volume.affine[:3, :3].T
        assert np.max([along_gradient(mesh.vertices + offset) for offset in offsets], axis=0).min() > 1 - 1e-9


@pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_caps_close_the_mesh_and_share_the_seam(rng, degree, grid):
    volume = closed_noise(rng, degree, grid)
    middle = np.mean(volume.bounds, axis=0)
    plane = isospline.HalfSpace(middle, (0.3, -1, 0.5))
    for level in (0.2, -1.0):
        for clip in ([plane], [plane, isospline.HalfSpace(middle, (0, 0, 1))]):
            surface = isospline.Isosurface(volume, level, clip=clip, capped=True)
            mesh = surface.to_mesh()
            check_closed(mesh)
            heights = (mesh.vertices - middle) @ plane.normal / np.linalg.norm(plane.normal)
            size = max(volume.spacing)
            assert heights.min() > -1e-8 * size
            on_surface = np.abs(volume.sample(mesh.vertices) - level) < 1e-9
            on_plane = np.abs(heights) < 1e-8 * size
            assert (on_surface & on_plane).sum() > 10
            if len(clip) == 1:
                assert (on_surface | on_plane).all()


def test_open_clips_leave_a_border_on_the_plane(rng):
    volume = closed_noise(rng, 2, {})
    clip = isospline.HalfSpace((9, 9, 9), (1, 2, 3))
    mesh = isospline.Isosurface(volume, 0.2, clip=clip).to_mesh()
    shape = mesh.to_trimesh()
    assert shape.is_winding_consistent
    border = trimesh.grouping.group_rows(shape.edges_sorted, require_count=1)
    ends = mesh.vertices[np.unique(shape.edges[border])]
    assert len(ends) > 10
    assert np.abs((ends - 9) @ clip.normal).max() < 1e-8


def test_inside_below_turns_the_mesh_around():
    field = volumes.sphere(0.7)
    volume = field.volume(24)
    above, below = (isospline.Isosurface(volume, field.level, inside=side).to_mesh() for side in ("above", "below"))
    assert above.to_trimesh().volume == pytest.approx(-below.to_trimesh().volume)
    order, other = (np.lexsort(mesh.vertices.T) for mesh in (above, below))
    np.testing.assert_array_equal(above.vertices[order], below.vertices[other])
    np.testing.assert_array_equal(above.normals[order], -below.normals[other])


def test_masks_leave_a_hole():
    field = volumes.sphere(0.7)
    data = field.values(24)
    mask = np.ones(data.shape, bool)
    mask[:, :, :8] = False
    mesh = isospline.Isosurface(isospline.Volume(data, **field.grid(24)), field.level, mask=mask).to_mesh()
    shape = mesh.to_trimesh()
    assert shape.is_winding_consistent and not shape.is_watertight
    _, counts = np.unique(np.sort(shape.edges, axis=1), axis=0, return_counts=True)
    assert counts.max() == 2


def test_the_mesh_of_a_ball_converges():
    errors = []
    for count in (16, 32, 64):
        field = volumes.sphere(0.7)
        volume = field.volume(count, degree=3)
        mesh = isospline.Isosurface(volume, field.level).to_mesh()
        shape = mesh.to_trimesh()
        errors.append([abs(shape.volume / (4 / 3 * np.pi * 0.7**3) - 1), abs(shape.area / (4 * np.pi * 0.49) - 1)])
    ratios = np.array(errors)[:-1] / np.array(errors)[1:]
    assert ratios.min() > 3.2  # of second order


def test_levels_of_whole_samples_leave_no_short_edges():
    data = np.zeros((20, 20, 20))
    data[5:15, 5:15, 5:15] = 2
    data[9:11, 9:11, 4] = 1  # at the level
    mesh = isospline.Isosurface(isospline.Volume(data, degree=1), 1.0).to_mesh()
    shape = check_closed(mesh)
    assert shape.edges_unique_length.min() > 1e-4


@pytest.mark.sweep(2)
@pytest.mark.slow
@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("name", ["sphere", "torus"])
def test_tolerance_bounds_both_distances(rng, name, degree):
    field = getattr(volumes, name)()
    volume = field.volume(28, degree=degree)
    surface = isospline.Isosurface(volume, field.level)
    edge = min(volume.spacing)
    plain = surface.to_mesh()
    assert surface.closest_points(plain.vertices)["distances"].max() < 1e-9 * edge
    faces = len(plain.faces)
    for tolerance in (0.5 * edge, 0.1 * edge):
        mesh, distance = surface.to_mesh(tolerance, return_distance=True)
        shape = mesh.to_trimesh()
        assert shape.is_watertight and shape.is_winding_consistent
        assert len(mesh.faces) < faces
        assert distance <= tolerance
        points, _ = trimesh.sample.sample_surface(shape, 2000, seed=1)
        assert surface.closest_points(points)["distances"].max() <= tolerance
        exact = surface.closest_points(rng.uniform(*volume.bounds, (2000, 3)))["points"]
        assert np.abs(trimesh.proximity.closest_point(shape, exact)[1]).max() <= tolerance
        assert surface.closest_points(mesh.vertices)["distances"].max() <= tolerance


def test_a_large_tolerance_keeps_the_topology():
    field = volumes.torus()
    volume = field.volume(32)
    mesh = isospline.Isosurface(volume, field.level).to_mesh(tolerance=10)
    shape = mesh.to_trimesh()
    assert shape.is_watertight and shape.is_winding_consistent
    assert shape.euler_number == 0


def test_specks_between_samples_have_a_mesh_where_a_tolerance_is_given():
    data = np.zeros((9, 9, 9))
    data[4, 4, 4] = 1
    surface = isospline.Isosurface(isospline.Volume(data, filter="none"), 0.3)
    assert len(surface.to_mesh().faces) == 0
    mesh = surface.to_mesh(0.05)
    check_closed(mesh)
    np.testing.assert_allclose(mesh.bounds.mean(axis=0), 4, atol=0.05)


@pytest.mark.slow
def test_meshes_are_the_same_for_any_number_of_threads(rng):
    volume = closed_noise(rng, 2, {}, shape=(12, 12, 12))
    surface = isospline.Isosurface(volume, 0.2, clip=isospline.HalfSpace((9, 9, 9), (1, 2, 3)), capped=True)
    meshes = []
    try:
        for count in (1, 3):
            isospline.set_thread_count(count)
            meshes.append((surface.to_mesh(), surface.to_mesh(1.0)))
    finally:
        isospline.set_thread_count(0)
    for several in zip(*meshes):
        for other in several[1:]:
            np.testing.assert_array_equal(several[0].vertices, other.vertices)
            np.testing.assert_array_equal(several[0].faces, other.faces)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "level", "options"),
    [
        ("fuel.nii.gz", 40, {}),
        ("headsq.mha", 500, {}),
        ("ironprot.vtk", 128, {}),
        ("tooth_103x94x161_uint16.raw", 600, {"shape": (161, 94, 103), "dtype": "<u2"}),
        pytest.param("engine.nii.gz", 80, {}, marks=pytest.mark.long),
        pytest.param("mouse_skull.nrrd", 40, {}, marks=pytest.mark.long),
        pytest.param("bonsai.nii.gz", 40, {}, marks=pytest.mark.long),
    ],
)
def test_real_volumes_have_closed_meshes(volumes_folder, name, level, options):
    data = isospline.read_volume(volumes_folder / name, **options)
    volume = data.to_volume()
    # Closed where the volume ends.
    surface = isospline.Isosurface(volume, level, clip=isospline.Box(*volume.bounds), capped=True)
    mesh = surface.to_mesh()
    check_closed(mesh)
    # Readers of formats without shared vertices merge them by their coordinates.
    merged = trimesh.Trimesh(mesh.vertices, mesh.faces, process=True)
    assert merged.is_watertight
    sample = mesh.vertices[:: max(len(mesh.vertices) // 1000, 1)]
    on_cap = np.isclose(np.abs(sample - np.mean(volume.bounds, axis=0)), np.ptp(volume.bounds, axis=0) / 2).any(axis=1)
    assert np.abs(volume.sample(sample[~on_cap]) - level).max() < 1e-9 * np.ptp(data.data)


def test_an_empty_surface_has_an_empty_mesh():
    with pytest.warns(UserWarning, match="out of the data's range"):
        surface = isospline.Isosurface(isospline.Volume(np.zeros((5, 5, 5))), 3)
    for mesh in (surface.to_mesh(), surface.to_mesh(0.1)):
        assert mesh.vertices.shape == (0, 3) and mesh.faces.shape == (0, 3)


@pytest.mark.parametrize("tolerance", [0, -1, np.nan, np.inf])
def test_tolerance_is_positive(tolerance):
    surface = isospline.Isosurface(isospline.Volume(np.mgrid[:5, :5, :5][0]), 2)
    with pytest.raises(ValueError, match="tolerance: expected a finite number above 0"):
        surface.to_mesh(tolerance)
    with pytest.raises(ValueError, match="return_distance: expected a tolerance or faces as well"):
        surface.to_mesh(return_distance=True)


@pytest.mark.parametrize("tolerance", [5e-324, 6e-5])
def test_tolerances_that_no_lattice_reaches(tolerance):
    surface = isospline.Isosurface(isospline.Volume(np.mgrid[:5, :5, :5][0], spacing=(3, 2, 1)), 2)
    with pytest.raises(ValueError, match=r"^tolerance: expected 6\.10352e-05 or more, 2\^-14 of a voxel's shortest"):
        surface.to_mesh(tolerance)
    with pytest.raises(isospline.Cancelled):  # the number of the message is enough
        surface.to_mesh(6.10352e-5, progress=lambda fraction: False)


def test_meshing_can_be_cancelled():
    field = volumes.gyroid()
    surface = isospline.Isosurface(field.volume(64), field.level)
    with pytest.raises(isospline.Cancelled):
        surface.to_mesh(progress=lambda fraction: False)


# files and other libraries


@pytest.fixture
def ball():
    field = volumes.sphere(0.7)
    volume = isospline.Volume(field.values(20), origin=(100, 200, 300))
    return isospline.Isosurface(volume, field.level)


@pytest.mark.parametrize(
    ("suffix", "exact"), [(".stl", False), (".ply", True), (".obj", True), (".glb", False), (".PLY", True)]
)
def test_files_hold_the_mesh(ball, tmp_path, suffix, exact):
    mesh = ball.to_mesh()
    path = tmp_path / f"ball{suffix}"
    ball.write(path)
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
    again = isospline.read_mesh(path)
    assert len(again.faces) == len(mesh.faces)
    np.testing.assert_allclose(
        again.vertices[again.faces], mesh.vertices[mesh.faces], rtol=1e-14 if exact else 1e-7, atol=1e-14
    )
    shape = trimesh.load_mesh(path)  # as others read it
    assert shape.is_watertight and shape.volume == pytest.approx(mesh.to_trimesh().volume, rel=1e-5)


def test_normals_are_in_files_that_have_them(ball, tmp_path):
    mesh = ball.to_mesh()
    mesh.write(tmp_path / "ball.ply")  # trimesh reads none of these
    data = meshio.read(tmp_path / "ball.ply").point_data
    np.testing.assert_array_equal(np.stack([data["nx"], data["ny"], data["nz"]], axis=1), mesh.normals)
    mesh.write(tmp_path / "ball.obj")
    lines = (tmp_path / "ball.obj").read_text(encoding="utf-8").splitlines()
    normals = np.array([line.split()[1:] for line in lines if line.startswith("vn ")], float)
    np.testing.assert_allclose(normals, mesh.normals, atol=1e-14)
    mesh.write(tmp_path / "ball.glb")
    glb = (tmp_path / "ball.glb").read_bytes()
    assert b'"NORMAL"' in glb and mesh.normals.astype("<f4").tobytes() in glb
    for suffix in (".obj", ".glb", ".ply"):
        faceted = isospline.Mesh(mesh.vertices, mesh.faces)
        faceted.write(tmp_path / f"faceted{suffix}")
        assert isospline.read_mesh(tmp_path / f"faceted{suffix}").normals is None


def test_colors_go_to_files_and_libraries(tmp_path):
    colors = np.array([(255, 0, 0), (0, 128, 0), (10, 20, 30)], np.uint8)
    mesh = isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], colors=colors)
    np.testing.assert_array_equal(mesh.to_trimesh().visual.vertex_colors[:, :3], colors)
    np.testing.assert_array_equal(mesh.to_pyvista().point_data["colors"], colors)
    np.testing.assert_allclose(mesh.to_meshio().point_data["colors"], mesh.colors)
    mesh.write(tmp_path / "triangle.ply")
    np.testing.assert_array_equal(trimesh.load_mesh(tmp_path / "triangle.ply").visual.vertex_colors[:, :3], colors)


def test_libraries_get_the_mesh(ball):
    mesh = ball.to_mesh()
    surface = mesh.to_pyvista()
    np.testing.assert_array_equal(surface.points, mesh.vertices)
    np.testing.assert_array_equal(surface.faces.reshape(-1, 4)[:, 1:], mesh.faces)
    np.testing.assert_array_equal(surface.point_data.active_normals, mesh.normals)
    assert surface.is_manifold
    for there, back in (
        (mesh.to_trimesh(), isospline.Mesh.from_trimesh),
        (surface, isospline.Mesh.from_pyvista),
        (mesh.to_meshio(), isospline.Mesh.from_meshio),
    ):
        again = back(there)
        np.testing.assert_array_equal(again.vertices[again.faces], mesh.vertices[mesh.faces])  # VTK renumbers


def test_names_of_files_are_checked_before_the_work(ball, tmp_path):
    for name in ("ball.xyz", "ball", "ball.stl.gz"):
        with pytest.raises(ValueError, match=r"path: expected a name that ends in \.stl, \.ply, \.obj, \.glb"):
            ball.write(tmp_path / name)
    with pytest.raises(FileNotFoundError):
        ball.write(tmp_path / "no folder" / "ball.stl")
    empty = isospline.Mesh(np.empty((0, 3)), np.empty((0, 3), int))
    with pytest.raises(ValueError, match="expected a mesh with faces, got none"):
        empty.write(tmp_path / "empty.stl")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("tolerance", [None, 0.1])
def test_vertices_without_a_gradient_have_the_normals_of_their_faces(tolerance):
    samples = np.full((6, 6, 6), -1.0)
    samples[2:4, 2:4, 2:4] = 0.0
    for level in (0.0, -1e-6):  # of a cube of zeros, and of one that is a bit larger
        surface = isospline.Isosurface(isospline.Volume(samples, degree=1), level)
        mesh = surface.to_mesh() if tolerance is None else surface.to_mesh(tolerance)
        np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, rtol=1e-12)
        outward = np.einsum("ij,ij->i", mesh.normals, mesh.vertices - 2.5)
        assert (outward > 0.4).all()
