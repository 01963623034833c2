"""Reasonable first guesses of new users: arguments in place of volumes, scenes, cameras and sizes."""

import re
import warnings

import numpy as np
import pytest
import SimpleITK
import trimesh
from hit_outputs import ALL_OUTPUTS
from spheres import CENTER, mesh_sphere, moved, sphere

import isospline
from isospline import volumes

RAYS = np.array([(*np.add(CENTER, (0, -60, 0)), 0, 1, 0), (*np.add(CENTER, (20, -60, 0)), 0, 1, 0)])


def same_hits(one, other):
    for name in ALL_OUTPUTS:
        first, second = (scene.cast_rays(RAYS, outputs=ALL_OUTPUTS)[name] for scene in (one, other))
        np.testing.assert_array_equal(first, second)


def test_scenes_of_one_object():
    for thing in (sphere(), mesh_sphere(5.0)):
        same_hits(isospline.Scene(thing), isospline.Scene([thing]))


def test_scenes_of_placed_objects():
    ball, mesh, move = sphere(), mesh_sphere(5.0), moved(*(CENTER + (20, 0, 0)))
    expected = isospline.Scene([ball])
    expected.add(mesh, move)
    same_hits(isospline.Scene([ball, (mesh, move)]), expected)
    same_hits(isospline.Scene([[ball, None], (mesh, move.tolist())]), expected)
    np.testing.assert_array_equal(isospline.Scene([(mesh, move)]).transform(0), move)
    with pytest.raises(ValueError, match=r"^transform: expected shape \(4, 4\)"):
        isospline.Scene([(mesh, np.eye(3))])


def test_meshes_of_other_libraries_in_scenes():
    pyvista, meshio = pytest.importorskip("pyvista"), pytest.importorskip("meshio")
    given = trimesh.creation.icosphere(2, 3.0)
    expected = isospline.Scene([isospline.Mesh.from_trimesh(given)])
    polydata = pyvista.wrap(given)
    derived = type("Derived", (trimesh.Trimesh,), {})(given.vertices, given.faces, process=False)
    for mesh in (given, derived, polydata, meshio.Mesh(given.vertices, {"triangle": given.faces})):
        added = isospline.Scene()
        assert added.add(mesh) == 0
        for scene in (added, isospline.Scene(mesh), isospline.Scene([mesh]), isospline.Scene([(mesh, np.eye(4))])):
            assert isinstance(scene.object(0), isospline.Mesh)
            np.testing.assert_allclose(scene.bounds, expected.bounds, atol=1e-6)


def test_errors_for_foreign_images_name_the_converter():
    image = SimpleITK.Image(4, 4, 4, SimpleITK.sitkFloat32)
    nibabel = pytest.importorskip("nibabel").Nifti1Image(np.zeros((4, 4, 4), np.float32), np.eye(4))
    grid = pytest.importorskip("pyvista").ImageData(dimensions=(4, 4, 4))
    for given, method in ((image, "from_sitk"), (nibabel, "from_nibabel"), (grid, "from_pyvista")):
        for make in (isospline.Volume, lambda volume: isospline.Isosurface(volume, 0.0)):
            with pytest.raises(TypeError, match=rf"; did you mean Volume\.{method}\("):
                make(given)
        with pytest.raises(TypeError, match=r"; did you mean Labels\(VolumeData\.from_affine\("):
            isospline.Labels(given)


def test_light_by_objects():
    ball, mesh = sphere(), mesh_sphere(5.0)
    scene = isospline.Scene([ball, (mesh, moved(*(CENTER + (20, 0, 0)))), (ball, moved(0, 0, 40))])
    red, outline = isospline.Phong(color="red"), isospline.Outline()
    options = {"camera": isospline.camera_for(scene, view="front"), "size": (48, 32)}
    expected = isospline.render(scene, light={0: red, 1: outline, 2: red}, **options)
    assert isospline.render(scene, light={ball: red, mesh: outline}, **options) == expected
    assert isospline.render(scene, light={ball: red, 1: outline}, **options) == expected
    mixed = isospline.render(scene, light={ball: red, 1: outline, 2: isospline.Phong()}, **options)
    assert mixed == isospline.render(scene, light={0: red, 1: outline}, **options) != expected
    with pytest.raises(ValueError, match="^light: expected isosurfaces and meshes of the scene"):
        isospline.render(scene, light={sphere(): red}, **options)


@pytest.mark.parametrize("size", [(64, 32), (32, 64), (40, 40)])
def test_the_default_camera_has_all_in_view(size):
    scene = isospline.Scene([sphere(), mesh_sphere(5.0)])
    image = isospline.render(scene, size=size, layers=("geometry_ids",), light="phong")
    assert image == isospline.render(
        scene, isospline.camera_for(scene, size=size), size=size, layers=("geometry_ids",), light="phong"
    )
    covered = image.geometry_ids != isospline.INVALID_ID
    assert covered.any() and not covered[[0, -1]].any() and not covered[:, [0, -1]].any()
    (first,) = isospline.render_progressive(scene, samples=1, size=size)
    assert first.size == size


def test_cameras_for_surfaces_and_meshes():
    ball = sphere()
    for thing in (ball, mesh_sphere(5.0)):
        assert isospline.camera_for(thing) == isospline.camera_for(isospline.Scene(thing))
    assert isospline.camera_for(ball.volume) == isospline.camera_for(ball.volume.bounds)
    for thing in (ball, mesh_sphere(5.0), ball.volume):
        assert len(isospline.turntable_cameras(thing, 3)) == 3
    with pytest.raises(TypeError, match="^scene: expected a scene or a box"):
        isospline.camera_for("scene")


def test_extrinsics_of_four_rows():
    angle = np.radians(30)
    turn = np.array([(np.cos(angle), 0, np.sin(angle)), (0, 1, 0), (-np.sin(angle), 0, np.cos(angle))])
    extrinsics = np.eye(4)
    extrinsics[:3, :3], extrinsics[:3, 3] = turn, (0.1, 0.2, 5)
    K = [(60, 0, 32), (0, 62, 24), (0, 0, 1)]
    make = isospline.ProjectionPlaneCamera.from_opencv
    expected = make(K, turn, (0.1, 0.2, 5), (64, 48), pixel_center=0.5)
    assert make(K, extrinsics, size=(64, 48), pixel_center=0.5) == expected
    assert make(K, extrinsics[:3], size=(64, 48), pixel_center=0.5, distortion=np.zeros(5)) == expected
    for wrong, message in (
        ({"rotation": turn}, r"rotation: expected shape \(4, 4\) or \(3, 4\) if translation is None, got \(3, 3\)"),
        ({"rotation": extrinsics + 1}, r"rotation: expected the last row \(0, 0, 0, 1\)"),
        ({"distortion": (0.1, 0, 0)}, r"distortion: expected 4, 5, 8 or 12 coefficients, got 3"),
        ({"size": None}, "size: expected width and height of the calibrated image"),
    ):
        with pytest.raises(ValueError, match=f"^{message}"):
            make(**{"intrinsics": K, "rotation": extrinsics, "size": (64, 48), **wrong})


def test_one_number_is_the_spacing_along_all_axes(tmp_path):
    data = np.zeros((3, 4, 5), np.float32)
    np.testing.assert_array_equal(isospline.Volume(data, spacing=0.1).spacing, [0.1] * 3)
    np.save(tmp_path / "a.npy", data)
    assert isospline.read_volume(tmp_path / "a.npy", spacing=0.1).spacing == (0.1, 0.1, 0.1)
    for wrong in (0, -1, np.nan):
        with pytest.raises(ValueError, match="^spacing: "):
            isospline.Volume(data, spacing=wrong)


FIELD = volumes.heart()


@pytest.mark.parametrize("type_name", ["uint8", "int16", "uint16", "float32", "FLOAT64"])
def test_names_of_raw_files_give_shape_and_type(tmp_path, type_name):
    data = (100 + 50 * FIELD.values((10, 11, 12)).clip(-1, 1)).astype(type_name.lower())
    path = tmp_path / f"heart_12x11x10_{type_name}.raw"
    data.tofile(path)
    read = isospline.read_volume(path)
    np.testing.assert_array_equal(read.data, data)
    assert read.format == "raw, shape and type by its name" and read.data.dtype == data.dtype
    assert isospline.read_volume(path, shape=(10, 11, 12)).format == "raw, type by its name"
    assert isospline.read_volume(path, dtype=data.dtype).format == "raw, shape by its name"
    assert isospline.read_volume(path, shape=(10, 11, 12), dtype=data.dtype).format == "raw"


@pytest.mark.parametrize("name", ["heart.raw", "heart_12x11_uint8.raw", "heart_12x11x10.raw", "1x12x11x10_uint8a.raw"])
def test_names_that_do_not(tmp_path, name):
    FIELD.values((10, 11, 12), np.float32).tofile(tmp_path / name)
    order = r"shape=\(nz, ny, nx\) in Python, --shape NX,NY,NZ on the command line"
    with pytest.raises(ValueError, match=f"which the file does not store: shape= \\({order}\\)"):
        isospline.read_volume(tmp_path / name)
    with pytest.raises(ValueError, match=f"expected 480 bytes, .* got 5280 bytes \\({order}\\)"):
        isospline.read_volume(tmp_path / name, shape=(4, 5, 6), dtype="f4")


@pytest.mark.parametrize("type_name", ["u1", "<u2", "<i2", ">u2", ">i2", "<f4", ">f4", "<f8"])
def test_shape_and_type_of_raw_files_are_suggested(tmp_path, type_name):
    shape, path = (20, 27, 34), tmp_path / "heart.raw"
    values = FIELD.values(shape)
    noise = np.random.default_rng(0).normal(0, 0.01, shape)
    scaled = (values - values.min()) / np.ptp(values) + noise.clip(0, 1)
    offset = -300 if "i" in type_name else 0
    data = (scaled * (200 if type_name == "u1" else 1500) + offset).astype(type_name)
    data.tofile(path)
    with pytest.raises(ValueError, match=re.escape(f"; did you mean shape={shape}, dtype='{type_name}'?")):
        isospline.read_volume(path)
    for noise_or_zeros in (np.random.default_rng(0).bytes(data.nbytes), bytes(data.nbytes), bytes(120)):
        path.write_bytes(noise_or_zeros)
        with pytest.raises(ValueError, match=r"command line\)$"):
            isospline.read_volume(path)
    with pytest.raises(ValueError, match=r"command line\)$"):
        isospline.read_volume(path, offset=-5)


def test_shapes_that_scramble_are_noticed(tmp_path):
    shape = (30, 41, 52)
    data = FIELD.values(shape)
    path = tmp_path / "heart.raw"
    data.tofile(path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        isospline.read_volume(path, shape=shape, dtype="f4")
    for wrong in ((52, 41, 30), (41, 30, 52)):
        with pytest.warns(
            UserWarning, match=r"^shape: expected samples that are similar .*did you mean \(30, 41, 52\)\?$"
        ):
            isospline.read_volume(path, shape=wrong, dtype="f4")
    # Noise, constant volumes and thin volumes give no warning.
    for content in (np.random.default_rng(0).random(shape, np.float32), np.ones(shape, np.float32)):
        content.tofile(path)
        isospline.read_volume(path, shape=shape[::-1], dtype="f4")


def test_real_volumes_are_not_suspected(volumes_folder):
    for name in ("tooth_103x94x161_uint16.raw", "vismale_128x256x256_uint8.raw"):
        read = isospline.read_volume(volumes_folder / name)
        assert read.format == "raw, shape and type by its name"
    with pytest.warns(UserWarning, match=r"did you mean \(161, 94, 103\)\?$"):
        isospline.read_volume(volumes_folder / "tooth_103x94x161_uint16.raw", shape=(103, 94, 161))
