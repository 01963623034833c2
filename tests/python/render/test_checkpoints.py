"""Limits of path traced pictures, and checkpoints: the same picture after a pause, and clear errors for other files."""

import json
import math
import os
import signal
import time
import zipfile

import numpy as np
import pytest

import isospline
from isospline.picture import progressive

SIZE = (70, 50)
INTEGRATOR = isospline.PathTracer(
    isospline.Material((0.9, 0.7, 0.5), roughness=0.3),
    lights=[isospline.SphereLight((2, -2, 3), 0.5, radiance=20), isospline.EnvironmentLight(0.3)],
)
CAMERA = isospline.PerspectiveCamera((2, -5, 3), (0, 0, -0.3), field_of_view=40)
#: The noise of the picture after about 40 samples.
NOISE = 0.0072
FIELD = isospline.volumes.torus()
VOLUME = FIELD.volume(32)
FLOOR = isospline.Mesh([[-3, -3, -1], [3, -3, -1], [3, 3, -1], [-3, 3, -1]], [[0, 1, 2], [0, 2, 3]])


def make_scene(volume=VOLUME, floor=FLOOR, level=FIELD.level, matrix=None, **visibility):
    scene = isospline.Scene([isospline.Isosurface(volume, level)])
    scene.add(floor, np.eye(4) if matrix is None else matrix, **visibility)
    return scene


def make_renderer(scene=None, camera=CAMERA, **options):
    options = {"size": SIZE, "light": INTEGRATOR, "layers": ("variance", "direct", "depth"), **options}
    return isospline.ProgressiveRenderer(scene or make_scene(), camera, **options)


@pytest.fixture(scope="module")
def whole():
    """The picture of 24 samples, without a pause."""
    renderer = make_renderer()
    renderer.step(24)
    return renderer.image


@pytest.fixture
def path(tmp_path):
    return tmp_path / "picture.checkpoint"


# Limits


def test_run_gives_the_picture_of_render(whole):
    for samples in (1, 2, 24):
        image = make_renderer().run(samples)
        layers = ("variance", "direct", "depth")
        assert image == isospline.render(
            make_scene(), CAMERA, size=SIZE, light=INTEGRATOR, samples=samples, layers=layers
        )
        assert samples != 24 or image == whole


def test_run_continues_after_steps(whole):
    renderer = make_renderer()
    renderer.step()
    assert renderer.run(24) == whole
    assert renderer.run(5) == whole  # the renderer already has more samples


def test_noise_is_the_change_by_one_standard_error(whole):
    renderer = make_renderer()
    assert renderer.noise == math.inf
    renderer.step(24)
    color = whole.color[..., :3].astype(float)
    error = np.sqrt(whole.variance)
    changes = np.sqrt(np.minimum(color + error, 1)) - np.sqrt(np.minimum(color, 1))
    assert renderer.noise == pytest.approx(np.sqrt((changes**2).mean()), rel=1e-4)


def test_a_picture_without_noise_has_none():
    renderer = make_renderer(light=isospline.PathTracer(max_bounces=0), size=(20, 20))
    renderer.step(2)
    assert renderer.noise == 0


def test_noise_ends_a_picture_at_a_multiple_of_16_samples():
    renderer = make_renderer()
    renderer.run(noise=NOISE)
    assert renderer.samples == 48 and renderer.noise <= NOISE
    shorter = make_renderer()
    shorter.run(32)
    assert shorter.noise > NOISE
    assert make_renderer().run(5, noise=1e-9) == make_renderer().run(5)


def test_time_ends_a_picture():
    renderer = make_renderer(size=(300, 200))
    began = time.monotonic()
    image = renderer.run(10**9, time_limit=0.5)
    assert time.monotonic() - began < 60 and renderer.samples >= 2
    assert np.isfinite(image.color).all() and (image.color[..., 3] > 0).any()


def test_progress_of_limits_rises_to_the_end():
    for limits in (dict(samples=20), dict(noise=0.05), dict(samples=10**6, time_limit=0.3)):
        fractions = []
        make_renderer().run(**limits, progress=fractions.append)
        assert fractions == sorted(fractions) or "noise" in limits
        assert min(fractions) >= 0 and max(fractions) <= 1
        assert "samples" not in limits or len(limits) > 1 or fractions[-1] == 1


def test_progress_stops_a_picture():
    with pytest.raises(isospline.Cancelled):
        make_renderer(size=(300, 200)).run(10**9, progress=lambda fraction: False)


@pytest.mark.parametrize(
    "limits, message",
    [
        ({}, "samples: expected a number, or noise or time_limit, got None"),
        ({"samples": 0}, "samples: expected a whole number of at least 1"),
        ({"noise": 0}, "noise: expected a finite number above 0, got 0"),
        ({"noise": math.nan}, "noise: expected a finite number above 0, got nan"),
        ({"time_limit": -1}, "time_limit: expected a finite number above 0, got -1"),
        ({"time_limit": math.inf}, "time_limit: expected a finite number above 0, got inf"),
    ],
    ids=str,
)
def test_limits_that_make_no_sense(limits, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        make_renderer().run(**limits)


# Checkpoints


def test_a_picture_continues_after_each_sample(whole, path):
    for samples in (1, 2, 23, 24):
        first = make_renderer()
        first.step(samples)
        first.save_checkpoint(path)
        second = make_renderer()
        second.load_checkpoint(path)
        assert second.samples == samples and second.image == first.image
        assert second.run(24) == whole


@pytest.mark.slow
@pytest.mark.parametrize(
    "count", [1, pytest.param(3, marks=pytest.mark.long), 10, pytest.param(20, marks=pytest.mark.long)]
)
def test_a_picture_continues_after_ctrl_c(path, count):
    """The interrupt may come at any time: tiles then have different numbers of samples."""
    options = dict(size=(100, 75))
    expected = make_renderer(**options).run(32, noise=1e-9)
    first, told = make_renderer(**options), []

    def interrupt(fraction):
        told.append(fraction)
        if len(told) == count:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        first.run(10**6, checkpoint=path, progress=interrupt)
    samples = first.samples
    second = make_renderer(**options)
    second.load_checkpoint(path)
    assert second.samples == samples
    np.testing.assert_array_equal(second.image.color, first.image.color)
    if samples < 32:
        assert second.run(32, noise=1e-9) == expected


@pytest.mark.slow
def test_a_limit_of_noise_is_the_same_after_a_pause(path):
    expected = make_renderer()
    expected.run(noise=NOISE)
    for samples in (2, 15, 16, 17, 47):
        first = make_renderer()
        first.run(samples, checkpoint=path)
        second = make_renderer()
        second.load_checkpoint(path)
        assert second.run(noise=NOISE) == expected.image


def test_checkpoints_are_written_now_and_then(path, monkeypatch):
    monkeypatch.setattr(progressive, "CHECKPOINT_INTERVAL", 0.0)
    written = []
    save = isospline.ProgressiveRenderer.save_checkpoint
    monkeypatch.setattr(
        isospline.ProgressiveRenderer,
        "save_checkpoint",
        lambda self, path: (written.append(self.samples), save(self, path))[0],
    )
    make_renderer().run(6, checkpoint=path)
    assert written == [0, 2, 3, 4, 5, 6, 6]


def test_an_older_checkpoint_is_kept_until_there_are_as_many_samples(path):
    make_renderer().run(6, checkpoint=path)
    written = path.read_bytes()
    for limit in (0.0, 0.3):
        with pytest.raises(isospline.Cancelled):
            make_renderer().run(9, checkpoint=path, progress=lambda done, limit=limit: done < limit)
        assert path.read_bytes() == written
    make_renderer().run(4, checkpoint=path)
    assert path.read_bytes() == written
    make_renderer().run(8, checkpoint=path)
    renderer = make_renderer()
    renderer.load_checkpoint(path)
    assert renderer.samples == 8


def test_background_and_layers_may_change(whole, path):
    first = make_renderer()
    first.run(24, checkpoint=path)
    second = make_renderer(layers=("direct", "normal"), background="white")
    second.load_checkpoint(path)
    expected = make_renderer(layers=("direct", "normal"), background="white")
    expected.step(24)
    assert second.image == expected.image


def test_a_checkpoint_may_have_more_layers(path):
    make_renderer(layers=("direct",)).run(2, checkpoint=path)
    renderer, expected = make_renderer(layers=()), make_renderer(layers=())
    renderer.load_checkpoint(path)
    expected.step(2)
    assert renderer.samples == 2 and renderer.image == expected.image


def others():
    """Renderers of other pictures, and the difference between them."""
    other_volume = isospline.Volume(FIELD.values(32) + 1e-3, **FIELD.grid(32))
    moved = np.eye(4)
    moved[0, 3] = 1e-9
    other_floor = isospline.Mesh(FLOOR.vertices + (0, 0, 1e-3), FLOOR.faces)
    extra = make_scene()
    extra.add(FLOOR)
    return {
        "volume of object 0": make_renderer(make_scene(other_volume)),
        "level of object 0": make_renderer(make_scene(level=FIELD.level + 1e-9)),
        "mesh of object 1": make_renderer(make_scene(floor=other_floor)),
        "transform of object 1": make_renderer(make_scene(matrix=moved)),
        "visibility of object 1": make_renderer(make_scene(casts_shadow=False)),
        "objects": make_renderer(extra),
        "camera": make_renderer(camera=CAMERA.replace(eye=(2, -5, 3 + 1e-12))),
        "size": make_renderer(size=(70, 51)),
        "path tracer's lights": make_renderer(light=INTEGRATOR.replace(lights=[isospline.EnvironmentLight(0.3)])),
        "path tracer's material": make_renderer(light=INTEGRATOR.replace(material=isospline.Material(0.3))),
        "path tracer's materials": make_renderer(light=INTEGRATOR.replace(materials={1: isospline.Material(0.3)})),
        "path tracer's max_bounces": make_renderer(light=INTEGRATOR.replace(max_bounces=3)),
        "path tracer's seed": make_renderer(light=INTEGRATOR.replace(seed=1)),
    }


@pytest.mark.parametrize("what", others())
def test_a_checkpoint_of_another_picture_is_refused_by_name(what, path):
    make_renderer().run(2, checkpoint=path)
    other = others()[what]
    other.step(3)
    before = other.image
    message = f"^checkpoint: expected one of the same {what}, got another one in .*{path.name}"
    with pytest.raises(ValueError, match=message):
        other.load_checkpoint(path)
    assert other.samples == 3 and other.image == before


def test_a_checkpoint_without_direct_light_is_refused(path):
    make_renderer(layers=()).run(2, checkpoint=path)
    with pytest.raises(ValueError, match='^checkpoint: expected one with the layer "direct", got one without it'):
        make_renderer().load_checkpoint(path)


def rewritten(path, **changes):
    with np.load(path) as arrays:
        content = {**arrays, **changes}
    with open(path, "wb") as file:
        np.savez(file, **{name: value for name, value in content.items() if value is not None})


def test_a_checkpoint_of_another_version_is_refused(path):
    make_renderer().run(2, checkpoint=path)
    rewritten(path, version=np.array("0.0.1"))
    with pytest.raises(ValueError, match=r"^checkpoint: expected one of isospline \S+"):
        make_renderer().load_checkpoint(path)


def test_damaged_checkpoints_are_told(path, rng):
    make_renderer().run(2, checkpoint=path)
    sound = path.read_bytes()
    fresh = make_renderer()
    damaged = [b"", b"nonsense", sound[:100], sound[: len(sound) // 2], sound[:-1]]
    for at in rng.integers(0, len(sound), 40):
        damaged.append(sound[:at] + bytes([sound[at] ^ 0x10]) + sound[at + 1 :])
    refused = 0
    for content in damaged:
        path.write_bytes(content)
        try:
            fresh.load_checkpoint(path)
        except ValueError as error:
            refused += 1
            assert str(error).startswith((f"{path}: cannot be read as a checkpoint: ", "checkpoint: expected")), error
            assert "\n" not in str(error)
        else:  # a byte that is not read, such as a date
            assert fresh.run(3) == make_renderer().run(3)
            fresh.reset()
    assert refused >= 40


@pytest.mark.parametrize(
    "changes, message",
    [
        ({"sums": None}, "cannot be read as a checkpoint"),
        ({"format": np.array("holiday pictures 3")}, "cannot be read as a checkpoint: it has another format"),
        ({"prints": np.array("[]")}, "cannot be read as a checkpoint: it has another format"),
        ({"prints": np.array("{")}, "cannot be read as a checkpoint"),
        ({"sums": np.zeros((7, 3500))}, r"sums of shape \(7, 3500\)"),
        ({"sums": np.zeros((3500, 7), np.float32)}, "another type of sums"),
        ({"sums": np.zeros((3499, 7))}, "expected 3500 pixels, got 3499"),
        ({"sums": np.full((3500, 7), np.nan)}, "expected finite numbers of at least 0"),
        ({"tile_samples": np.full((20, 1), -1, np.int32)}, "expected tiles of at least 0 samples, got -1"),
        ({"tile_samples": np.zeros((19, 1), np.int32)}, "expected 20 tiles, got 19"),
        ({"sums": np.array([{}], object)}, "cannot be read as a checkpoint"),
    ],
    ids=str,
)
def test_checkpoints_with_other_contents_are_told(path, changes, message):
    make_renderer().run(2, checkpoint=path)
    rewritten(path, **changes)
    with pytest.raises(ValueError, match=message):
        make_renderer().load_checkpoint(path)


def test_missing_files_raise_the_error_of_the_system(path, tmp_path):
    with pytest.raises(FileNotFoundError, match=path.name):
        make_renderer().load_checkpoint(path)
    with pytest.raises(IsADirectoryError):
        make_renderer().load_checkpoint(tmp_path)
    renderer = make_renderer()
    with pytest.raises(OSError, match="missing"):
        renderer.run(2, checkpoint=tmp_path / "missing" / "a")
    assert renderer.samples == 0  # before the work


def test_no_part_of_a_checkpoint_is_left(path, monkeypatch):
    renderer = make_renderer()
    renderer.run(2, checkpoint=path)
    before = path.read_bytes()

    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(np, "savez", stop)
    with pytest.raises(KeyboardInterrupt):
        renderer.save_checkpoint(path)
    assert path.read_bytes() == before and list(path.parent.iterdir()) == [path]


def test_a_changed_scene_is_not_saved(path):
    scene = make_scene()
    renderer = make_renderer(scene)
    renderer.step(2)
    scene.object(0).level += 0.01
    with pytest.raises(RuntimeError, match="scene has changed"):
        renderer.save_checkpoint(path)
    renderer.reset()
    renderer.run(2, checkpoint=path)
    with pytest.raises(ValueError, match="the same level of object 0"):
        make_renderer().load_checkpoint(path)


def test_reset_takes_the_other_camera_into_checkpoints(path):
    other = isospline.camera_for(make_scene(), view="top", size=SIZE)
    renderer = make_renderer()
    renderer.save_checkpoint(path)
    renderer.reset(camera=other)
    renderer.run(2, checkpoint=path)
    make_renderer(camera=other).load_checkpoint(path)
    with pytest.raises(ValueError, match="the same camera"):
        make_renderer().load_checkpoint(path)


def test_a_checkpoint_is_a_zip_file_of_arrays(path):
    make_renderer().run(2, checkpoint=path)
    assert zipfile.is_zipfile(path)
    with np.load(path, allow_pickle=False) as arrays:
        assert arrays["sums"].shape == (70 * 50, 7) and (arrays["tile_samples"] == 2).all()
        assert "camera" in json.loads(str(arrays["prints"]))


def test_rules_with_objects_and_values_of_meshes_belong_to_the_picture(path):
    surface, other = make_scene().object(0), isospline.Isosurface(VOLUME, FIELD.level - 0.1)
    corners, faces = [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]

    def renderer(what):
        return make_renderer(isospline.Scene(what))

    def colored(rule):
        return isospline.Isosurface(VOLUME, FIELD.level, color=rule)

    def by_distance(target):
        return colored(isospline.ColorByDistance(target, limits=(-1, 1)))

    def by_thickness(limit):
        return colored(isospline.ColorByThickness(limits=(0, limit)))

    def with_value(number):
        rule = isospline.ColorByValue(limits=(0, 1))
        return isospline.Mesh(corners, faces, values=[0, 1, number], color=rule)

    for make, one, two in ((by_distance, surface, other), (by_thickness, 1, 2), (with_value, 0.5, 0.6)):
        renderer(make(one)).run(1, checkpoint=path)
        renderer(make(one)).load_checkpoint(path)
        with pytest.raises(ValueError, match="the same"):
            renderer(make(two)).load_checkpoint(path)
