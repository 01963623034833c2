"""Views and pieces of volumes for which nothing is said: bodies stand up, and all else keeps the usual view."""

import importlib.util
import itertools
import os
from pathlib import Path

import numpy as np
import pytest

import isospline
from isospline.cli.main import main
from isospline.io import VolumeData
from isospline.store import detail
from isospline.suggest import presentation
from isospline.suggest.presentation import suggested_surface
from isospline.suggest.view import SuggestedView

USUAL = SuggestedView()
SAMPLES = 64
TURNS = [(axes, signs) for axes in itertools.permutations(range(3)) for signs in itertools.product((1, -1), repeat=3)]


@pytest.fixture(scope="module")
def bodies(repository):
    """The bodies of an example by their names, and some of our own: values above 0 inside."""
    spec = importlib.util.spec_from_file_location("first_pictures", repository / "examples" / "015-first-pictures.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    points = grid(SAMPLES)
    x, y, z = np.moveaxis(points, -1, 0)
    found = module.bodies(points)
    saucer = np.minimum(0.05 - np.abs(z + 0.7), 0.85 - np.hypot(x, y))
    found["ball on a saucer"] = np.maximum(module.ball(points, 0, 0, -0.2, 0.45), saucer)
    found["cone"] = np.minimum(0.4 * (0.8 - z) - np.hypot(x, y), z + 0.7)
    return {name: np.clip(values * SAMPLES / 2, -1, 1).astype(np.float32) for name, values in found.items()}


def grid(samples):
    """Points (x, y, z) of [-1, 1]^3."""
    return np.stack(np.meshgrid(*[np.linspace(-1, 1, samples)] * 3, indexing="ij")[::-1], axis=-1)


def turned(values, axes, signs):
    """The array with its axes exchanged and reversed."""
    return np.ascontiguousarray(np.transpose(values, axes)[tuple(slice(None, None, sign) for sign in signs)])


def turned_back(vector, axes, signs):
    """A vector (x, y, z) of a turned array in the coordinates before the turn."""
    along = np.zeros(3)
    along[list(axes)] = np.asarray(vector)[::-1] * signs
    return along[::-1]


@pytest.mark.sweep(4)
@pytest.mark.parametrize("turn", TURNS[::5], ids=str)
def test_a_head_faces_the_eye_with_its_neck_below(bodies, turn):
    volume = isospline.Volume(turned(bodies["head"], *turn))
    found = isospline.suggest_view(volume)
    np.testing.assert_array_equal(turned_back(found.up, *turn), [0, 0, 1])
    towards = turned_back(found.view, *turn)
    np.testing.assert_allclose(towards[1:], [-1, 0.3])
    assert abs(towards[0]) == 0.45  # an exchange of axes mirrors it
    camera = isospline.camera_for(isospline.Isosurface(volume, 0.0))
    np.testing.assert_allclose(camera.world_to_camera[2, :3], -np.array(found.view) / np.linalg.norm(found.view))
    assert "head" in found.reason or found == USUAL


@pytest.mark.sweep(5)
@pytest.mark.parametrize("turn", TURNS[::7], ids=str)
@pytest.mark.parametrize("name", ["bottle", "bone"])
def test_what_lies_on_a_plate_is_shown_without_it(bodies, name, turn):
    upward, plate_side = {"bottle": ([0, 0, 1], -0.8), "bone": ([0, -1, 0], 0.5)}[name]
    volume = isospline.Volume(turned(bodies[name], *turn), spacing=(2 / 63,) * 3, origin=(-1, -1, -1))
    found = isospline.suggest_view(volume)
    np.testing.assert_array_equal(turned_back(found.up, *turn), upward)
    surface = suggested_surface(volume)
    extent = np.sort(surface.bounds @ np.array(found.up))
    assert extent[0] > (-0.92 if name == "bottle" else -0.6), extent  # the plate itself is lower
    mask = isospline.suggest_mask(volume)
    assert mask.shape == volume.shape and 0 < np.count_nonzero(~mask) < 0.3 * mask.size


@pytest.mark.parametrize("is_patient", [False, True])
def test_the_order_of_axes_does_not_matter(is_patient):
    z, y, x = np.mgrid[0:40, 0:44, 0:52]
    values = np.where((z - 22) ** 2 + 1.3 * (y - 18) ** 2 + (x - 19) ** 2 < 150, 100.0, -1000.0 if is_patient else 0.0)
    values[1:4] = 100
    volumes = [
        isospline.Volume(values, patient=is_patient),
        isospline.Volume(values.T, axes="xyz", patient=is_patient),
    ]
    masks = [isospline.suggest_mask(volume) for volume in volumes]
    np.testing.assert_array_equal(masks[1], masks[0].T)
    assert not masks[0].all() and isospline.suggest_view(volumes[0]) == isospline.suggest_view(volumes[1])
    pictures = [isospline.render(volume, size=(24, 18)).color for volume in volumes]
    np.testing.assert_array_equal(*pictures)


@pytest.mark.parametrize("hot", [[(0, 20, 30)], [(0, 20, 30), (0, 20, 31)]])
def test_hot_samples_at_the_border_are_no_plate(rng, hot):
    values = rng.normal(100, 3, (20, 25, 40)).astype(np.uint16)
    for each in hot:
        values[each] = 65535
    assert isospline.render(isospline.Volume(values), size=(20, 20)).size == (20, 20)


@pytest.mark.parametrize("thickness", [7, 8, 9, 10])
def test_no_sheet_of_a_plate_is_left(thickness):
    """The rules look at every fourth sample, so the end of the plate is between two of those that they look at."""
    z, y, x = np.mgrid[0:386, 0:64, 0:64]
    values = (((z - 190) / 60) ** 2 + ((y - 32) / 12) ** 2 + ((x - 32) / 12) ** 2 < 1).astype(np.uint8)
    values[2 : 2 + thickness] = 1
    for turned in (values, values[::-1]):
        volume = isospline.Volume(turned, degree=1)
        surface = isospline.Isosurface(volume, 0.5, mask=isospline.suggest_mask(volume))
        assert len(surface.components().inside_counts) == 1
        assert np.ptp(surface.bounds[:, 2]) == pytest.approx(120, abs=2)


def test_a_plate_that_ends_within_the_volume_is_kept(bodies):
    volume = isospline.Volume(bodies["ball on a saucer"][::-1])
    assert isospline.suggest_mask(volume) is None
    assert isospline.suggest_view(volume).up == (0, 0, -1)


def test_a_head_is_shown_without_the_holder_that_touches_it(bodies):
    points = grid(SAMPLES)
    around = np.hypot(points[..., 0], points[..., 1])
    holder = np.minimum(np.minimum(around - 0.7, 0.8 - around), points[..., 1] - 0.1)
    values = np.maximum(bodies["head"], np.clip(holder * SAMPLES / 2, -1, 1).astype(np.float32))
    volume = isospline.Volume(values[::-1])
    alone = isospline.Volume(bodies["head"][::-1])
    assert isospline.suggest_view(volume) == isospline.suggest_view(alone) != USUAL
    shown, whole = suggested_surface(volume), isospline.Isosurface(volume, 0.0, closed=True)
    volumes = [each.enclosed_volume().value for each in (shown, whole, suggested_surface(alone))]
    assert volumes[0] == pytest.approx(volumes[2], rel=0.02) and volumes[1] > 1.1 * volumes[2]


@pytest.mark.parametrize("is_hollow", [False, True])
def test_what_lies_on_a_larger_table_is_the_body_of_a_ct(is_hollow):
    z, y, x = np.mgrid[0:48, 0:48, 0:64]
    values = np.where(np.hypot(x - 32, y - 24) < 7, 40, -1000)
    values[np.hypot(x - 32, y - 24) < 3] = 700
    values[:, 31:37] = 100
    if is_hollow:
        values[:, 32:36, 1:-1] = -900
    volume = isospline.Volume(values.astype(np.int16), direction=np.diag([-1, -1, 1]), patient=True)
    surface = suggested_surface(volume)
    assert surface.level > 40
    extent = isospline.Scene([surface]).extent(np.eye(3))
    np.testing.assert_allclose(extent[:2], [(-35, -29), (-27, -21)], atol=0.6)
    assert isospline.suggest_view(volume) == USUAL


def test_the_level_shows_more_than_a_plate():
    z, y, x = np.mgrid[0:48, 0:48, 0:48]
    values = np.where(np.hypot(np.hypot(x - 24, y - 24), z - 20) < 9, 40.0, 0.0)
    values[2:6] = 1000
    volume = isospline.Volume(values.astype(np.float32))
    surface = suggested_surface(volume)
    assert 0 < surface.level < 40
    assert surface.bounds[0, 2] > 8
    assert isospline.suggest_levels(values)[0] > 40


def test_a_solid_stands_on_its_only_flat_end(bodies):
    for axis, up in ((0, (0, 0, 1)), (1, (0, 1, 0)), (2, (1, 0, 0))):
        for sign in (1, -1):
            values = np.moveaxis(bodies["cone"], 0, axis)
            values = np.flip(values, axis) if sign < 0 else values
            assert isospline.suggest_view(isospline.Volume(values)).up == tuple(sign * part for part in up)
    # The border may have cut it there.
    assert isospline.suggest_view(isospline.Volume(np.flip(bodies["cone"][20:], 0))) == USUAL


@pytest.mark.sweep(6)
@pytest.mark.parametrize("name", ["head", "bottle", "bone", "cone", "ball on a saucer", "two objects", "slab"])
@pytest.mark.parametrize("turn", TURNS[3::29], ids=str)
def test_a_solid_below_a_level_is_that_of_the_negative_values(bodies, name, turn):
    values = turned(bodies[name], *turn)
    above, below = isospline.Volume(values), isospline.Volume(-values)
    found = isospline.suggest_view(below, inside="below")
    assert found == isospline.suggest_view(above)
    masks = isospline.suggest_mask(above), isospline.suggest_mask(below, inside="below")
    np.testing.assert_array_equal(*masks)
    surfaces = [isospline.Isosurface(above, 0.0), isospline.Isosurface(below, 0.0, inside="below")]
    ups = [isospline.camera_for(surface).up for surface in surfaces]
    np.testing.assert_array_equal(*ups)
    np.testing.assert_array_equal(ups[0], found.up)
    kept = [suggested_surface(above), suggested_surface(below, "below")]
    volumes = [each.with_level(0.0).enclosed_volume().value for each in kept]
    assert volumes[0] == pytest.approx(volumes[1], rel=1e-6)


def test_the_solid_above_does_not_decide_on_the_view_of_the_one_below(bodies):
    volume = isospline.Volume(bodies["head"][::-1])
    assert isospline.suggest_view(volume).up == (0, 0, -1)
    assert isospline.suggest_view(volume, inside="below") == USUAL  # a block with the hole of a head
    surface = isospline.Isosurface(volume, 0.0, inside="below")
    assert isospline.camera_for(surface).up.tolist() == [0, 0, 1]
    for function in (isospline.suggest_view, isospline.suggest_mask):
        with pytest.raises(ValueError, match='^inside: expected "above" or "below", got \'within\'$'):
            function(volume, inside="within")


@pytest.mark.parametrize("name", ["two objects", "slab", "noise"])
def test_other_bodies_keep_the_usual_view(bodies, name):
    for axes, signs in TURNS[::12]:
        volume = isospline.Volume(turned(bodies[name], axes, signs))
        assert isospline.suggest_view(volume) == USUAL
        assert isospline.suggest_mask(volume) is None


@pytest.mark.sweep(3)
@pytest.mark.parametrize("name", ["torus", "gyroid", "marschner_lobb", "blobs", "waves", "heart"])
def test_formulas_turned_at_random_keep_the_usual_view(name):
    random = np.random.default_rng(3)
    field = getattr(isospline.volumes, name)()
    for _ in range(3):
        turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
        volume = isospline.Volume(field.value(0.577 * grid(48) @ turn) - field.level)
        assert isospline.suggest_view(volume) == USUAL


def test_constant_and_thin_volumes_keep_the_usual_view():
    for values in (np.zeros((4, 4, 4)), np.arange(27.0).reshape(3, 3, 3), np.ones((3, 40, 5)) * np.arange(5)):
        assert isospline.suggest_view(isospline.Volume(values)) == USUAL


def trunk():
    """Hounsfield units of a trunk, cut above and below, with a spine at large y."""
    z, y, x = np.mgrid[0:40, 0:48, 0:64]
    values = np.where(np.hypot((x - 32) / 26, (y - 24) / 18) < 1, 40.0, -1000.0)
    values[np.hypot(x - 32, y - 37) < 4] = 600
    return values.astype(np.int16)


@pytest.mark.parametrize("degree", [0, 4, 5])
def test_masks_are_for_degrees_that_have_isosurfaces(degree):
    volume = isospline.Volume(np.zeros((8, 8, 8)), degree=degree)  # of which nothing is left out
    with pytest.raises(ValueError, match=f"volume: expected a degree of 1, 2 or 3, got {degree}"):
        isospline.suggest_mask(volume)
    assert isospline.suggest_view(volume) == USUAL


def test_lengths_in_the_direction_do_not_matter():
    z, y, x = np.mgrid[:48, :40, :44]
    on_plate = (((z - 22) / 10) ** 2 + ((y - 20) / 8) ** 2 + ((x - 22) / 7) ** 2 < 1) | ((z >= 2) & (z < 5))
    turned = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]])
    views = [
        isospline.suggest_view(isospline.Volume(on_plate, spacing=1 / k, direction=k * turned)) for k in (1.0, 10.0)
    ]
    assert views[0] == views[1] != USUAL


def test_a_trunk_contradicts_the_directions_of_an_array_only():
    front, back = (-0.45, -1, 0.3), (0.45, 1, 0.3)
    directions = {
        front: [np.eye(3), np.diag([1, 1, -1])],
        back: [np.diag([-1, -1, 1])],
    }
    for view, known in directions.items():
        for direction in known:
            volume = isospline.Volume(trunk(), spacing=(6, 6, 8), direction=direction, patient=True)
            assert isospline.suggest_view(volume).view == view
            assert bool(isospline.suggest_view(volume).reason) == (view == back)


def test_known_directions_cost_nothing(bodies, monkeypatch):
    for name in ("samples_of", "some_samples"):
        monkeypatch.setattr(presentation, name, lambda *_: pytest.fail("sampled"))
    direction = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    options = {"direction": direction, "patient": True}
    assert isospline.suggest_view(isospline.Volume(bodies["head"], **options)) == USUAL
    data = VolumeData(bodies["head"], **options)
    assert presentation.present_data(data, [0.0], -1.0).view == USUAL


def test_the_view_of_a_scene_is_that_of_its_volumes_if_they_agree(bodies):
    volume = isospline.Volume(bodies["head"][::-1])
    surface = isospline.Isosurface(volume, 0.0)
    down = isospline.camera_for(surface)
    assert down.up[2] == -1
    for same in (isospline.Scene([surface, surface.with_level(0.5)]), [surface]):
        assert isospline.camera_for(same).up.tolist() == down.up.tolist()
    apart = [isospline.Isosurface(bodies["head"][::-1], level) for level in (0.0, 0.5)]
    assert apart[0].volume is not apart[1].volume
    assert isospline.camera_for(apart).up.tolist() == down.up.tolist()
    upright = isospline.Isosurface(bodies["head"], 0.0)
    assert isospline.camera_for([apart[0], upright]).up.tolist() == [0, 0, 1]
    flipped = isospline.Scene()
    flipped.add(surface, np.diag([1.0, -1, -1, 1]))
    assert isospline.camera_for(flipped).up.tolist() == [0, 0, 1]
    torus = isospline.volumes.torus()
    mixed = isospline.Scene([surface, isospline.Isosurface(torus.volume(16), torus.level)])
    for scene, options in ((mixed, {}), (surface, {"view": "three-quarter"}), (surface, {"up": (0, 0, 1)})):
        assert isospline.camera_for(scene, **options).up.tolist() == [0, 0, 1]
    cameras = isospline.turntable_cameras(surface, 3)
    assert {tuple(camera.up) for camera in cameras} == {(0, 0, -1)}


def test_a_volume_is_analysed_once(bodies, monkeypatch):
    surface = isospline.Isosurface(isospline.Volume(bodies["head"][::-1]), 0.0)  # no object of the volume is kept
    up = isospline.camera_for(surface).up.tolist()
    monkeypatch.setattr(presentation, "samples_of", None)
    for shown in (surface, surface.with_level(0.5), isospline.Scene(surface)):
        assert isospline.camera_for(shown).up.tolist() == up == [0, 0, -1]
    monkeypatch.undo()
    other = isospline.Isosurface(isospline.Volume(bodies["head"]), 0.0)
    assert surface.volume._identity == surface.volume._identity != other.volume._identity
    assert isospline.camera_for(other).up.tolist() == [0, 0, 1]


def test_the_ground_is_below_the_suggested_top(bodies):
    volume = isospline.Volume(bodies["head"][::-1])
    surface = isospline.Isosurface(volume, 0.0, closed=True)
    light = isospline.Studio(light_samples=1)
    options = dict(size=(48, 40), background="white", samples=1)
    picture = isospline.render(surface, light=light, **options).to_srgb()
    stated = isospline.render(surface, light=light.replace(up=(0, 0, -1)), **options).to_srgb()
    np.testing.assert_array_equal(picture, stated)
    # For a camera that has z above, the ground is below, too.
    camera = isospline.camera_for(surface, view="front")
    picture = isospline.render(surface, camera, light=light, **options).to_srgb()
    stated = isospline.render(surface, camera, light=light.replace(up=(0, 0, 1)), **options).to_srgb()
    np.testing.assert_array_equal(picture, stated)


@pytest.mark.sweep(1)
@pytest.mark.parametrize("overview", [0, 1])
def test_all_scales_of_a_store_have_the_view_of_its_samples(bodies, tmp_path, monkeypatch, overview):
    """Whatever was asked for before, and without reading a finer scale than the overview."""
    pytest.importorskip("zarr")
    monkeypatch.setattr(detail, "_OVERVIEW", 128 >> overview)
    head = np.kron(bodies["head"][::-1], np.ones((2, 2, 2), np.float32))
    folder = isospline.convert(head, tmp_path / "head.zarr", image=False)
    in_memory = isospline.Volume(head)
    expected = isospline.camera_for(isospline.Isosurface(in_memory, 0.2)).world_to_camera[:3, :3]
    for scale in (0, 1, 0):
        volume = isospline.open_volume(folder, scale=scale)
        before = volume.paging["bytes_read"]
        assert isospline.suggest_view(volume) == isospline.suggest_view(in_memory) != USUAL
        assert scale >= overview or volume.paging["bytes_read"] == before
        camera = isospline.camera_for(isospline.Isosurface(volume, 0.2))
        np.testing.assert_allclose(camera.world_to_camera[:3, :3], expected)


def test_a_store_at_a_level_is_the_picture_of_the_command(bodies, tmp_path):
    pytest.importorskip("zarr")
    image = pytest.importorskip("PIL.Image")
    folder, path = tmp_path / "head.zarr", tmp_path / "head.png"
    isospline.convert(bodies["head"][::-1], folder)
    first = isospline.render(folder, level=0.2, size=(64, 48))
    assert main(["render", str(folder), "--level", "0.2", "--size", "64x48", "-o", str(path), "--quiet"]) == 0
    np.testing.assert_array_equal(np.asarray(image.open(path))[..., :3], first.to_srgb()[..., :3])
    isospline.render(folder, size=(64, 48))
    assert isospline.render(folder, level=0.2, size=(64, 48)) == first


VOLUMES = os.environ.get("ISOSPLINE_VOLUMES")


@pytest.mark.sweep(3)
@pytest.mark.skipif(not VOLUMES, reason="ISOSPLINE_VOLUMES is not set")
@pytest.mark.parametrize(
    ("name", "front", "up"),
    [
        ("headsq.mha", 1, -1),
        ("vismale_128x256x256_uint8.raw", -1, -1),
        ("abdomen_512x512x275_int16.nii.gz", 1, 1),
        ("mouse_skull.nrrd", -1, 1),
        ("engine.nii.gz", -1, 1),
        ("bonsai.nii.gz", -1, 1),
        ("fuel.nii.gz", -1, 1),
        ("tooth_103x94x161_uint16.raw", -1, 1),
        ("ironprot.vtk", -1, 1),
        ("weave.tif", -1, 1),
    ],
)
def test_real_volumes_stand_up(name, front, up):
    spacing = {"spacing": (1.57774, 0.995861, 1.00797)} if name.startswith("vismale") else {}
    data = isospline.read_volume(Path(VOLUMES) / name, **spacing)
    found = presentation.present_data(data, isospline.suggest_levels(data.data), float(data.data.min()))
    assert (found.view.view[1], found.view.up) == (front, (0, 0, up))
    assert presentation.present(data.to_volume()).view == found.view


@pytest.mark.skipif(not VOLUMES, reason="ISOSPLINE_VOLUMES is not set")
def test_the_store_of_a_real_head_stands_up(tmp_path):
    pytest.importorskip("zarr")
    path = Path(VOLUMES) / "headsq.mha"
    folder = isospline.convert(path, tmp_path / "head.zarr")
    of_file, of_store = (isospline.render(each, level=500, size=(320, 240)).to_srgb() for each in (path, folder))
    np.testing.assert_allclose(of_store.astype(int), of_file, atol=2)
