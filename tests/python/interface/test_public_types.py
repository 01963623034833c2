"""Each public type goes through pickle, copy and equality. The types are found in the public modules."""

import copy
import importlib
import inspect
import pickle
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest

import isospline
from isospline import volumes

MODULES = (
    "isospline",
    *(f"isospline.{name}" for name in ("base.results", "io", "research", "store", "viewer", "volumes")),
)

FIELD = volumes.torus()
VOLUME = FIELD.volume(20)
RAYS = np.random.default_rng(0).normal(size=(30, 6))


def make_surface():
    return isospline.Isosurface(VOLUME, FIELD.level)


def make_mesh():
    ball = make_surface().to_mesh()
    attributes = dict(normals=ball.normals, colors=0.5 + 0.5 * ball.normals, values=ball.vertices[:, 0])
    return isospline.Mesh(ball.vertices, ball.faces, values_name="x of it", **attributes)


def make_scene():
    return isospline.Scene(make_surface())


def make_labels():
    data = np.zeros((8, 9, 10), np.uint8)
    data[2:6, 2:6, 2:5], data[2:6, 2:6, 5:8] = 1, 2
    return isospline.Labels(data, names={2: "right"})


def make_store(folder):
    pytest.importorskip("zarr")
    return isospline.store.read_metadata(isospline.convert(FIELD.values(20), folder / "store.zarr"))


def make_hopper():
    hopper = isospline.research.VoxelHopper(make_surface())
    hopper.cast_rays(RAYS)
    return hopper


def make_viewer():
    pytest.importorskip("websockets")
    return isospline.viewer.Viewer()


#: Equal if their parts are, with the same hash.
VALUES = {
    "AmbientOcclusion": lambda _: isospline.AmbientOcclusion(8, distance=2.0),
    "Box": lambda _: isospline.Box((-1, -2, -np.inf), (1, 2, 3)),
    "ColorByCurvature": lambda _: isospline.ColorByCurvature("gaussian", limits=(-1, 2)),
    "ColorByDepth": lambda _: isospline.ColorByDepth(limits=(1, 2)),
    "ColorByDistance": lambda _: isospline.ColorByDistance(isospline.Isosurface(VOLUME, FIELD.level), limits=(1, 2)),
    "ColorByNormal": lambda _: isospline.ColorByNormal(),
    "ColorByThickness": lambda _: isospline.ColorByThickness(limits=(1, 2)),
    "ColorByValue": lambda _: isospline.ColorByValue(limits=(0, 1)),
    "ColorByVolume": lambda _: isospline.ColorByVolume(VOLUME, limits=(0, 1)),
    "DirectionalLight": lambda _: isospline.DirectionalLight((1, 2, 3)),
    "EnvironmentLight": lambda _: isospline.EnvironmentLight(0.3, image=np.ones((4, 8, 3))),
    "Field": lambda _: volumes.torus(0.5),
    "HalfSpace": lambda _: isospline.HalfSpace((0.1, 0.2, 0.3), (1, 2, 3)),
    "Material": lambda _: isospline.Material((0.1, 0.2, 0.3), metallic=0.25),
    "Measurement": lambda _: make_surface().area(),
    "OrthographicCamera": lambda _: isospline.OrthographicCamera((0, -9, 0.3), (0, 0, 0), height=3),
    "Outline": lambda _: isospline.Outline(3, surface_color=(0, 0, 1)),
    "PanoramicCamera": lambda _: isospline.PanoramicCamera((0, 0.1, 0), (0, 1, 0)),
    "PathTracer": lambda _: isospline.PathTracer(materials={3: isospline.Material(0.1)}),
    "PerspectiveCamera": lambda _: isospline.PerspectiveCamera((0, -9, 0.3), (0, 0, 0), field_of_view=25),
    "Phong": lambda _: isospline.Phong(lights=[isospline.PositionalLight((0, 0, 3))]),
    "PositionalLight": lambda _: isospline.PositionalLight((1, 2, 3), intensity=4),
    "ProjectionPlaneCamera": lambda _: isospline.ProjectionPlaneCamera(
        (0, -5, 0), corner=(-0.8, 0, 0.45), right=(1.6, 0, 0), down=(0, 0, -0.9)
    ),
    "RectangleLight": lambda _: isospline.RectangleLight((0, 0, 1), (1, 0, 0), (0, 1, 0)),
    "SphereLight": lambda _: isospline.SphereLight((0, 0, 3), 0.7),
    "Studio": lambda _: isospline.Studio(),
}

#: Equal if their arrays are; without a hash.
RESULTS = {
    "ClosestPoints": lambda _: make_surface().closest_points(RAYS[:, :3], max_distance=0.5),  # some are NaN
    "Components": lambda _: make_surface().components(measured=True),
    "Crossings": lambda _: make_scene().list_intersections(RAYS),
    "Hits": lambda _: make_scene().cast_rays(RAYS, outputs=("t_hit", "positions")),  # some miss: NaN
    "HopStatistics": lambda _: make_hopper().statistics,
    "Image": lambda _: isospline.render(make_scene(), size=(16, 12), light="phong"),
    "LabelComparison": lambda _: make_labels().compare(isospline.Labels(make_labels().data % 2)),  # some are NaN
    "LabelMeasures": lambda _: make_labels().measure(),
    "LabelTable": lambda _: make_labels().table(),
    "LeftOut": lambda _: make_surface().to_mesh(0.1, return_report=True)[1].left_out,
    "LevelMeasures": lambda _: isospline.measure(make_surface(), [-0.05, 0.0]),
    "MeshReport": lambda _: make_surface().to_mesh(0.1, return_report=True)[1],
    "Paging": lambda folder: isospline.open_volume(make_store(folder).path).paging,
    "PrintReport": lambda _: make_surface().to_print_mesh(0.1)[1],
    "SurfaceDistance": lambda _: isospline.surface_distance(
        make_surface(), isospline.Isosurface(VOLUME, -0.05), samples=50
    ),
    "SurfaceSamples": lambda _: make_surface().sample_points(9),
    "Visibility": lambda _: make_scene().visibility(0),
}

#: Equal to themselves only: large, or changing. They are compared by some of their parts.
OBJECTS = {
    "Cancelled": (lambda _: isospline.Cancelled("stopped"), lambda each: each.args),
    "Isosurface": (lambda _: make_surface(), lambda each: (each.level, each.volume.coefficients.tobytes())),
    "Labels": (lambda _: make_labels(), lambda each: (each.data.tobytes(), each.names, each.colors.tobytes())),
    "ScaleMetadata": (lambda folder: make_store(folder).scales[0], lambda each: (each.path, each.shape, each.spacing)),
    "Mesh": (
        lambda _: make_mesh(),
        lambda each: (
            *(getattr(each, name).tobytes() for name in ("vertices", "faces", "normals", "colors", "values")),
            each.values_name,
            each.material,
        ),
    ),
    "RayMeshIntersector": (
        lambda _: isospline.RayMeshIntersector(make_surface()),
        lambda each: each.intersects_any(RAYS[:, :3], RAYS[:, 3:]).tobytes(),
    ),
    "Scene": (lambda _: make_scene(), lambda each: each.cast_rays(RAYS).t_hit.tobytes()),
    "StoreMetadata": (make_store, lambda each: (each.path, each.degree, each.scales[0].path)),
    "Volume": (lambda _: VOLUME, lambda each: each.coefficients.tobytes()),
    "VolumeData": (
        lambda _: isospline.VolumeData(np.ones((2, 3, 4)), spacing=(1, 2, 3)),
        lambda each: (each.spacing, each.data.tobytes()),
    ),
    "VoxelHopper": (
        lambda _: isospline.research.VoxelHopper(make_surface()),
        lambda each: each.cast_rays(RAYS).t_hit.tobytes(),
    ),
}

#: They are at work, in threads or with samples that go on: pickle and copy say so.
AT_WORK = {
    "ProgressiveRenderer": lambda: isospline.ProgressiveRenderer(make_scene(), size=(16, 12)),
    "Viewer": make_viewer,
}


def public_types():
    """The classes in the public modules, by name."""
    found = {}
    for module in map(importlib.import_module, MODULES):
        for name in module.__all__:
            each = getattr(module, name)
            if inspect.isclass(each) and each.__module__.startswith("isospline"):
                assert found.setdefault(name, each) is each
    return found


def test_each_public_type_has_one_example():
    examples = [*VALUES, *RESULTS, *OBJECTS, *AT_WORK]
    assert sorted(examples) == sorted(public_types())


@pytest.mark.parametrize("name", sorted({**VALUES, **RESULTS, **OBJECTS}))
def test_public_types_arrive_as_they_were(name, tmp_path):
    make, parts = OBJECTS.get(name, ({**VALUES, **RESULTS}.get(name), None))
    given = make(tmp_path)
    assert given == given and (given != given) is False and given != "another"
    for way in (lambda each: pickle.loads(pickle.dumps(each)), copy.copy, copy.deepcopy):
        arrived = way(given)
        assert type(arrived) is type(given) is public_types()[name]
        if name in OBJECTS:
            assert parts(arrived) == parts(given) and (arrived == given) is (arrived is given)
            continue
        assert arrived == given and given == arrived and (arrived != given) is False and repr(arrived) == repr(given)
        if name in VALUES:
            assert hash(arrived) == hash(given) and copy.copy(given) is given
        else:
            with pytest.raises(TypeError, match="unhashable"):
                hash(given)


@pytest.mark.parametrize("name", AT_WORK)
def test_what_is_at_work_is_not_copied(name):
    given = AT_WORK[name]()
    try:
        for act in (pickle.dumps, copy.deepcopy):
            with pytest.raises(TypeError, match="pickle"):
                act(given)
    finally:
        if name == "Viewer":
            given.close()


def test_results_and_measurements_differ_in_a_number():
    scene, hits = make_scene(), make_scene().cast_rays(RAYS)
    assert hits == scene.cast_rays(RAYS) and hits != scene.cast_rays(RAYS + 0.01) and hits != {}
    assert isospline.Measurement(1.0, 0.5) == isospline.Measurement(1.0, 0.5) != isospline.Measurement(1.0, 0.25)
    assert volumes.torus() == volumes.torus(0.6, minor=0.25) != volumes.torus(0.5) and volumes.torus() != FIELD.value


@pytest.mark.parametrize("second", [2.0, np.float64(2.0), 2, isospline.Measurement(2.0, 0.25)])
def test_measurements_are_ordered_by_their_numbers(second):
    for value in (1.0, 2.0, 3.0, float("nan")):
        first = isospline.Measurement(value, 0.5)
        number = float(second)
        assert (first < second, first <= second) == (value < number, value <= number)
        assert (first > second, first >= second) == (value > number, value >= number)
        assert (second < first, second <= first) == (number < value, number <= value)


def test_powers_and_errors_of_measurements():
    nothing = isospline.Measurement(0.0, 0.5)
    assert nothing**2 == isospline.Measurement(0.0, 0.0) and nothing**1 == nothing
    assert nothing**0.5 == isospline.Measurement(0.0, float("inf"))
    assert isospline.Measurement(0.0) ** 0.5 == isospline.Measurement(0.0)
    assert isospline.Measurement(-2.0, 0.5) ** 3 == isospline.Measurement(-8.0, 6.0)
    with pytest.raises(ValueError, match=r"^value: expected at least 0 for a power that is not whole, got -8 \*\* 0.5"):
        isospline.Measurement(-8.0, 0.5) ** 0.5
    with pytest.raises(ValueError, match="^error: expected a number, at least 0, got -1"):
        isospline.Measurement(1.0, -1.0)


def test_quotients_of_measurements_are_rounded_once():
    for value in (49.0, 1e-180, 1e180):
        ratio = isospline.Measurement(value, 0.25 * value) / isospline.Measurement(value, 0.125 * value)
        assert ratio.value == 1.0 and abs(ratio.error - 0.375) < 1e-15
    assert 3 / isospline.Measurement(-10.0, 1.0) == isospline.Measurement(3 / -10, 0.03)
    with pytest.raises(ZeroDivisionError, match="division by zero"):
        isospline.Measurement(1.0) / 0


def measured(surface):
    """Another process runs this."""
    return surface.area(), isospline.surface_distance(surface, surface, samples=20)


def test_measurements_return_from_a_process():
    with ProcessPoolExecutor(1) as pool:
        assert pool.submit(measured, make_surface()).result() == measured(make_surface())
