"""Pickling, copying, equality and replacing: objects are the same after they are sent to another process."""

import concurrent.futures
import copy
import dataclasses
import multiprocessing
import pickle
import subprocess
import sys

import numpy as np
import pytest
from hit_outputs import ALL_OUTPUTS
from spheres import CENTER, mesh_sphere, moved, sphere

import isospline
from isospline import volumes
from isospline.base.values import parts, value_types

FIELD = volumes.torus()


def make_volume(**options):
    return isospline.Volume(FIELD.values((12, 13, 14)), **{**FIELD.grid((12, 13, 14)), **options})


VOLUME = make_volume()
VALUES = [
    isospline.AmbientOcclusion(8, distance=2.0, color="teal", opacity=0.5, cap_color=isospline.ColorByNormal()),
    isospline.Box((-1, -2, -np.inf), (1, 2, 3)),
    isospline.ColorByCurvature("gaussian", limits=(-1, 2)),
    isospline.ColorByDepth(),
    isospline.ColorByDepth([(0, 0, 0), (1, 1, 1)], limits=(1, 2)),
    isospline.ColorByDistance(isospline.Isosurface(VOLUME, FIELD.level), limits=(-1, 2), label="deviation"),
    isospline.ColorByNormal(),
    isospline.ColorByThickness(),
    isospline.ColorByThickness(surface=isospline.Isosurface(VOLUME, FIELD.level), ripple=0.1, method="max_sphere"),
    isospline.ColorByValue(),
    isospline.ColorByValue([(0, 0, 0), (1, 1, 1)], limits=(1, 2), label="pressure in Pa"),
    isospline.ColorByVolume(
        VOLUME, limits=(0, 1), transform=[(2, 0.1, 0, 3), (0, 1.7, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)]
    ),
    isospline.DirectionalLight((1, 2, 3), intensity=(1, 2, 3), angle=0.5),
    isospline.EnvironmentLight(0.3, image=np.random.default_rng(1).random((4, 8, 3)), visible=True),
    isospline.HalfSpace((0.1, 0.2, 0.3), (1, 2, 3)),
    isospline.Material((0.1, 0.2, 0.3), metallic=0.25, roughness=0.75, specular=1, cap_color=0.5),
    isospline.Measurement(1.0, 0.5),
    isospline.OrthographicCamera((0, -9, 0.3), (0, 0, 0), height=3),
    isospline.Outline(3, color=isospline.ColorByDepth(), surface_color=(0, 0, 1), opacity=0.25),
    isospline.PanoramicCamera((0, 0.1, 0), (0, 1, 0)),
    isospline.PathTracer(
        isospline.Material(0.3),
        materials={3: isospline.Material(0.1)},
        max_bounces=3,
        seed=2**31 + 5,
        lights=[isospline.SphereLight((0, 0, 3), 1.0), isospline.EnvironmentLight(0.2)],
    ),
    isospline.PerspectiveCamera((0, -9, 0.3), (0, 0, 0), field_of_view=25, field_of_view_axis="diagonal"),
    isospline.PerspectiveCamera((0, -9, 0.3), (0, 0, 0), aperture_radius=0.1, focus_distance=8),
    isospline.Phong(color=isospline.ColorByVolume(VOLUME), lights=[isospline.PositionalLight((0, 0, 3))], shadows=True),
    isospline.Phong(lights=[]),
    isospline.PositionalLight((1, 2, 3), intensity=4),
    isospline.ProjectionPlaneCamera((0, -5, 0), corner=(-0.8, 0, 0.45), right=(1.6, 0, 0), down=(0, 0, -0.9)),
    isospline.RectangleLight((0, 0, 1), (1, 0, 0), (0, 1, 0), radiance=(1, 2, 3)),
    isospline.SphereLight((0, 0, 3), 0.7),
]


def out_of_band(value):
    """The object after pickling with protocol 5, and its out-of-band buffers."""
    buffers = []
    stream = pickle.dumps(value, protocol=5, buffer_callback=buffers.append)
    return pickle.loads(stream, buffers=[bytearray(buffer.raw()) for buffer in buffers]), stream, buffers


WAYS = {
    **{
        f"protocol {number}": lambda value, number=number: pickle.loads(pickle.dumps(value, number))
        for number in range(2, pickle.HIGHEST_PROTOCOL + 1)
    },
    "out of band": lambda value: out_of_band(value)[0],
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
}


def test_every_type_of_value_is_tried():
    kinds = {kind for kind in value_types() if kind.__name__ != "PathTracer"}
    assert {type(value) for value in VALUES} == kinds | {isospline.Measurement, isospline.PathTracer}


LOOKS = (
    isospline.Phong(color="tomato", lights=[isospline.PositionalLight((0, 0, 3))]),
    isospline.Outline(color=0.2, surface_color="gold"),
    isospline.AmbientOcclusion(8, color=isospline.ColorByNormal()),
    isospline.Material("gold", metallic=1),
)


@pytest.mark.parametrize("look", LOOKS, ids=lambda look: type(look).__name__)
def test_looks_are_replaced_like_other_dataclasses(look):
    changed = dataclasses.replace(look, opacity=0.5)
    ours = look.replace(opacity=0.5)
    assert changed.opacity == 0.5 and look.opacity == 1.0 and repr(changed) == repr(ours)
    if isinstance(look.color, np.ndarray):
        np.testing.assert_allclose(changed.color, look.color, rtol=0, atol=1e-12)
    with pytest.raises(dataclasses.FrozenInstanceError):
        look.opacity = 0.5


def test_a_plane_is_moved_by_its_center():
    camera = isospline.ProjectionPlaneCamera((0, -5, 0), center=(0, 0, 0), right=(1.6, 0, 0), down=(0, 0, -0.9))
    moved = camera.replace(center=(1, 0, 0))
    np.testing.assert_allclose(moved.corner, camera.corner + (1, 0, 0), rtol=0, atol=1e-15)
    assert dataclasses.replace(camera, eye=(0, -6, 0)) == camera.replace(eye=(0, -6, 0))


def test_the_focus_follows_the_target_unless_it_is_given():
    camera = isospline.PerspectiveCamera((0, -10, 0), (0, 0, 0))
    assert camera.focus_distance == 10 and camera.replace(target=(0, 5, 0)).focus_distance == 15
    given = camera.replace(focus_distance=9)
    assert given.focus_distance == given.replace(target=(0, 5, 0)).focus_distance == 9


def test_copies_of_python_313_are_replaced_by_parameters():
    replaced = getattr(copy, "replace", lambda value, **changes: value.__replace__(**changes))
    camera = isospline.PerspectiveCamera((0, -10, 0), (0, 0, 0), aperture_radius=0.1)
    assert replaced(camera) == camera and replaced(camera, eye=(0, -20, 0)).focus_distance == 20
    plane = isospline.ProjectionPlaneCamera((0, -5, 0), center=(0, 0, 0), right=(1.6, 0, 0), down=(0, 0, -0.9))
    assert replaced(plane, center=(1, 0, 0)) == plane.replace(center=(1, 0, 0))
    for look in LOOKS:
        assert replaced(look) == look


@pytest.mark.parametrize("value", VALUES, ids=lambda value: type(value).__name__)
def test_values_arrive_as_they_were(value):
    for way in WAYS.values():
        arrived = way(value)
        assert type(arrived) is type(value) and repr(arrived) == repr(value)
        assert arrived == value and (arrived != value) is False and hash(arrived) == hash(value)


@pytest.mark.parametrize("value", VALUES, ids=lambda value: type(value).__name__)
def test_values_differ_in_every_part(value):
    assert value != "another" and value != 3 and value is not None
    assert value.replace() == value
    others = [each for each in VALUES if each is not value]
    assert all(value != other for other in others)
    changes = {
        "opacity": 0.125,
        "eye": (1, -7, 2),
        "intensity": 7,
        "radiance": 7,
        "seed": 1,
        "roughness": 0.125,
        "exponent": 9.0,
        "limits": (5, 6),
        "point": (9, 9, 9),
        "maximum": (7, 8, 9),
        "height": 7.0,
        "radius": 0.25,
        "samples": 9,
    }
    for name in parts(value):
        if name in changes:
            changed = value.replace(**{name: changes[name]})
            assert changed != value and type(changed) is type(value)
            np.testing.assert_array_equal(
                getattr(changed, name), np.broadcast_to(changes[name], np.shape(getattr(changed, name)))
            )
            assert changed.replace(**{name: parts(value)[name]}) == value


def test_derived_values_are_taken_for_those_that_they_derive_from():
    class Box(isospline.HalfSpace):  # the name of another value
        pass

    data = np.random.default_rng(0).random((6, 6, 6))
    plane, side, box = (2, 2, 2), (0, 0, 1), isospline.Box((1, 1, 1), (4, 4, 4))
    for derived, known in ((Box(plane, side), isospline.HalfSpace(plane, side)), (box, box)):
        surfaces = [isospline.Isosurface(data, 0.5, clip=each) for each in (derived, known)]
        assert surfaces[0].area() == surfaces[1].area()
    assert pickle.loads(pickle.dumps(box)) == box


def test_replacing_an_unknown_field():
    with pytest.raises(TypeError, match="^colour: expected a parameter of Phong .*did you mean color"):
        isospline.Phong().replace(colour=1)
    camera = isospline.ProjectionPlaneCamera((0, -5, 0), center=(0, 0, 0), right=(1.6, 0, 0), down=(0, 0, -0.9))
    np.testing.assert_allclose(camera.replace(center=(1, 0, 0)).corner, camera.corner + (1, 0, 0))


def test_a_focus_on_the_target_follows_the_target():
    camera = isospline.PerspectiveCamera((0, -9, 0), (0, 0, 0), aperture_radius=0.1)
    assert pickle.loads(pickle.dumps(camera)).replace(target=(0, 1, 0)).focus_distance == 10


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"degree": 0},
        {"degree": 3, "boundary": "periodic"},
        {"filter": "smoothing", "smoothing": 0.5, "degree": 5},
        {"direction": [(0, -1, 0), (1, 0, 0), (0, 0.1, 1)], "origin": (1, 2, 3), "spacing": 0.3},
    ],
)
@pytest.mark.parametrize("way", WAYS)
def test_volumes_arrive_as_they_were(options, way, rng):
    volume = make_volume(**options)
    arrived = WAYS[way](volume)
    for name in ("shape", "axes", "degree", "boundary", "filter", "smoothing", "minimum", "maximum", "memory"):
        assert getattr(arrived, name) == getattr(volume, name)
    for name in ("coefficients", "affine", "bounds", "spacing", "origin", "direction"):
        np.testing.assert_array_equal(getattr(arrived, name), getattr(volume, name))
    points = rng.uniform(-2, 2, (100, 3))
    for derivative in (0, 1, 2):
        np.testing.assert_array_equal(
            arrived.sample(points, derivative=derivative), volume.sample(points, derivative=derivative)
        )


def test_arrays_of_the_other_order_arrive():
    data = FIELD.values((12, 13, 14)).T
    volume = isospline.Volume(data, axes="xyz")
    arrived = pickle.loads(pickle.dumps(volume))
    assert arrived.shape == (14, 13, 12) and arrived.axes == "xyz"
    np.testing.assert_array_equal(arrived.coefficients, volume.coefficients)


def test_coefficients_travel_out_of_band():
    volume = isospline.Volume(np.random.default_rng(0).random((64, 64, 64), np.float32))
    _, stream, buffers = out_of_band(volume)
    assert len(stream) < 2000
    assert sum(len(buffer.raw()) for buffer in buffers) >= 4 * 64**3
    scene = isospline.Scene([isospline.Isosurface(volume, 0.5), isospline.Isosurface(volume, 0.6)])
    _, stream, buffers = out_of_band(scene)
    assert len(stream) < 10000 and sum(len(buffer.raw()) > 4 * 64**3 for buffer in buffers) == 1


def test_equal_volumes_have_equal_pickles():
    one, other = (pickle.dumps(make_volume()) for _ in range(2))
    assert one == other


SURFACES = {
    "plain": {},
    "masked": {"mask": np.random.default_rng(0).random((12, 13, 14)) < 0.9},
    "capped": {
        "clip": [isospline.Box((-1, -1, -0.3), (0.5, 1, 1)), isospline.HalfSpace((0, 0, 0), (1, 2, 0.3))],
        "capped": True,
    },
    "closed": {"closed": True},
    "other": {
        "prune_depth": 0,
        "prune_border": False,
        "method": "reference",
        "inside": "below",
        "material": isospline.Material(0.25),
    },
}


def rays_at(bounds, count=400):
    generator = np.random.default_rng(3)
    center, radius = bounds.mean(0), np.linalg.norm(bounds[1] - bounds[0])
    origins = center + radius * generator.normal(size=(count, 3))
    towards = generator.uniform(bounds[0], bounds[1], (count, 3))
    return np.concatenate([origins, towards - origins], axis=1)


def assert_same_hits(one, other, rays):
    expected, found = (scene.cast_rays(rays, outputs=ALL_OUTPUTS) for scene in (one, other))
    assert np.isfinite(expected.t_hit).sum() > 20
    for name in ALL_OUTPUTS:
        np.testing.assert_array_equal(found[name], expected[name])


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("options", SURFACES)
def test_surfaces_arrive_as_they_were(options, way):
    surface = isospline.research.isosurface(VOLUME, FIELD.level, **SURFACES[options])
    surface.level = 0.01
    arrived = WAYS[way](surface)
    for name in ("level", "prune_depth", "prune_border", "method", "inside", "capped", "closed", "material"):
        assert getattr(arrived, name) == getattr(surface, name)
    np.testing.assert_array_equal(arrived.shell.cells, surface.shell.cells)
    np.testing.assert_array_equal(arrived.bounds, surface.bounds)
    assert_same_hits(isospline.Scene(surface), isospline.Scene(arrived), rays_at(surface.bounds))
    arrived.level = 0.02
    assert surface.level == 0.01
    assert (arrived.volume is VOLUME) == (way in ("copy", "deepcopy"))


@pytest.mark.parametrize("way", WAYS)
def test_scenes_arrive_as_they_were(way):
    ball, mesh = sphere(), mesh_sphere(5.0, 32)
    scene = isospline.Scene([ball, mesh], build_quality="low")
    scene.add(ball, moved(*(CENTER + (20, 0, 0))), casts_shadow=False)
    scene.add(mesh, moved(*(CENTER + (0, 20, 0))), visible=False)
    scene.remove(1)
    arrived = WAYS[way](scene)
    assert arrived.ids == scene.ids == [0, 2, 3]
    assert arrived.build_quality == "low"
    for id in scene.ids:
        np.testing.assert_array_equal(arrived.transform(id), scene.transform(id))
        assert arrived.visibility(id) == scene.visibility(id)
    assert arrived.object(0) is arrived.object(2)
    assert (arrived.object(0) is ball) == (way == "copy")
    rays = rays_at(scene.bounds)
    assert_same_hits(scene, arrived, rays)
    np.testing.assert_array_equal(arrived.test_occlusions(rays), scene.test_occlusions(rays))
    arrived.remove(0)
    assert 0 in scene


@pytest.mark.parametrize("way", WAYS)
def test_meshes_arrive_as_they_were(way, rng):
    mesh = isospline.Mesh(
        rng.random((9, 3)),
        rng.integers(0, 9, (7, 3)),
        rng.normal(size=(9, 3)),
        rng.random((9, 3)),
        isospline.Material(0.1),
    )
    for each in (mesh, isospline.Mesh(mesh.vertices, mesh.faces)):
        arrived = WAYS[way](each)
        for name in ("vertices", "faces", "normals", "colors"):
            np.testing.assert_array_equal(getattr(arrived, name), getattr(each, name))
        assert arrived.material == each.material


@pytest.mark.parametrize(
    "options",
    [
        {"layers": ("depth", "normal", "primitive_ids", "curvature")},
        {"encoding": "srgb8"},
        {"light": isospline.PathTracer(), "layers": ("variance",)},
    ],
)
def test_images_arrive_as_they_were(options, tmp_path):
    scene = isospline.Scene(isospline.Isosurface(VOLUME, FIELD.level))
    image = isospline.render(scene, size=(24, 18), **options)
    for way in WAYS.values():
        arrived = way(image)
        assert arrived == image and repr(arrived) == repr(image) and arrived.layers == image.layers
        np.testing.assert_array_equal(arrived.to_srgb(), image.to_srgb())
        for name in image.layers:
            np.testing.assert_array_equal(getattr(arrived, name), getattr(image, name))
        np.testing.assert_array_equal(arrived.world_to_ndc, image.world_to_ndc)
        arrived.to_srgb()[...] = 0
        if "encoding" not in options:
            for name, each in (("a", image), ("b", arrived)):
                each.write(tmp_path / f"{name}.exr")
            assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()
            arrived.color[0, 0, 0] += 1
            assert arrived != image


def test_hoppers_results_and_fields_travel():
    surface = isospline.Isosurface(VOLUME, FIELD.level)
    rays = rays_at(surface.bounds)
    hopper = pickle.loads(pickle.dumps(isospline.research.VoxelHopper(surface, strides=True)))
    assert hopper.strides
    hits = hopper.cast_rays(rays)
    arrived = pickle.loads(pickle.dumps(hits))
    assert type(arrived) is isospline.Hits
    np.testing.assert_array_equal(arrived.t_hit, isospline.Scene(surface).cast_rays(rays).t_hit)
    data = isospline.VolumeData(np.zeros((2, 3, 4)), spacing=(1, 2, 3))
    assert pickle.loads(pickle.dumps(data)).spacing == (1, 2, 3)


def first_hits(scene, rays):
    """Other processes run this."""
    return scene.cast_rays(rays)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_other_processes_cast_rays(method):
    scene = isospline.Scene([sphere(), mesh_sphere(5.0)])
    rays = rays_at(scene.bounds)
    expected = scene.cast_rays(rays)
    context = multiprocessing.get_context(method)
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=context) as pool:
        for hits, rows in zip(pool.map(first_hits, [scene] * 2, np.split(rays, 2)), np.split(np.arange(len(rays)), 2)):
            for name, array in hits.items():
                np.testing.assert_array_equal(array, expected[name][rows])


@pytest.mark.slow
def test_joblib_casts_rays():
    joblib = pytest.importorskip("joblib")
    scene = isospline.Scene([sphere()])
    rays = rays_at(scene.bounds)
    parts_of_rays = np.array_split(rays, 3)
    found = joblib.Parallel(n_jobs=2)(joblib.delayed(first_hits)(scene, each) for each in parts_of_rays)
    np.testing.assert_array_equal(np.concatenate([hits.t_hit for hits in found]), scene.cast_rays(rays).t_hit)


def test_dask_casts_rays_on_processes():
    dask = pytest.importorskip("dask")
    scene = isospline.Scene([sphere()])
    rays = rays_at(scene.bounds)
    tasks = [dask.delayed(first_hits)(scene, each) for each in np.array_split(rays, 3)]
    found = dask.compute(*tasks, scheduler="processes", num_workers=1)
    np.testing.assert_array_equal(np.concatenate([hits.t_hit for hits in found]), scene.cast_rays(rays).t_hit)


UNMADE = """
import pickle, sys
import isospline
from isospline import _core, research, scene

surface = isospline.Isosurface(isospline.volumes.sphere().volume(6), 0.0)
for protocol in (0, 1):
    for each in (surface, surface.volume, isospline.Scene(surface)):
        assert type(pickle.loads(pickle.dumps(each, protocol))) is type(each)
derived = [isospline.Volume, isospline.Isosurface, isospline.Mesh, isospline.Scene, scene.Shell, research.VoxelHopper]
compiled = {each.__name__: each for each in vars(_core).values() if type(each).__name__ == "pybind11_type"}
for kind in derived:
    assert issubclass(kind, compiled[kind.__name__])
    try:
        compiled[kind.__name__]()
        raise AssertionError(kind)
    except TypeError as error:
        assert "derived" in str(error), error
kinds = [*derived, *(kind for name, kind in compiled.items() if name not in [each.__name__ for each in derived])]
assert len(kinds) > 8
accepting = {
    "Volume": lambda volume: isospline.Isosurface(volume, 0.0),
    "Isosurface": isospline.Scene,
    "Mesh": isospline.Scene,
}
names, uses = [], 0
for kind in kinds:
    stateless = b"\\x80\\x04c" + f"{kind.__module__}\\n{kind.__qualname__}\\n".encode() + b")\\x81."
    for each in (kind.__new__(kind), pickle.loads(stateless)):
        for protocol in (0, 2):
            try:
                pickle.dumps(each, protocol)
            except TypeError as error:
                assert "not initialized" in str(error) or "cannot be pickled" in str(error), error
        for name in dir(kind):
            if isinstance(getattr(kind, name), property):
                try:
                    getattr(each, name)
                except TypeError as error:
                    assert str(error).endswith("got one that was not initialized"), error
                    uses += 1
    if kind.__name__ in accepting:
        try:
            accepting[kind.__name__](kind.__new__(kind))
        except TypeError as error:
            assert "not initialized" in str(error), error
            names.append(kind.__name__)
assert sorted(names) == sorted(accepting), names
assert uses > 100, uses
"""


def test_objects_that_were_never_initialized_raise():
    """From `__new__` alone, or from a pickle without a state."""
    done = subprocess.run([sys.executable, "-c", UNMADE], capture_output=True, encoding="utf-8", check=False)
    assert done.returncode == 0, (done.returncode, done.stderr)


class OwnVolume(isospline.Volume):
    def __init__(self, size):
        super().__init__(
            isospline.volumes.sphere().value(np.moveaxis(np.mgrid[-1 : 1 : size * 1j, -1:1:8j, -1:1:9j], 0, -1))
        )
        self.size = size


class OwnSurface(isospline.Isosurface):
    def __init__(self, volume):
        super().__init__(volume, 0.0)
        self.note = "own"


class OwnMesh(isospline.Mesh):
    def __init__(self):
        super().__init__([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], color="red")
        self.note = "own"


class OwnScene(isospline.Scene):
    def __init__(self, surface):
        super().__init__(surface)
        self.note = "own"


@pytest.mark.parametrize("protocol", [0, 2, 5])
def test_derived_classes_arrive_with_their_attributes(protocol):
    volume = OwnVolume(7)
    surface = OwnSurface(volume)
    for given in (volume, surface, OwnMesh(), OwnScene(surface)):
        arrived = pickle.loads(pickle.dumps(given, protocol))
        assert type(arrived) is type(given) and vars(arrived) == vars(given)
    assert type(copy.copy(surface)) is OwnSurface and copy.copy(surface).note == "own"
    assert type(copy.copy(OwnScene(surface))) is OwnScene
    assert volume.adjoint([0], [1.0]).shape == volume.shape == pickle.loads(pickle.dumps(volume)).shape
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(OwnMesh())).color, (1, 0, 0))
