"""Progressive rendering: the same picture for any division into steps, variance, cancellation, other cameras."""

import sys
import time
import types

import numpy as np
import pytest
from layered import LAYERS, render

import isospline

SIZE = (70, 50)


@pytest.fixture(scope="module")
def scene():
    field = isospline.volumes.torus()
    volume = field.volume(32)
    floor = isospline.Mesh([[-3, -3, -1], [3, -3, -1], [3, 3, -1], [-3, 3, -1]], [[0, 1, 2], [0, 2, 3]])
    return isospline.Scene([isospline.Isosurface(volume, field.level), floor])


@pytest.fixture(scope="module")
def camera(scene):
    return isospline.PerspectiveCamera((2, -5, 3), (0, 0, -0.3), field_of_view=40)


INTEGRATOR = isospline.PathTracer(
    isospline.Material((0.9, 0.7, 0.5), roughness=0.3),
    lights=[isospline.SphereLight((2, -2, 3), 0.5, radiance=20), isospline.EnvironmentLight(0.3)],
)


def test_the_picture_does_not_depend_on_threads_or_steps(scene, camera):
    whole = render(scene, camera, size=SIZE, light=INTEGRATOR, samples=5)
    try:
        isospline.set_thread_count(1)
        renderer = isospline.ProgressiveRenderer(
            scene, camera, size=SIZE, light=INTEGRATOR, layers=(*LAYERS, "variance")
        )
        for samples in (1, 3, 1):
            renderer.step(samples)
    finally:
        isospline.set_thread_count(0)
    assert renderer.samples == 5
    for name in ("color", "variance", "depth", "position", "normal", "geometry_ids", "primitive_ids"):
        assert getattr(renderer.image, name).tobytes() == getattr(whole, name).tobytes(), name


def test_all_but_colour_is_that_of_the_pixels_centres(scene, camera):
    traced = render(scene, camera, size=SIZE, light=INTEGRATOR)
    plain = render(scene, camera, size=SIZE)
    for name in ("depth", "position", "normal", "geometry_ids", "primitive_ids", "world_to_camera", "world_to_ndc"):
        np.testing.assert_array_equal(getattr(traced, name), getattr(plain, name))
    assert "variance" not in plain.layers
    masked = isospline.ProgressiveRenderer(scene, camera, size=SIZE, layers=["mask"])
    masked.step()
    assert masked.image.layers == ("mask",)
    np.testing.assert_array_equal(masked.image.mask, np.isfinite(plain.depth))
    assert np.isinf(traced.variance).all()  # one sample does not determine the variance


def test_variance_is_that_of_independent_pictures(scene, camera):
    images = [
        render(scene, camera, size=SIZE, samples=8, light=isospline.PathTracer(lights=INTEGRATOR.lights, seed=seed))
        for seed in range(40)
    ]
    told = np.mean([image.variance for image in images], axis=0)
    found = np.var([image.color[..., :3] for image in images], axis=0, ddof=1)
    assert found.sum() == pytest.approx(told.sum(), rel=0.1)
    blocks = [part[:50, :70].reshape(5, 10, 7, 10, 3).mean((1, 3, 4)) for part in (told, found)]
    np.testing.assert_allclose(blocks[1], blocks[0], rtol=0.5, atol=1e-5)


@pytest.mark.slow
def test_images_become_better(scene, camera):
    best = render(scene, camera, size=SIZE, light=INTEGRATOR, samples=256).color
    errors, before = [], None
    for image in isospline.render_progressive(scene, camera, size=SIZE, light=INTEGRATOR, samples=100):
        assert before is None or (before.color != image.color).any()  # each is an image of its own
        before = image
        errors.append(np.sqrt(((image.color - best) ** 2).mean()))
    assert len(errors) == 8  # 1, 2, 4 ... 64, 100
    assert errors == sorted(errors, reverse=True)
    assert 6 < errors[0] / errors[6] < 11  # 64 samples: an eighth


def test_the_iterator_is_lazy_and_can_be_closed(scene, camera):
    images = isospline.render_progressive(scene, camera, size=SIZE)
    next(images)
    images.close()
    with pytest.raises(StopIteration):
        next(images)
    with pytest.raises(ValueError, match="^samples: expected"):
        isospline.render_progressive(scene, camera, samples=0)
    with pytest.raises(ValueError, match="^size: expected"):
        isospline.render_progressive(scene, camera, size=(0, 1))


def test_reset_begins_again(scene, camera):
    renderer = isospline.ProgressiveRenderer(scene, camera, size=SIZE, light=INTEGRATOR)
    renderer.step(2)
    first = renderer.image.color
    other = isospline.camera_for(scene, view="top")
    renderer.reset(camera=other)
    assert renderer.samples == 0 and not renderer.image.color.any()
    renderer.step(2)
    expected = render(scene, other, size=SIZE, light=INTEGRATOR, samples=2)
    np.testing.assert_array_equal(renderer.image.color, expected.color)
    np.testing.assert_array_equal(renderer.image.world_to_ndc, expected.world_to_ndc)

    renderer.reset(camera=camera)
    with pytest.raises(ValueError):
        renderer.reset(camera=isospline.PerspectiveCamera((0, 0, 0), (0, 0, 0)))
    renderer.step(2)
    np.testing.assert_array_equal(renderer.image.color, first)


def test_a_change_of_the_scene_is_noticed():
    field = isospline.volumes.sphere(0.5)
    surface = isospline.Isosurface(field.volume(16), field.level)
    scene = isospline.Scene([surface])
    camera = isospline.PerspectiveCamera((0, -4, 0), (0, 0, 0))
    renderer = isospline.ProgressiveRenderer(scene, camera, size=(20, 20), layers=("depth",))
    renderer.step()
    before = np.isfinite(renderer.image.depth).sum()
    surface.level += 0.1
    with pytest.raises(RuntimeError, match="scene has changed"):
        renderer.step()
    renderer.reset()
    renderer.step()
    assert np.isfinite(renderer.image.depth).sum() != before


def test_a_cancelled_step_is_made_up_for(scene, camera):
    renderer = isospline.ProgressiveRenderer(scene, camera, size=(400, 300), light=INTEGRATOR)
    started = time.monotonic()
    with pytest.raises(isospline.Cancelled):
        renderer.step(10**6, progress=lambda fraction: False)
    assert time.monotonic() - started < 60
    renderer.step(1)
    assert renderer.samples >= 1
    assert np.isfinite(renderer.image.color).all()


def test_denoise_changes_nothing_but_colour(scene, camera, monkeypatch):
    """Without the package: the arguments of its call, and the use of its result."""
    image = render(scene, camera, size=SIZE, light=INTEGRATOR, samples=2)
    color = image.color.copy()
    calls = []

    def denoise(color, **options):
        calls.append((color, options))
        return np.full_like(color, 0.25)

    monkeypatch.setitem(sys.modules, "pyoidn", types.SimpleNamespace(denoise=denoise))
    result = image.denoise()
    ((given, options),) = calls
    np.testing.assert_array_equal(given, color[..., :3])
    assert options == {"hdr": True} and given.dtype == np.float32
    assert (result.color[..., :3] == 0.25).all()
    np.testing.assert_array_equal(result.color[..., 3], color[..., 3])
    np.testing.assert_array_equal(result.depth, image.depth)
    np.testing.assert_array_equal(image.color, color)

    monkeypatch.setitem(sys.modules, "pyoidn", None)
    with pytest.raises(ImportError, match="pip install pyoidn"):
        image.denoise()


@pytest.mark.slow
def test_denoise_brings_a_picture_closer_to_its_limit(scene, camera):
    pytest.importorskip("pyoidn", reason="pyoidn is not installed")
    size = (80, 60)
    noisy = render(scene, camera, size=size, light=INTEGRATOR, samples=4)
    best = render(scene, camera, size=size, light=INTEGRATOR, samples=256)
    before, after = (np.sqrt(((image.color - best.color)[..., :3] ** 2).mean()) for image in (noisy, noisy.denoise()))
    assert after < 0.5 * before


def test_variance_is_in_the_file(scene, camera, tmp_path):
    openexr = pytest.importorskip("OpenEXR")
    image = render(scene, camera, size=SIZE, light=INTEGRATOR, samples=3)
    image.write(tmp_path / "traced.exr")
    with openexr.File(str(tmp_path / "traced.exr"), separate_channels=True) as file:
        channels = file.channels()
        for axis, name in enumerate("RGB"):
            np.testing.assert_array_equal(channels[f"variance.{name}"].pixels, image.variance[..., axis])
    render(scene, camera, size=SIZE).write(tmp_path / "plain.exr")
    with openexr.File(str(tmp_path / "plain.exr"), separate_channels=True) as file:
        assert "variance.R" not in file.channels()


def test_rays_beside_it_are_no_change(camera):
    """With enough rays, the scene gets a faster index, with the same hits."""
    field = isospline.volumes.torus()
    scene = isospline.Scene(isospline.Isosurface(field.volume(32), field.level))
    renderers = [isospline.ProgressiveRenderer(scene, camera, size=SIZE, light=INTEGRATOR) for _ in range(2)]
    expected = renderers[0].step(2)
    renderers[1].step(1)
    for _ in range(8):
        scene.cast_rays(camera.rays((512, 512)), coherent=True)
    assert renderers[1].step(1) == expected
    scene.object(0).level += 0.01
    with pytest.raises(RuntimeError, match="the scene has changed"):
        renderers[1].step(1)
