"""Volumes of other libraries. The oracle is each library's own position of its samples."""

import subprocess
import sys

import numpy as np
import pytest

import isospline
from isospline.io import VolumeData

nibabel = pytest.importorskip("nibabel")
pyvista = pytest.importorskip("pyvista")
SimpleITK = pytest.importorskip("SimpleITK")
xarray = pytest.importorskip("xarray")

from placed_images import DIRECTIONS, ORIGIN, SHAPE, SPACING, directions, itk_image, vtk_image

# All indices, (x, y, z), in the order of data.ravel().
INDICES = np.stack(np.meshgrid(*map(np.arange, SHAPE), indexing="ij"), axis=-1).reshape(-1, 3)[:, ::-1]
LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0])


@pytest.fixture
def data(rng):
    return rng.normal(size=SHAPE).astype(np.float32)


def check(volume, data, positions):
    """The volume has each sample at the library's position: its model passes through the samples there."""
    affine = volume.affine
    np.testing.assert_allclose(INDICES @ affine[:3, :3].T + affine[:3, 3], positions, rtol=0, atol=1e-9)
    np.testing.assert_allclose(volume.sample(positions), np.ravel(data), atol=2e-6)
    np.testing.assert_allclose(abs(np.linalg.norm(volume.direction, axis=0)), 1, rtol=1e-12)


# SimpleITK


@directions
def test_sitk_is_where_sitk_says(data, direction):
    image = itk_image(data, direction)
    volume = isospline.Volume.from_sitk(image)
    check(volume, data, [image.TransformIndexToPhysicalPoint(index.tolist()) for index in INDICES])
    np.testing.assert_array_equal(volume.spacing, SPACING)
    np.testing.assert_array_equal(volume.direction, direction)


def test_sitk_series_of_one_is_a_volume(data):
    image = SimpleITK.JoinSeries(itk_image(data, DIRECTIONS["oblique"]))
    np.testing.assert_allclose(isospline.Volume.from_sitk(image).direction, DIRECTIONS["oblique"], atol=1e-12)


def test_sitk_images_that_are_no_volume_are_refused(data):
    make = isospline.Volume.from_sitk
    with pytest.raises(ValueError, match="image: expected three dimensions"):
        make(SimpleITK.GetImageFromArray(data[0]))
    with pytest.raises(ValueError, match="image: expected three dimensions"):
        make(SimpleITK.JoinSeries([itk_image(data), itk_image(data)]))
    with pytest.raises(ValueError, match="image: expected one number a sample"):
        make(SimpleITK.Image([4, 4, 4], SimpleITK.sitkVectorFloat32, 3))
    with pytest.raises(ValueError, match="image: expected real numbers"):
        make(SimpleITK.Image([4, 4, 4], SimpleITK.sitkComplexFloat32))


# nibabel


@directions
@pytest.mark.parametrize("kind", ["Nifti1Image", "Nifti2Image", "MGHImage"])
def test_nibabel_is_where_nibabel_says(tmp_path, data, direction, kind):
    affine = np.eye(4)
    affine[:3, :3], affine[:3, 3] = direction * SPACING, ORIGIN
    image = getattr(nibabel, kind)(np.ascontiguousarray(data.T), affine)
    positions = nibabel.affines.apply_affine(image.affine, INDICES) @ LPS_FROM_RAS
    check(isospline.Volume.from_nibabel(image), data, positions)

    path = tmp_path / ("a.mgz" if kind == "MGHImage" else "a.nii.gz")
    nibabel.save(image, path)
    image = nibabel.load(path)
    positions = nibabel.affines.apply_affine(image.affine, INDICES) @ LPS_FROM_RAS
    check(isospline.Volume.from_nibabel(image), data, positions)


def test_nibabel_is_where_the_file_is(tmp_path, data):
    affine = np.array([[1, 0.2, 0, 1], [0, 2, 0.1, 2], [0, 0, 3, 3], [0, 0, 0, 1.0]])
    image = nibabel.Nifti1Image(np.round(100 * data.T).astype(np.int16), affine)
    image.header.set_slope_inter(0.5, -10)
    nibabel.save(image, tmp_path / "a.nii")
    image = nibabel.load(tmp_path / "a.nii")
    volume, read = isospline.Volume.from_nibabel(image), isospline.read_volume(tmp_path / "a.nii")
    np.testing.assert_array_equal(volume.affine, read.affine)
    np.testing.assert_allclose(volume.sample(read.position(INDICES)), image.get_fdata().T.ravel(), atol=1e-4)


def test_nibabel_images_that_are_no_volume_are_refused(data):
    make = isospline.Volume.from_nibabel
    with pytest.raises(ValueError, match="image: expected three dimensions"):
        make(nibabel.Nifti1Image(np.stack([data.T, data.T], axis=-1), np.eye(4)))
    with pytest.raises(ValueError, match="image: expected an affine"):
        make(nibabel.Nifti1Image(data.T, None))
    with pytest.raises(ValueError, match="image: expected real numbers"):
        make(nibabel.Nifti1Image(data.T.astype(np.complex64), np.eye(4)))
    colours = np.zeros(SHAPE, [("R", "u1"), ("G", "u1"), ("B", "u1")])
    with pytest.raises(ValueError, match="image: expected one number a sample"):
        make(nibabel.Nifti1Image(colours, np.eye(4)))


# PyVista and VTK


@directions
def test_pyvista_is_where_pyvista_says(data, direction):
    image = pyvista.ImageData(
        dimensions=SHAPE[::-1], spacing=SPACING, origin=ORIGIN, direction_matrix=direction, offset=(2, -3, 10)
    )
    image["density"] = data.ravel()
    check(isospline.Volume.from_pyvista(image), data, image.points)
    check(isospline.Volume.from_vtk(image), data, image.points)


@directions
def test_pyvista_cells_are_where_pyvista_says(data, direction):
    image = pyvista.ImageData(
        dimensions=np.array(SHAPE[::-1]) + 1,
        spacing=SPACING,
        origin=ORIGIN,
        direction_matrix=direction,
        offset=(2, -3, 10),
    )
    image.cell_data["density"] = data.ravel()
    check(isospline.Volume.from_pyvista(image), data, image.cell_centers().points)


def test_pyvista_model_is_what_vtk_interpolates(data, rng):
    image = pyvista.ImageData(dimensions=SHAPE[::-1], spacing=SPACING, origin=ORIGIN)
    image["density"] = data.ravel()
    points = ORIGIN + rng.uniform(0.01, 0.99, (200, 3)) * (np.array(SHAPE[::-1]) - 1) * SPACING
    sampled = pyvista.PolyData(points).sample(image)
    assert sampled["vtkValidPointMask"].all()
    volume = isospline.Volume.from_pyvista(image, degree=1)
    np.testing.assert_allclose(volume.sample(points), sampled["density"], atol=1e-5)


def test_pyvista_array_is_the_active_one_or_the_named_one(data):
    image = pyvista.ImageData(dimensions=SHAPE[::-1])
    image["first"], image["second"] = data.ravel(), data.ravel() + 1
    center = np.array([3.0, 2, 1])
    for name, offset in (("first", 0), ("second", 1)):
        image.set_active_scalars(name)
        assert isospline.Volume.from_pyvista(image).sample(center) == pytest.approx(data[1, 2, 3] + offset, abs=1e-5)
        named = isospline.Volume.from_pyvista(image, name)
        assert named.sample(center) == pytest.approx(data[1, 2, 3] + offset, abs=1e-5)
    with pytest.raises(ValueError, match="image_data: expected an array named third"):
        isospline.Volume.from_pyvista(image, scalars="third")
    image["vectors"] = np.zeros((data.size, 3))
    with pytest.raises(ValueError, match="image_data: expected one number a sample"):
        isospline.Volume.from_pyvista(image, scalars="vectors")
    with pytest.raises(ValueError, match="image_data: expected one array of samples, or its name"):
        isospline.Volume.from_pyvista(pyvista.ImageData(dimensions=(3, 3, 3)))


@pytest.mark.parametrize("kind", ["point", "cell"])
def test_the_active_scalars_of_pyvista_are_of_points_or_cells(kind):
    image = pyvista.ImageData(dimensions=(4, 5, 6))
    image.point_data["v"] = np.arange(120.0)
    image.cell_data["v"] = -np.arange(60.0)
    image.set_active_scalars("v", preference=kind)
    volume = isospline.Volume.from_pyvista(image)
    assert volume.shape == ((6, 5, 4) if kind == "point" else (5, 4, 3))
    assert volume.maximum == np.max(image.active_scalars)
    for convert in (isospline.Volume.from_pyvista, isospline.Volume.from_vtk):
        with pytest.raises(TypeError, match="of_cells"):  # not a parameter
            convert(image, "v", of_cells=True)


@directions
def test_vtk_is_where_vtk_says(data, direction):
    image = vtk_image(data, direction, extent=(2, 8, -3, 2, 10, 14))
    image.SetSpacing(-SPACING[0], *SPACING[1:])
    check(isospline.Volume.from_vtk(image), data, [image.GetPoint(index) for index in range(data.size)])


# xarray


@pytest.mark.parametrize("order", ["zyx", "xyz", "yxz"])
@pytest.mark.parametrize("downwards", ["", "x", "yz"])
@pytest.mark.parametrize("case", [str.lower, str.upper])
def test_xarray_is_where_its_coordinates_are(data, order, downwards, case):
    coordinates = {}
    for axis, name in enumerate("xyz"):
        values = ORIGIN[axis] + np.arange(SHAPE[2 - axis]) * SPACING[axis]
        coordinates[case(name)] = values[::-1] if name in downwards else values
    array = xarray.DataArray(data, coordinates, tuple(case("zyx"))).transpose(*case(order))

    volume = isospline.Volume.from_xarray(array)
    table = array.to_dataframe("density").reset_index()
    positions, values = table[list(case("xyz"))].to_numpy(), table["density"].to_numpy()
    np.testing.assert_allclose(volume.sample(positions), values, atol=2e-6)
    assert [np.linalg.det(volume.direction) < 0, *volume.spacing] == [len(downwards) == 1, *SPACING]


def test_xarray_dimensions_may_have_other_names(data):
    array = xarray.DataArray(
        data[:, None], {"depth": [8.0, 6, 4, 2, 0], "channel": ["red"]}, ("depth", "channel", "row", "column")
    )
    volume = isospline.Volume.from_xarray(array, dims=("column", "row", "depth"))
    check(volume, data, INDICES * (1, 1, -2) + (0, 0, 8))


@pytest.mark.parametrize("joined", [False, True])
def test_xarray_of_itk_is_where_itk_says(data, joined):
    # The form that itk.xarray_from_image writes.
    image = itk_image(data, DIRECTIONS["oblique and mirrored"])
    positions = [image.TransformIndexToPhysicalPoint(index.tolist()) for index in INDICES]
    if joined:
        image = SimpleITK.JoinSeries(image)
    dimension = image.GetDimension()
    coordinates = {
        name: np.linspace(origin, origin + (size - 1) * spacing, size)
        for name, origin, size, spacing in zip("xyzt", image.GetOrigin(), image.GetSize(), image.GetSpacing())
    }
    direction = np.flip(np.reshape(image.GetDirection(), (dimension, dimension)))
    array = xarray.DataArray(
        SimpleITK.GetArrayFromImage(image), coordinates, tuple("tzyx"[-dimension:]), attrs={"direction": direction}
    )
    check(isospline.Volume.from_xarray(array), data, positions)


def test_xarray_coordinates_may_be_rounded_but_not_uneven(data):
    def array(z):
        return xarray.DataArray(data, {"z": z}, tuple("zyx"))

    volume = isospline.Volume.from_xarray(array([0, 0.333, 0.667, 1, 1.333]))
    assert (volume.spacing[2], volume.origin[2]) == (pytest.approx(0.33325), 0)
    for wrong in ([0, 1, 2, 4, 8], [1, 1, 1, 1, 1], [0, 1, np.nan, 3, 4], [0, 1, 2, 3, np.inf]):
        with pytest.raises(ValueError, match="array: expected finite and evenly spaced coordinates of z"):
            isospline.Volume.from_xarray(array(wrong))
    with pytest.raises(ValueError, match="array: expected numbers as coordinates of z"):
        isospline.Volume.from_xarray(array(np.arange(5).astype("datetime64[s]")))


def test_xarray_of_other_dimensions_is_refused(data):
    make = isospline.Volume.from_xarray
    with pytest.raises(ValueError, match=r"dims: expected the names .* one of \('a', 'y', 'x'\) each"):
        make(xarray.DataArray(data, dims=("a", "y", "x")))
    for dims in ("zyx", ("x", "y"), ("x", "x", "y"), ("x", "y", "b")):
        with pytest.raises(ValueError, match="dims: expected three dimensions of"):
            make(xarray.DataArray(data, dims=tuple("zyx")), dims=dims)
    with pytest.raises(ValueError, match="array: expected three dimensions"):
        make(xarray.DataArray(np.stack([data, data]), dims=tuple("tzyx")))
    with pytest.raises(TypeError, match=r"array: expected an xarray.DataArray"):
        make(xarray.Dataset())


def test_arrays_of_xarray_and_dask_are_samples(data):
    dask_array = pytest.importorskip("dask.array")
    for array in (xarray.DataArray(data), dask_array.from_array(data, chunks=3)):
        for volume in (isospline.Volume(array), VolumeData(array).to_volume()):
            np.testing.assert_array_equal(volume.coefficients, isospline.Volume(data).coefficients)
        assert isospline.render(VolumeData(array), size=(8, 8)) is not None


def test_coordinates_of_xarray_are_not_ignored(data, tmp_path):
    array = xarray.DataArray(data, {"z": 2.0 * np.arange(len(data))}, tuple("zyx"))
    for use in (isospline.Volume, VolumeData, lambda each: isospline.Labels(each > 0)):
        with pytest.raises(ValueError, match=r"^data: .* got some along z; Volume\.from_xarray\(array\) keeps them"):
            use(array)
    with pytest.raises(ValueError, match="^source: expected an array without coordinates"):
        isospline.convert(array, tmp_path / "a.zarr")
    indices = array.assign_coords(z=np.arange(len(data)))
    for same in (array.data, indices):
        np.testing.assert_array_equal(isospline.Volume(same).spacing, 1)


# All of them


def objects(data):
    image = pyvista.ImageData(dimensions=data.shape[::-1])
    image["density"] = data.ravel()
    return {
        "from_nibabel": nibabel.Nifti1Image(data.T, np.eye(4)),
        "from_pyvista": image,
        "from_sitk": SimpleITK.GetImageFromArray(data),
        "from_vtk": vtk_image(data),
        "from_xarray": xarray.DataArray(data, dims=tuple("zyx")),
    }


@pytest.mark.parametrize("name", ["from_nibabel", "from_pyvista", "from_sitk", "from_vtk", "from_xarray"])
def test_options_reach_the_model(data, name):
    image = objects(data)[name]
    volume = getattr(isospline.Volume, name)(image, degree=3, boundary="periodic", filter="smoothing", smoothing=0.5)
    assert (volume.degree, volume.boundary, volume.filter, volume.smoothing) == (3, "periodic", "smoothing", 0.5)

    class Derived(isospline.Volume):
        pass

    assert type(getattr(Derived, name)(image)) is Derived


@pytest.mark.parametrize("name", ["from_nibabel", "from_pyvista", "from_sitk", "from_vtk", "from_xarray"])
def test_other_objects_options_and_samples_are_refused(data, name):
    make = getattr(isospline.Volume, name)
    with pytest.raises(TypeError, match=r"^(image|image_data|array): expected .*, got ndarray of shape "):
        make(data)
    for option in ({"spacing": (1, 1, 1)}, {"axes": "xyz"}):
        with pytest.raises(TypeError, match="expected none, as"):
            make(objects(data)[name], **option)
    data[1, 2, 3] = np.nan
    with pytest.raises(
        ValueError, match=r"^(image|image_data|array): expected finite .* index \(x, y, z\) = \(3, 2, 1\)"
    ):
        make(objects(data)[name])


@pytest.mark.slow
@pytest.mark.parametrize(
    "method, argument, package",
    [
        ("Volume.from_sitk", "0", "SimpleITK"),
        ("Volume.from_nibabel", "0", "nibabel"),
        ("Volume.from_vtk", "0", "vtkmodules"),
        ("Volume.from_pyvista", "0", "vtkmodules"),
        ("Volume.from_xarray", "0", "xarray"),
        ("Mesh.from_trimesh", "0", "trimesh"),
        ("Mesh.from_meshio", "0", "meshio"),
        ("Mesh.from_pyvista", "0", "vtkmodules"),
        ("read_mesh", "__file__ + '.stl'", "trimesh"),
    ],
)
def test_a_missing_library_is_named(tmp_path, method, argument, package):
    # None of them is imported along with isospline.
    script = tmp_path / "script.py"
    (tmp_path / "script.py.stl").write_text("solid", encoding="utf-8")
    libraries = ["SimpleITK", "meshio", "nibabel", "pyvista", "trimesh", "vtkmodules", "xarray"]
    # Files are read in another process, which looks for packages in the same folders.
    (tmp_path / f"{package}.py").write_text(f"raise ModuleNotFoundError(name={package!r})", encoding="utf-8")
    script.write_text(
        "import sys, isospline\n"
        f"assert not set({libraries}) & set(sys.modules)\n"
        f"sys.modules['{package}'] = None\n"
        f"isospline.{method}({argument})\n",
        encoding="utf-8",
    )
    result = subprocess.run([sys.executable, script], capture_output=True, encoding="utf-8")
    assert result.returncode == 1
    assert f"needs the package {package}" in result.stderr.replace("vtkmodules.vtkCommonDataModel", "vtkmodules")
    assert "pip install isospline[" in result.stderr


@pytest.mark.parametrize("dtype", [">f4", ">i2", "<f8", "f2", ">f2", "u1", "?"])
def test_a_grid_of_pyvista_has_samples_of_its_own(dtype):
    samples = np.arange(24).reshape(2, 3, 4).astype(dtype)
    before = samples.copy()
    grid = isospline.VolumeData(samples).to_pyvista()
    np.testing.assert_array_equal(grid["values"], before.ravel())
    grid["values"][:] = 1
    np.testing.assert_array_equal(samples, before)


def test_the_active_scalars_come_before_an_array_without_a_name(data):
    vtk = pytest.importorskip("vtkmodules.util.numpy_support")
    image = vtk_image(data)
    image.GetPointData().AddArray(vtk.numpy_to_vtk(np.full(data.size, 7.0), deep=True))
    assert isospline.Volume.from_vtk(image).sample(ORIGIN) == pytest.approx(data[0, 0, 0], abs=1e-5)
