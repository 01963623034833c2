"""Arrays in and out: tensors of other libraries, results that are mappings with attributes, images as arrays."""

import copy

import numpy as np
import PIL.Image
import pytest
from hit_outputs import ALL_OUTPUTS
from spheres import CENTER, mesh_sphere, sphere

import isospline


@pytest.fixture(scope="module")
def scene():
    return isospline.Scene([sphere(), mesh_sphere(3.0)])


@pytest.fixture(scope="module")
def rays():
    camera = isospline.PerspectiveCamera(np.add(CENTER, (5, -60, 8)), CENTER, field_of_view=45)
    return camera.rays((20, 12))


class OnlyDlpack:
    """A tensor that NumPy can read only by DLPack."""

    def __init__(self, array):
        self._array = np.array(array)

    def __dlpack__(self, **options):
        return self._array.__dlpack__(**options)

    def __dlpack_device__(self):
        return self._array.__dlpack_device__()


class OnlyNumpy:
    """A tensor with numpy() alone, which NumPy would read item by item, as one of Open3D."""

    def __init__(self, array):
        self._array = np.array(array)

    def __len__(self):
        return len(self._array)

    def __getitem__(self, index):
        raise AssertionError("read item by item")

    def numpy(self):
        return self._array

    def __dlpack__(self, stream=None):
        raise AssertionError("called with keywords that it does not have")


class OnTheGpu(OnlyDlpack):
    def __dlpack__(self, **options):
        raise BufferError("on another device")

    def __dlpack_device__(self):
        return (2, 0)


class OnlyArray:
    """An object with __array__ alone, as a tensor of torch."""

    def __init__(self, array):
        self._array = np.array(array)

    def __array__(self, dtype=None, copy=None):
        return self._array if dtype is None else self._array.astype(dtype)


def library_tensors():
    def jax(array):
        return pytest.importorskip("jax").numpy.asarray(array)

    def torch(array):
        return pytest.importorskip("torch").tensor(array)

    def open3d(array):
        return pytest.importorskip("open3d").core.Tensor(array)

    own = {"DLPack": OnlyDlpack, "numpy": OnlyNumpy, "__array__": OnlyArray}
    return {**own, "jax": jax, "torch": torch, "open3d": open3d}


@pytest.mark.parametrize("library", library_tensors())
def test_tensors_are_arrays(scene, rays, library):
    make = library_tensors()[library]
    single = rays.astype(np.float32)
    expected = scene.cast_rays(single)
    found = scene.cast_rays(make(single))
    for name, array in expected.items():
        np.testing.assert_array_equal(found[name], array)
        assert found[name].dtype == array.dtype
    data = np.random.default_rng(0).random((5, 6, 7), np.float32)
    volume = isospline.Volume(make(data))
    np.testing.assert_array_equal(volume.coefficients, isospline.Volume(data).coefficients)
    points = np.ones((2, 3), np.float32)
    np.testing.assert_array_equal(volume.sample(make(points)), volume.sample(points))
    mesh = isospline.Mesh(make(np.eye(3, dtype=np.float32)), make(np.array([[0, 1, 2]], np.int32)))
    np.testing.assert_array_equal(mesh.vertices, np.eye(3))
    flat = single.reshape(-1, 6)
    intersector = isospline.RayMeshIntersector(scene)
    expected = intersector.intersects_any(flat[:, :3], flat[:, 3:])
    np.testing.assert_array_equal(intersector.intersects_any(make(flat[:, :3]), make(flat[:, 3:])), expected)
    assert isospline.suggest_levels(make(data)) == isospline.suggest_levels(data)


def test_a_tensor_whose_conversion_fails_is_told(scene):
    class Elsewhere(OnlyNumpy):
        def numpy(self):
            raise RuntimeError("on another device")

    with pytest.raises(TypeError, match="^rays: expected an array of real numbers in the memory of the CPU"):
        scene.cast_rays(Elsewhere(np.zeros((1, 6))))


def test_tensors_of_another_device_are_told(scene):
    with pytest.raises(TypeError, match="^rays: expected an array of real numbers in the memory of the CPU"):
        scene.cast_rays(OnTheGpu(np.zeros((1, 6))))


@pytest.mark.parametrize("caster", ["scene", "hopper"])
def test_real_numbers_have_the_type_of_the_rays(scene, rays, caster):
    caster = scene if caster == "scene" else isospline.research.VoxelHopper(sphere())
    double = caster.cast_rays(rays, outputs=ALL_OUTPUTS)
    single_rays = rays.astype(np.float32)
    single = caster.cast_rays(single_rays, outputs=ALL_OUTPUTS)
    assert double.t_hit.dtype == double.positions.dtype == np.float64
    assert single.t_hit.dtype == single.positions.dtype == single.primitive_normals.dtype == np.float32
    exact = caster.cast_rays(single_rays, outputs=ALL_OUTPUTS, dtype=np.float64)
    for name in ALL_OUTPUTS:
        np.testing.assert_array_equal(single[name], exact[name].astype(single[name].dtype))
    strided = np.zeros((*rays.shape[:2], 12), np.float32)[..., ::2]
    strided[...] = single_rays
    assert caster.cast_rays(strided).t_hit.dtype == np.float32
    assert caster.cast_rays(rays.tolist()).t_hit.dtype == np.float64
    assert caster.cast_rays(np.round(rays).astype(int)).t_hit.dtype == np.float64
    assert caster.cast_rays(rays, dtype="float32").t_hit.dtype == np.float32


def test_results_are_mappings_with_attributes(scene, rays):
    hits = scene.cast_rays(rays, outputs=("t_hit", "positions"))
    assert isinstance(hits, isospline.Hits) and isinstance(hits, dict)
    assert list(hits) == ["t_hit", "positions"] and hits.t_hit is hits["t_hit"]
    assert repr(hits) == "Hits(t_hit: float64[12, 20], positions: float64[12, 20, 3])"
    with pytest.raises(
        AttributeError,
        match=r'^primitive_ids: expected outputs=\("primitive_ids",\) for it, got a result '
        "with t_hit, positions$",
    ):
        hits.primitive_ids
    assert not hasattr(hits, "nonsense")
    assert copy.copy(hits).t_hit is hits.t_hit
    assert {**hits}.keys() == hits.keys()

    crossings = scene.list_intersections(rays)
    assert isinstance(crossings, isospline.Crossings) and crossings.entering is crossings["entering"]
    closest = isospline.Scene(sphere()).closest_points(np.zeros((1, 3)))
    assert isinstance(closest, isospline.ClosestPoints) and closest.distances.shape == (1,)
    all_hits = isospline.Scene(sphere()).cast_rays(rays, outputs=ALL_OUTPUTS, certify=True)
    for result in (all_hits, crossings, closest):
        attributes = {name for name, value in vars(type(result)).items() if isinstance(value, property)}
        assert attributes == set(result)


@pytest.mark.parametrize("coherent", [False, True])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_results_go_where_they_are_told(scene, rays, coherent, dtype):
    rays = rays.astype(dtype)
    expected = scene.cast_rays(rays, outputs=ALL_OUTPUTS, coherent=coherent)
    out = {name: np.empty_like(array) for name, array in expected.items()}
    found = scene.cast_rays(rays, outputs=ALL_OUTPUTS, coherent=coherent, out=out)
    for name, array in out.items():
        assert found[name] is array
        np.testing.assert_array_equal(array, expected[name])
    again = scene.cast_rays(rays + dtype(0.01), outputs=ALL_OUTPUTS, coherent=coherent, out=found)
    assert again.t_hit is out["t_hit"]
    only = np.empty(rays.shape[:-1], dtype)
    hits = scene.cast_rays(rays, coherent=coherent, out={"t_hit": only})
    assert hits.t_hit is only and set(hits) == {"t_hit", "geometry_ids", "primitive_ids", "primitive_normals"}


@pytest.mark.parametrize(
    "out, error, message",
    [
        (3, TypeError, "out: expected a dict of arrays, such as an earlier result, got 3"),
        ({"t_hit": np.zeros(240)}, ValueError, r'out\["t_hit"\]: expected shape \(12, 20\), got \(240,\)'),
        (
            {"t_hit": np.zeros((12, 20), np.float32)},
            TypeError,
            r'out\["t_hit"\]: expected a C-contiguous array of float64, '
            r"got ndarray of shape \(12, 20\) and type float32",
        ),
        ({"t_hit": np.zeros((20, 12)).T}, TypeError, r'out\["t_hit"\]: expected a C-contiguous array of float64'),
        ({"t_hit": [[0.0]]}, TypeError, r'out\["t_hit"\]: expected a C-contiguous array'),
        ({"t_hit": np.broadcast_to(0.0, (12, 20))}, TypeError, r'out\["t_hit"\]: expected a C-contiguous array'),
        (
            {"positions": np.zeros((12, 20, 3))},
            ValueError,
            "out: expected arrays of names in outputs=, got 'positions'",
        ),
    ],
)
def test_bad_places(scene, rays, out, error, message):
    with pytest.raises(error, match=f"^{message}"):
        scene.cast_rays(rays, out=out)
    fixed = np.zeros((12, 20))
    fixed.flags.writeable = False
    with pytest.raises(ValueError, match=r'^out\["t_hit"\]: expected an array that can be written to'):
        scene.cast_rays(rays, out={"t_hit": fixed})


@pytest.mark.parametrize("encoding", ["linear", "srgb8"])
def test_images_are_arrays(scene, encoding):
    image = isospline.render(scene, size=(20, 12), encoding=encoding, light="phong")
    pixels = np.asarray(image)
    assert pixels.shape == (12, 20, 4) and pixels.dtype == np.uint8
    np.testing.assert_array_equal(pixels, image.to_srgb())
    assert np.asarray(image, dtype=float).dtype == float
    copied = np.array(image)
    copied[...] = 7
    np.testing.assert_array_equal(np.asarray(image), pixels)
    PIL.Image.fromarray(np.asarray(image))


def test_matplotlib_shows_images(scene):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    image = isospline.render(scene, size=(20, 12), light="phong")
    shown = pyplot.figure().add_subplot().imshow(image)
    np.testing.assert_array_equal(np.asarray(shown.get_array()), image.to_srgb())
    pyplot.close("all")


def test_images_are_shown_and_saved(scene, tmp_path, monkeypatch):
    image = isospline.render(scene, size=(40, 24), background="white", samples=4, light="phong")
    shown = []
    monkeypatch.setattr(PIL.Image.Image, "show", lambda self: shown.append(np.asarray(self)))
    image.show()
    np.testing.assert_array_equal(shown[0], image.to_srgb())
    for name in ("a.png", "a.jpg", "a.JPEG"):
        image.save(tmp_path / name)
        with PIL.Image.open(tmp_path / name) as read:
            assert read.size == (40, 24) and read.format == ("PNG" if name == "a.png" else "JPEG")
            difference = np.asarray(read.convert("RGB")).astype(int) - image.to_srgb()[..., :3]
        assert np.abs(difference).mean() < (0.01 if name == "a.png" else 4)
    image.write(tmp_path / "small.jpg", quality=10)
    assert (tmp_path / "small.jpg").stat().st_size < (tmp_path / "a.jpg").stat().st_size
    for quality, error in ((0, ValueError), (101, ValueError), ("high", TypeError), (50.5, ValueError)):
        with pytest.raises(error, match="^quality: expected a whole number"):
            image.write(tmp_path / "b.jpg", quality=quality)
    assert not (tmp_path / "b.jpg").exists()
    clear = isospline.render(
        isospline.Scene(), isospline.PerspectiveCamera((0, -1, 0), (0, 0, 0)), size=(4, 4), light="phong"
    )
    clear.save(tmp_path / "clear.jpg")
    assert np.asarray(PIL.Image.open(tmp_path / "clear.jpg")).max() == 0
