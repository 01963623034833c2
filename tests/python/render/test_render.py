"""Pictures against closed forms and against the paper's formulas in NumPy; threads, progress and cancellation."""

import os
import signal
import subprocess
import sys
import textwrap
import time

import numpy as np
import pytest
from layered import render

import isospline
from isospline.colors import linear

RADIUS = 6.3


def sphere_surface(inside="below", center=(0.0, 0.0, 0.0)):
    """f = |x - center|^2; a quadratic model holds it exactly outside the reach of the boundary rule."""
    z, y, x = np.mgrid[-16:17, -16:17, -16:17].astype(float)
    volume = isospline.Volume(x**2 + y**2 + z**2, origin=np.add((-16, -16, -16), center))
    return isospline.Isosurface(volume, RADIUS**2, inside=inside)


@pytest.fixture(scope="module")
def scene():
    return isospline.Scene([sphere_surface()])


@pytest.fixture(scope="module")
def camera():
    return isospline.PerspectiveCamera((4, -25, 3), (0, 0, 0), field_of_view=40)


def closed_form(rays):
    """Whether and where rays hit the sphere, and the normal there."""
    origin, direction = rays[..., :3], rays[..., 3:]
    direction = direction / np.linalg.norm(direction, axis=-1, keepdims=True)
    b = (origin * direction).sum(-1)
    discriminant = b**2 - (origin**2).sum(-1) + RADIUS**2
    hit = discriminant > 0
    t = -b - np.sqrt(np.where(hit, discriminant, 0))
    position = origin + t[..., None] * direction
    return hit, discriminant, position, position / RADIUS, -direction


def dot(a, b):
    return (a * b).sum(-1, keepdims=True)


def phong(position, normal, to_viewer, color, ka, kd, ks, ns, ia, lights):
    """The paper's section 6, for (kind, vector, intensity)."""
    intensity = ka * np.array(ia) * color + np.zeros_like(position)
    for kind, vector, light in lights:
        to_light = np.asarray(vector) - position if kind == "at" else -np.asarray(vector, float) + 0 * position
        to_light /= np.linalg.norm(to_light, axis=-1, keepdims=True)
        reflection = 2 * normal * dot(normal, to_light) - to_light
        diffuse = np.maximum(dot(normal, to_light), 0)
        specular = np.maximum(dot(to_viewer, reflection), 0) ** ns
        intensity += np.array(light) * (kd * diffuse * color + ks * specular)
    return intensity


def test_a_sphere_is_the_closed_form(scene, camera):
    size = (211, 150)
    image = render(scene, camera, size=size, light=isospline.Outline(2))
    hit, discriminant, position, normal, to_viewer = closed_form(camera.rays(size))
    found = image.geometry_ids == 0

    # The silhouette: only rays that graze the sphere within the rounding of the coefficients (3e-5 in f) may differ.
    assert (found == hit)[np.abs(discriminant) > 1e-4].all()
    clear = found & hit & (discriminant > 0.5)
    assert clear.sum() > 5000
    assert np.abs(image.position - position)[clear].max() < 5e-5
    assert np.abs(image.normal - normal)[clear].max() < 1e-5
    depth = position @ camera.world_to_camera[2, :3] + camera.world_to_camera[2, 3]
    np.testing.assert_allclose(image.depth[clear], depth[clear], rtol=1e-6)

    expected = (1 - dot(normal, to_viewer) ** 2) ** 2
    assert np.abs(image.color[..., :3] - expected)[clear].max() < 2e-5
    np.testing.assert_array_equal(image.color[..., 3], found.astype(np.float32))
    assert not image.color[~found].any()
    assert np.isinf(image.depth[~found]).all()
    assert (image.geometry_ids[~found] == 0xFFFFFFFF).all() and (image.primitive_ids[~found] == 2**64 - 1).all()
    surface = sphere_surface()
    cells = surface.volume.cell_at(image.primitive_ids[found])
    assert surface.shell.mask[tuple(cells.T[::-1])].all()


def test_phong_is_the_papers(scene, camera):
    size = (120, 90)
    shading = isospline.Phong(
        color=linear((0.9, 0.6, 0.3)),
        ambient=0.15,
        diffuse=0.55,
        specular=0.35,
        specular_exponent=12,
        ambient_light=(0.5, 0.6, 0.7),
        lights=[
            isospline.PositionalLight((10, -20, 15), intensity=(1, 0.9, 0.8)),
            isospline.DirectionalLight((1, 0.5, -0.3), intensity=0.4),
            isospline.PositionalLight((0, 30, 0), intensity=(0, 0, 2)),
        ],
    )
    image = render(scene, camera, size=size, light=shading)
    hit, discriminant, position, normal, to_viewer = closed_form(camera.rays(size))
    lights = [
        ("at", (10, -20, 15), (1, 0.9, 0.8)),
        ("along", (1, 0.5, -0.3), (0.4, 0.4, 0.4)),
        ("at", (0, 30, 0), (0, 0, 2)),
    ]
    expected = phong(
        position, normal, to_viewer, np.array((0.9, 0.6, 0.3)), 0.15, 0.55, 0.35, 12, (0.5, 0.6, 0.7), lights
    )
    clear = hit & (discriminant > 0.5)
    assert np.abs(image.color[..., :3] - expected)[clear].max() < 2e-5


def test_two_sided_shading(camera):
    inward = isospline.Scene([sphere_surface(inside="above")])
    outward = isospline.Scene([sphere_surface(inside="below")])
    lights = [isospline.PositionalLight((10, -20, 15))]
    both_sides, one_side = (isospline.Phong(lights=lights, two_sided=two_sided) for two_sided in (True, False))

    def color(scene, shading):
        return render(scene, camera, size=(60, 50), light=shading).color

    np.testing.assert_array_equal(color(inward, both_sides), color(outward, both_sides))
    np.testing.assert_array_equal(color(outward, one_side), color(outward, both_sides))
    assert color(inward, one_side).sum() < color(outward, one_side).sum()


def test_samples_smooth_the_silhouette_only(scene, camera):
    size = (80, 60)
    one = render(scene, camera, size=size)
    four = render(scene, camera, size=size, samples=4)
    for name in ("depth", "position", "normal", "geometry_ids", "primitive_ids"):
        np.testing.assert_array_equal(getattr(one, name), getattr(four, name))
    fine = render(scene, camera, size=(640, 480)).color.reshape(60, 8, 80, 8, 4).mean((1, 3))
    for image, tolerance in ((one, 0.51), (four, 0.26), (render(scene, camera, size=size, samples=25), 0.08)):
        assert np.abs(image.color[..., 3] - fine[..., 3]).max() < tolerance
    assert 0 < np.count_nonzero((four.color[..., 3] > 0) & (four.color[..., 3] < 1)) < 300


def test_background(scene, camera):
    size = (80, 60)
    free = render(scene, camera, size=size, samples=4)
    assert free.color[0, 0].tolist() == [0, 0, 0, 0]
    alpha = free.color[..., 3:]
    for background, rgb, opacity in (
        (linear((0.1, 0.2, 0.3)), (0.1, 0.2, 0.3), 1),
        (1, (1, 1, 1), 1),
        (linear([0.5, 1, 0.7, 0.25]), (0.5, 1, 0.7), 0.25),
    ):
        image = render(scene, camera, size=size, samples=4, background=background)
        expected = free.color + (1 - alpha) * opacity * np.array([*rgb, 1])
        np.testing.assert_allclose(image.color, expected, atol=1e-6)
    for background in ((1, 2), (-1, 0, 0), (0, 0, 0, 2), (np.nan, 0, 0), [[1, 1, 1]]):
        with pytest.raises(ValueError, match="background: expected"):
            render(scene, camera, size=size, background=background)


def test_a_shading_for_each_geometry(camera):
    scene = isospline.Scene([sphere_surface(center=(-7, 0, 0)), sphere_surface(center=(7, 0, 0))])
    shading = {1: isospline.Outline(0, color=(0, 1, 0)), 0: isospline.Outline(0, color=(1, 0, 0))}
    image = render(scene, camera, size=(90, 60), light=shading)
    assert set(np.unique(image.geometry_ids)) == {0, 1, 0xFFFFFFFF}
    assert (image.color[image.geometry_ids == 0] == (1, 0, 0, 1)).all()
    assert (image.color[image.geometry_ids == 1] == (0, 1, 0, 1)).all()


def test_threads_do_not_change_the_image(scene, camera):
    images = []
    try:
        for threads in (1, 2):
            isospline.set_thread_count(threads)
            images.append(render(scene, camera, size=(203, 111), samples=2))
    finally:
        isospline.set_thread_count(0)
    for name in ("color", "depth", "position", "normal", "geometry_ids", "primitive_ids"):
        assert getattr(images[0], name).tobytes() == getattr(images[1], name).tobytes(), name


def test_progress_and_cancellation(scene, camera):
    fractions = []
    render(scene, camera, size=(400, 300), progress=fractions.append)
    assert fractions[-1] == 1 and fractions == sorted(fractions)

    started = time.monotonic()
    with pytest.raises(isospline.Cancelled):
        render(scene, camera, size=(4000, 4000), samples=4096, progress=lambda fraction: False)

    def broken(fraction):
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        render(scene, camera, size=(4000, 4000), samples=4096, progress=broken)
    assert time.monotonic() - started < 120  # would take days without cancellation


@pytest.mark.skipif(os.name == "nt", reason="needs POSIX signals")
def test_ctrl_c_stops_a_long_rendering():
    program = textwrap.dedent(
        """
        import signal
        import numpy as np
        import isospline

        signal.signal(signal.SIGINT, signal.default_int_handler)
        z, y, x = np.mgrid[-12:13, -12:13, -12:13].astype(float)
        scene = isospline.Scene([isospline.Isosurface(isospline.Volume(x * x + y * y + z * z), 36.0)])
        begun = []

        def progress(fraction):
            if not begun:
                begun.append(True)
                print("begun", flush=True)

        try:
            isospline.render(scene, isospline.camera_for(scene), size=(4000, 4000), samples=4096, progress=progress)
        except KeyboardInterrupt:
            print("stopped", flush=True)
        """
    )
    process = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, encoding="utf-8")
    try:
        assert process.stdout.readline() == "begun\n"
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=60)[0] == "stopped\n"
        assert process.returncode == 0
    finally:
        process.kill()


def test_default_lights_show_every_side(scene):
    for view in ("front", "left", "top", "iso"):
        camera = isospline.camera_for(scene, view=view)
        image = render(scene, camera, size=(64, 48))
        assert image.color[24, 32, 0] > 0.3
    dark = render(scene, camera, size=(64, 48), light=isospline.Phong(lights=[]))
    np.testing.assert_allclose(dark.color[24, 32], (0.05, 0.05, 0.05, 1))


@pytest.mark.parametrize("arguments", [dict(size=(0, 5)), dict(size=(5, -1)), dict(samples=0), dict(samples=10**6)])
def test_bad_options(scene, camera, arguments):
    (name,) = arguments
    with pytest.raises(ValueError, match=f"^{name}: expected"):
        render(scene, camera, **arguments)


def test_bad_types(scene, camera):
    for arguments in (dict(size=3), dict(size=(1.5, 2)), dict(shading="phong"), dict(samples="4"), dict(sample=2)):
        with pytest.raises(TypeError):
            render(scene, camera, **arguments)
    with pytest.raises(TypeError):
        render(scene, "front")
    with pytest.raises(TypeError):
        render(scene, camera, (640, 360))


@pytest.mark.parametrize(
    "make, parameter",
    [
        (lambda: isospline.Phong(diffuse=-1), "diffuse"),
        (lambda: isospline.Phong(specular_exponent=np.nan), "specular_exponent"),
        (lambda: isospline.Phong(color=(1, 2)), "color"),
        (lambda: isospline.Phong(color=(1, np.inf, 0)), "color"),
        (lambda: isospline.Outline(-2), "exponent"),
        (lambda: isospline.PositionalLight((0, 0, np.nan)), "position"),
        (lambda: isospline.PositionalLight((0, 0, 0), intensity=-1), "intensity"),
        (lambda: isospline.DirectionalLight((0, 0, 0)), "direction"),
    ],
)
def test_bad_shadings(make, parameter):
    with pytest.raises(ValueError, match=f"^{parameter}: expected .* got "):
        make()
