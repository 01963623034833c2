"""Albedo, gradient magnitude, curvature, ambient occlusion and direct light of images against closed forms."""

import copy
import pickle

import numpy as np
import pytest
from layered import render

import isospline
from isospline.colors import linear

SIZE = (80, 60)
RADIUS, SCALE = 5.0, 1.5
OPENNESS = {"layers": ("ambient_occlusion",), "ambient_occlusion_samples": 16}


@pytest.fixture(scope="module")
def image():
    """A ball of f = |x|^2 scaled by 1.5, geometry 0, in front of a coloured wall, geometry 1."""
    z, y, x = np.mgrid[-16:17, -16:17, -16:17].astype(float)
    volume = isospline.Volume(x**2 + y**2 + z**2, origin=(-16, -16, -16))
    scene = isospline.Scene()
    scene.add(isospline.Isosurface(volume, RADIUS**2, inside="below"), np.diag([SCALE, SCALE, SCALE, 1]))
    corners = [(-9, 10, -9), (9, 10, -9), (9, 10, 9), (-9, 10, 9)]
    colors = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]  # x and z of the wall as red and green
    scene.add(isospline.Mesh(corners, [(0, 1, 2), (0, 2, 3)], colors=linear(colors)))
    camera = isospline.PerspectiveCamera((2, -40, 3), (0, 0, 0), field_of_view=32)
    shading = {
        0: isospline.Phong(color=linear((0.9, 0.5, 0.1))),
        1: isospline.Outline(surface_color=linear((1, 0.5, 1))),
    }
    return render(scene, camera, size=SIZE, light=shading, samples=2, layers=("curvature",))


def test_albedo(image):
    ball, wall = image.geometry_ids == 0, image.geometry_ids == 1
    assert min(ball.sum(), wall.sum(), (~ball & ~wall).sum()) > 200
    assert (image.albedo[ball] == np.array((0.9, 0.5, 0.1), np.float32)).all()
    x, z = image.position[wall][:, 0], image.position[wall][:, 2]
    np.testing.assert_allclose(image.albedo[wall][:, 0], (x + 9) / 18, atol=1e-6)
    np.testing.assert_allclose(image.albedo[wall][:, 1], 0.5 * (z + 9) / 18, atol=1e-6)
    assert not image.albedo[wall][:, 2].any() and not image.albedo[~ball & ~wall].any()


def test_gradient_magnitude(image):
    ball = image.geometry_ids == 0
    np.testing.assert_allclose(image.gradient_magnitude[ball], 2 * RADIUS / SCALE, rtol=1e-5)
    assert not image.gradient_magnitude[~ball].any()


def test_curvature(image):
    ball = image.geometry_ids == 0
    radius = RADIUS * SCALE
    np.testing.assert_allclose(image.curvature[ball, 0], 1 / radius, atol=1e-4)
    np.testing.assert_allclose(image.curvature[ball, 1], 1 / radius**2, atol=1e-4)
    assert not image.curvature[~ball].any()


# The type of each layer, and its dimensions after those of the picture.
LAYERS = {
    "depth": (np.float32, ()),
    "position": (np.float32, (3,)),
    "normal": (np.float32, (3,)),
    "albedo": (np.float32, (3,)),
    "gradient_magnitude": (np.float32, ()),
    "curvature": (np.float32, (2,)),
    "ambient_occlusion": (np.float32, ()),
    "direct": (np.float32, (3,)),
    "variance": (np.float32, (3,)),
    "geometry_ids": (np.uint32, ()),
    "primitive_ids": (np.uint64, ()),
    "mask": (np.bool_, ()),
}
TRACED = ("direct", "variance")


@pytest.mark.parametrize(
    "integrator", ["phong", isospline.Studio(), isospline.PathTracer()], ids=["phong", "studio", "path tracer"]
)
def test_an_image_holds_the_layers_that_are_named_and_no_others(integrator):
    """Each layer, and the colour, is the same for all combinations of layers."""
    scene = isospline.Scene([ball(), square(12, height=-7)])
    names = [name for name in LAYERS if isinstance(integrator, isospline.PathTracer) or name not in TRACED]
    options = {"size": (40, 30), "light": integrator, "samples": 2}
    everything = isospline.render(scene, OUTSIDE, layers=names, **options)
    assert everything.layers == tuple(names)
    for asked in [(), *((name,) for name in names), names[::3]]:
        image = isospline.render(scene, OUTSIDE, layers=iter(asked), **options)
        assert image.layers == tuple(asked)
        np.testing.assert_array_equal(image.color, everything.color)
        for name, (dtype, trailing) in LAYERS.items():
            if name in asked:
                layer = getattr(image, name)
                assert layer.dtype == dtype and layer.shape == (30, 40, *trailing)
                np.testing.assert_array_equal(layer, getattr(everything, name))
            else:
                held = ", ".join(asked) or "no layers"
                message = rf'{name}: expected render\(..., layers=\("{name}",\)\) for it, got an image with {held}'
                with pytest.raises(AttributeError, match=f"^{message}$"):
                    getattr(image, name)


def test_the_mask_has_the_pixels_whose_rays_hit(tmp_path):
    """Also in light with a ground, through translucent surfaces, in copies, pickles and files."""
    scene = isospline.Scene([ball(), square(12, height=-7)])
    expected = np.isfinite(scene.cast_rays(OUTSIDE.rays((40, 30)))["t_hit"])
    assert 0.1 < expected.mean() < 0.9
    for light in (None, isospline.Studio(light_samples=1), isospline.Phong(opacity=0.2), isospline.PathTracer()):
        image = isospline.render(scene, OUTSIDE, size=(40, 30), light=light, layers=["depth", "mask"], background="red")
        np.testing.assert_array_equal(image.mask, expected)
        assert image.layers == ("depth", "mask") and not image.mask.flags.writeable
    for same in (copy.copy(image), copy.deepcopy(image), pickle.loads(pickle.dumps(image)), image.over("blue")):
        assert same.layers == image.layers
        np.testing.assert_array_equal(same.mask, expected)
    both = isospline.render(scene, OUTSIDE, size=(40, 30), layers=["mask", "geometry_ids"], light="phong")
    assert both.layers == ("geometry_ids", "mask") and repr(both).startswith("Image(40 x 30, geometry_ids, mask, ")
    assert both != isospline.render(scene, OUTSIDE, size=(40, 30), layers=["mask"], light="phong")
    np.testing.assert_array_equal(both.geometry_ids != isospline.INVALID_ID, expected)

    image.save(tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as found:
        assert "geometry_ids" not in found and found["mask"].dtype == bool
        np.testing.assert_array_equal(found["mask"], expected)
    image.save(tmp_path / "a.exr")
    openexr = pytest.importorskip("OpenEXR")
    with openexr.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        np.testing.assert_array_equal(file.channels()["id.geometry"].pixels != isospline.INVALID_ID, expected)


@pytest.mark.parametrize("lens", [False, True])
@pytest.mark.parametrize("samples", [1, 2, 3])
@pytest.mark.parametrize("shading", [isospline.Phong(opacity=0.5, shadows=True), isospline.AmbientOcclusion(4)])
def test_layers_do_not_change_the_colour(shading, samples, lens):
    """Rays through the centres are not cast if nothing needs them."""
    scene = isospline.Scene([ball(), square(12, height=-7)])
    camera = OUTSIDE.with_lens(1.0) if lens else OUTSIDE
    with_layers, alone = (
        isospline.render(scene, camera, size=(40, 30), light=shading, samples=samples, layers=layers)
        for layers in (("depth", "ambient_occlusion"), ())
    )
    np.testing.assert_array_equal(alone.color, with_layers.color)


def test_a_progressive_image_holds_the_layers_that_are_named():
    renderer = isospline.ProgressiveRenderer(isospline.Scene([ball()]), OUTSIDE, size=(8, 6), layers=("variance",))
    for _ in range(2):
        assert renderer.image.layers == ("variance",)
        renderer.step(2)
    assert np.isfinite(renderer.image.variance).all()
    renderer = isospline.ProgressiveRenderer(isospline.Scene([ball()]), OUTSIDE, size=(8, 6))
    renderer.step()
    assert renderer.image.layers == () and repr(renderer.image).startswith("Image(8 x 6, ")


def square(side, *, height=0.0):
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0.0)]) * side + (0, 0, height)
    return isospline.Mesh(corners, [(0, 1, 2), (0, 2, 3)])


def ball(radius=6.3):
    z, y, x = np.mgrid[-16:17, -16:17, -16:17].astype(float)
    return isospline.Isosurface(isospline.Volume(x**2 + y**2 + z**2, origin=(-16, -16, -16)), radius**2, inside="below")


INSIDE = isospline.PerspectiveCamera((2, -1, 0.5), (-3, 4, 1), field_of_view=80)
OUTSIDE = isospline.PerspectiveCamera((2, -40, 3), (0, 0, 0), field_of_view=32)


@pytest.mark.parametrize(
    "scene, camera, openness",
    [
        (isospline.Scene([square(50)]), OUTSIDE, 1),
        (isospline.Scene([ball()]), OUTSIDE, 1),
        (isospline.Scene([ball()]), INSIDE, 0),
    ],
    ids=["plane", "outside of a ball", "inside"],
)
@pytest.mark.parametrize("integrator", [None, isospline.PathTracer()], ids=["shading", "path tracer"])
def test_openness_of_what_is_open_and_closed(scene, camera, openness, integrator):
    image = render(scene, camera, size=SIZE, light=integrator, samples=2, **OPENNESS)
    hit = image.geometry_ids == 0
    assert hit.sum() > 500 and image.ambient_occlusion.shape == SIZE[::-1]
    assert (image.ambient_occlusion[hit] == openness).all() and not image.ambient_occlusion[~hit].any()


@pytest.mark.slow
def test_openness_before_a_wall_is_the_form_factor():
    """A very long wall of height h at the distance d hides (1 - d / sqrt(d^2 + h^2)) / 2 of the sky."""
    height = 3.0
    wall = [(-150, 0, 0), (150, 0, 0), (150, 0, height), (-150, 0, height)]
    scene = isospline.Scene([square(200), isospline.Mesh(wall, [(0, 1, 2), (0, 2, 3)])])
    camera = isospline.PerspectiveCamera((0, -30, 20), (0, -4, 0), field_of_view=25)
    image = render(scene, camera, size=(40, 30), **OPENNESS | {"ambient_occlusion_samples": 4096})
    floor = (image.geometry_ids == 0) & (image.position[..., 1] < 0)
    distance = -image.position[floor][:, 1]
    assert floor.sum() > 500 and distance.min() < 1 and distance.max() > 8
    expected = (1 + distance / np.hypot(distance, height)) / 2
    np.testing.assert_allclose(image.ambient_occlusion[floor], expected, atol=6e-3)


def test_openness_is_what_the_shading_shows():
    """With one sample per pixel, both use the same rays."""
    scene = isospline.Scene([ball(), square(12, height=-7)])
    shading = isospline.AmbientOcclusion(16)
    image = render(scene, OUTSIDE, size=SIZE, light=shading, **OPENNESS)
    np.testing.assert_array_equal(image.ambient_occlusion, image.color[..., 0])
    assert len(np.unique(image.ambient_occlusion)) > 5

    try:
        isospline.set_thread_count(1)
        other = render(scene, OUTSIDE, size=SIZE, samples=3, **OPENNESS)
    finally:
        isospline.set_thread_count(0)
    np.testing.assert_array_equal(other.ambient_occlusion, image.ambient_occlusion)


LAMPS = [isospline.SphereLight((4, -9, 9), 1.5, radiance=20), isospline.EnvironmentLight(0.3)]


def test_direct_light_is_that_of_one_bounce():
    """With the same random numbers, bit for bit."""
    scene = isospline.Scene([ball(), square(12, height=-7)])
    whole, once, shown = (
        render(
            scene,
            OUTSIDE,
            size=SIZE,
            samples=4,
            background=background,
            layers=("direct",),
            light=isospline.PathTracer(lights=LAMPS, max_bounces=bounces),
        )
        for bounces, background in ((16, None), (1, None), (1, (0.1, 0.2, 0.3)))
    )
    np.testing.assert_array_equal(once.direct, once.color[..., :3])
    np.testing.assert_array_equal(whole.direct, once.direct)
    assert (whole.direct <= whole.color[..., :3]).all()
    assert (whole.color[..., 0] > 1.05 * whole.direct[..., 0]).mean() > 0.1
    np.testing.assert_array_equal(shown.direct, once.direct)
    assert (shown.color > once.color).any()


def test_direct_light_in_an_integrating_sphere():
    """A lamp in the middle of a hollow ball: each bounce after the first one reflects the albedo times the last one."""
    part, radius, bounces = 0.5, 6.3, 3
    integrator = isospline.PathTracer(
        isospline.Material(linear(part), specular=0), lights=[isospline.PositionalLight((0, 0, 0))], max_bounces=bounces
    )
    image = render(isospline.Scene([ball(radius)]), INSIDE, size=SIZE, light=integrator, samples=2, layers=("direct",))
    direct = part / np.pi / radius**2
    np.testing.assert_allclose(image.direct, np.full_like(image.direct, direct), rtol=2e-3)
    np.testing.assert_allclose(image.color[..., :3], (1 + part + part**2) * image.direct, rtol=2e-3)


def test_curvature_beside_a_path_tracer():
    scene = isospline.Scene([ball()])
    traced, plain = (
        render(scene, OUTSIDE, size=SIZE, light=integrator, layers=("curvature",))
        for integrator in (isospline.PathTracer(), None)
    )
    assert plain.curvature.any()
    np.testing.assert_array_equal(traced.curvature, plain.curvature)


def test_layers_are_in_the_file(tmp_path):
    openexr = pytest.importorskip("OpenEXR")
    scene = isospline.Scene([ball(), square(12, height=-7)])
    integrator = isospline.PathTracer(lights=LAMPS)
    image = render(
        scene,
        OUTSIDE,
        size=SIZE,
        light=integrator,
        samples=2,
        layers=("curvature", "ambient_occlusion", "direct"),
        ambient_occlusion_samples=8,
    )
    image.write(tmp_path / "all.exr", half=True)
    with openexr.File(str(tmp_path / "all.exr"), separate_channels=True) as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
    expected = {"ambient_occlusion": image.ambient_occlusion, "curvature.gaussian": image.curvature[..., 1]}
    expected |= {f"direct.{name}": image.direct[..., axis] for axis, name in enumerate("RGB")}
    for name, layer in expected.items():
        assert channels[name].dtype == np.float32 and len(np.unique(layer)) > 8
        np.testing.assert_array_equal(channels[name], layer)
    render(scene, OUTSIDE, size=SIZE).write(tmp_path / "plain.exr")
    with openexr.File(str(tmp_path / "plain.exr"), separate_channels=True) as file:
        assert not {"ambient_occlusion", "direct.R", "curvature.mean"} & set(file.channels())


@pytest.mark.parametrize("integrator", [None, isospline.PathTracer()], ids=["shading", "path tracer"])
def test_bad_layers(integrator):
    def fails(error, message, **options):
        with pytest.raises(error, match=f"^{message}"):
            isospline.render(isospline.Scene(), OUTSIDE, size=(4, 3), light=integrator, **options)

    for rays in (-1, 0, 65537):
        fails(ValueError, "ambient_occlusion_samples: expected .* got ", ambient_occlusion_samples=rays)
    *others, last = LAYERS
    names = ", ".join(f'"{name}"' for name in (*others, "certified", last))
    fails(ValueError, f'layers: expected names among {names}, got "z"', layers=("depth", "z"))
    fails(TypeError, r'layers: expected a sequence of names, such as \("depth",\), got \'depth\'', layers="depth")
    fails(TypeError, "layers: expected a sequence of names, .* got None", layers=None)
    fails(TypeError, "layers: expected names, got 1", layers=[1])
    fails(ValueError, 'encoding: expected "linear" or "srgb8", got "png"', encoding="png")
    if integrator is None:
        for name in TRACED:
            fails(ValueError, f"layers: expected direct and variance of path traced .* got {name}", layers=(name,))


@pytest.mark.slow
@pytest.mark.parametrize("opacity", [0.0, 0.3, 1.0])
def test_openness_below_a_translucent_ball(opacity):
    """The ball covers cos(angle to its centre) (radius / distance)^2 of the sky; its two sides absorb a part of it."""
    radius, center = 4.0, np.array((0, 0, 9.0))
    move = np.eye(4)
    move[:3, 3] = center
    scene = isospline.Scene([square(50)])
    scene.add(ball(radius), move)
    camera = isospline.PerspectiveCamera((0, -30, 15), (0, 0, 0), field_of_view=30)
    shading = {1: isospline.Phong(opacity=opacity)}
    image = render(scene, camera, size=(40, 30), light=shading, **OPENNESS | {"ambient_occlusion_samples": 1024})
    floor = image.geometry_ids == 0
    offset = center - image.position[floor]
    distance = np.linalg.norm(offset, axis=-1)
    covered = offset[:, 2] / distance * (radius / distance) ** 2
    assert floor.sum() > 500 and covered.max() > 0.15
    expected = 1 - covered * (1 - (1 - opacity) ** 2)
    np.testing.assert_allclose(image.ambient_occlusion[floor], expected, atol=1e-2)
