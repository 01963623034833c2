"""What other programs read in a store: the samples, as an OME-Zarr image; and the store in the commands."""

import json

import numpy as np
import pytest

import isospline
from isospline.cli import main as cli
from isospline.picture.files import scene_of_file
from isospline.viewer.document import Document, read_source

zarr = pytest.importorskip("zarr", minversion="3")
ndimage = pytest.importorskip("scipy.ndimage")

SHAPE = (40, 70, 90)


def samples(dtype):
    rng = np.random.default_rng(3)
    noise = ndimage.gaussian_filter(rng.normal(size=SHAPE), 2)
    noise = (noise - noise.min()) / np.ptp(noise)
    return (noise * 200 + (dtype not in ("u1", "?")) * 1000).astype(dtype) if dtype != "?" else noise > 0.5


@pytest.mark.sweep(3)
@pytest.mark.parametrize("dtype", ["u1", ">i2", "u4", "f4", ">f8", "?"])
@pytest.mark.parametrize(
    ("degree", "boundary"), [(0, "mirror"), (1, "mirror"), (2, "periodic"), (3, "mirror"), (5, "mirror")]
)
def test_other_readers_get_the_samples(tmp_path, dtype, degree, boundary):
    data = samples(dtype)
    path = isospline.convert(data, tmp_path / "a.zarr", degree=degree, boundary=boundary, chunk=16)
    group = zarr.open_group(path, mode="r")
    datasets = group.attrs["ome"]["multiscales"][0]["datasets"]
    finest = group[datasets[0]["path"]]
    assert finest.dtype == ("u1" if dtype == "?" else data.dtype.newbyteorder("="))
    np.testing.assert_array_equal(finest[:], data)
    store = isospline.store.read_metadata(path)
    assert len(datasets) == len(store.scales) == 2
    # The coarser level has the values of its model at its samples, by scipy.
    level = store.scales[1]
    coefficients = group[level.path][:].astype(float) + level.offset
    mode = "mirror" if boundary == "mirror" else "grid-wrap"
    expected = ndimage.map_coordinates(coefficients, np.indices(level.shape), order=degree, mode=mode, prefilter=False)
    coarse = group[datasets[1]["path"]]
    assert coarse.dtype == finest.dtype and coarse.shape == level.shape
    tolerance = 1e-4 if data.dtype.kind == "f" else 0.5 + 1e-4
    assert np.abs(coarse[:].astype(float) - expected.clip(data.min(), data.max())).max() <= tolerance


@pytest.mark.parametrize("dtype", ["i8", "u8"])
def test_coarse_samples_of_64_bits_do_not_overflow(tmp_path, dtype):
    whole = np.iinfo(dtype)
    data = np.array([whole.min, whole.max], dtype)[np.indices((96, 9, 9))[0] // 48]
    group = zarr.open_group(isospline.convert(data, tmp_path / "a.zarr"), mode="r")
    np.testing.assert_array_equal(group["0"][:], data)
    coarse = group["1"][:]
    assert (coarse[:20] < whole.min + whole.max // 50).all() and (coarse[28:] > whole.max - whole.max // 50).all()


def test_a_store_is_a_source_of_its_samples(tmp_path):
    data = samples("i2")
    place = dict(spacing=(1, 2, 3), origin=(4, 5, 6), direction=[(0.8, -0.6, 0), (0.6, 0.8, 0), (0, 0, 1)])
    path = isospline.convert(data, tmp_path / "a.zarr", degree=3, **place)
    again = isospline.open_volume(isospline.convert(path, tmp_path / "b.zarr", degree=1))
    expected = isospline.Volume(data, degree=1, **place)
    np.testing.assert_array_equal(again.coefficients, expected.coefficients)
    np.testing.assert_array_equal(again.affine, expected.affine)


def test_other_readers_get_lengths_along_directions_that_are_not_of_length_one(tmp_path):
    data, direction = samples("i2"), np.array([(1.6, -0.3, 0), (1.2, 0.4, 0), (0, 0, 1)])
    place = dict(spacing=(1, 2, 3), origin=(4, 5, 6), direction=direction)
    path = isospline.convert(data, tmp_path / "a.zarr", **place)
    (image,) = zarr.open_group(path, mode="r").attrs["ome"]["multiscales"]
    for number, scale in enumerate(isospline.store.read_metadata(path).scales):
        (_, steps), (_, first) = (each.items() for each in image["datasets"][number]["coordinateTransformations"])
        distances = np.linalg.norm(scale.affine[:3, :3], axis=0)
        np.testing.assert_allclose(steps[1][::-1], distances)
        np.testing.assert_allclose(scale.affine[:3, :3] / distances @ first[1][::-1], scale.affine[:3, 3])
    again = isospline.open_volume(isospline.convert(path, tmp_path / "b.zarr"))
    np.testing.assert_array_equal(again.affine, isospline.Volume(data, **place).affine)


def test_a_store_without_an_image_does_not_call_itself_one(tmp_path):
    data = samples("f4")
    with_image = isospline.convert(data, tmp_path / "a.zarr")
    path = isospline.convert(data, tmp_path / "b.zarr", image=False)
    assert sorted(each.name for each in path.iterdir()) == ["coefficients", "ranges", "zarr.json"]
    assert "ome" not in zarr.open_group(path, mode="r").attrs
    one, other = map(isospline.open_volume, (with_image, path))
    np.testing.assert_array_equal(one.coefficients, other.coefficients)
    with pytest.raises(TypeError, match="image: expected True or False"):
        isospline.convert(data, tmp_path / "c.zarr", image="no")


@pytest.fixture
def files(tmp_path):
    field = isospline.volumes.torus()
    data = field.values(80)
    np.save(tmp_path / "torus.npy", data)
    spacing = field.grid(80)["spacing"]
    options = ["--spacing", ",".join(map(str, spacing))]
    isospline.convert(data, tmp_path / "torus.zarr", spacing=spacing, degree=3)
    return [[str(tmp_path / "torus.npy"), *options], [str(tmp_path / "torus.zarr")]]


def test_info_of_a_store(files, capsys):
    found = []
    for given in files:
        assert cli.main(["info", *given, "--json"]) == 0
        found.append(json.loads(capsys.readouterr().out))
    for name in ("size", "type", "spacing", "origin", "direction", "bounds", "minimum", "maximum", "bytes"):
        assert found[0][name] == found[1][name], name
    about = "isospline store, degree 3, 2 scales; mean and histogram are those of 64000 values of level 0"
    assert found[1]["format"] == about
    assert cli.main(["info", *files[1]]) == 0
    assert "isospline store" in capsys.readouterr().out


def test_the_suggested_level_of_a_store_is_that_of_its_samples(tmp_path, capsys):
    z, y, x = np.mgrid[0:24, 0:24, 0:24]
    data = np.where(np.hypot(np.hypot(x - 12, y - 12), z - 12) < 7, 200, 10).astype(np.uint8)
    data += np.random.default_rng(0).integers(0, 40, data.shape, np.uint8)
    np.save(tmp_path / "ball.npy", data)
    folder = isospline.convert(data, tmp_path / "ball.zarr")
    levels = isospline.suggest_levels(data)
    assert abs(isospline.suggest_levels(isospline.open_volume(folder).coefficients)[0] - levels[0]) > 0.5
    assert cli.main(["info", str(folder), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    np.testing.assert_allclose(found["suggested_levels"], levels, atol=0.1)
    np.testing.assert_allclose([found["mean"], found["standard_deviation"]], [data.mean(), data.std()], rtol=1e-4)
    np.testing.assert_allclose(np.array(found["histogram"]["edges"])[[0, -1]], [data.min(), data.max()], atol=0.1)
    assert cli.main(["measure", str(folder), "--order", "2", "--json", "--quiet"]) == 0
    measured = json.loads(capsys.readouterr().out)["level"]
    assert measured == scene_of_file(folder, None).object(0).level
    assert measured == Document().add(read_source(folder)).presentation.level


@pytest.mark.slow
def test_measures_and_mesh_of_a_store(files, tmp_path, capsys):
    found = []
    for number, given in enumerate(files):
        model = ["--degree", "3"] if number == 0 else []
        assert cli.main(["measure", *given, "--level", "0", "--order", "2", "--json", *model, "--quiet"]) == 0
        found.append(json.loads(capsys.readouterr().out))
        mesh = str(tmp_path / f"{number}.ply")
        assert cli.main(["mesh", *given, "--level", "0", "-o", mesh, *model, "--quiet"]) == 0
        capsys.readouterr()
    for name in ("enclosed_volume", "area", "gaussian_curvature"):
        np.testing.assert_allclose(found[0][name]["value"], found[1][name]["value"], rtol=1e-6, atol=1e-6)
    assert found[0]["components"]["cell_counts"] == found[1]["components"]["cell_counts"]
    one, other = (isospline.read_mesh(tmp_path / f"{number}.ply") for number in range(2))
    np.testing.assert_allclose(one.vertices, other.vertices, atol=1e-5)
    assert cli.main(["measure", *files[1], "--level", "0", "--degree", "1"]) == 2
    assert "--degree: expected 3, as in the store, got 1" in capsys.readouterr().err
