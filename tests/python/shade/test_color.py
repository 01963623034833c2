"""Colours of surfaces against closed forms: by volume, curvature, normal and depth."""

import sys

import numpy as np
import pytest
from analytic_volumes import Gyroid, Torus
from layered import render

import isospline
from isospline.colors import color_map, linear, srgb_to_linear

SIZE = (90, 70)
RAMP = [(0, 0, 0), (1, 1, 1)]
TRIANGLE = [(-4, 1, -3), (5, 0, -2), (0.5, 2, 4.0)], [(0, 1, 2)]


def shown(scene, camera, color):
    """The image of a scene in this colour only, without light."""
    return render(scene, camera, size=SIZE, light=isospline.Outline(0, color=color))


def value_of(image, limits):
    """The values that a grey ramp between limits shows, and the pixels with a surface."""
    gray, seen = image.color[..., 0].astype(float), np.isfinite(image.depth)
    assert (gray[seen] > 0.001).all() and (gray[seen] < 0.999).all() and seen.sum() > 500
    return limits[0] + (limits[1] - limits[0]) * gray[seen], image.position[seen].astype(float)


def quadratic(squares, radius, inside="below", shape=(25, 25, 25), spacing=(1, 1, 1), direction=None):
    """The surface sum of squares * x^2 = radius^2; models of degree 2 and 3 hold it exactly, except near the border."""
    direction = np.eye(3) if direction is None else np.asarray(direction)
    z, y, x = np.meshgrid(*(np.arange(n) - n // 2 for n in shape), indexing="ij")
    points = np.stack([x, y, z], axis=-1) * spacing @ direction.T
    origin = -direction @ (np.array(shape[::-1]) // 2 * spacing)
    volume = isospline.Volume(
        (points**2 * squares).sum(-1), degree=3, spacing=spacing, origin=origin, direction=direction
    )
    clip = isospline.Box((-6, -6, -6), (6, 6, 6))
    return isospline.Isosurface(volume, radius**2, inside=inside, clip=clip)


@pytest.fixture
def camera():
    return isospline.PerspectiveCamera((4, -25, 3), (0, 0, 0), field_of_view=30)


TILT = [(0.6, -0.8, 0), (0.8, 0.6, 0), (0, 0, 1)]


@pytest.mark.parametrize("inside, sign", [("below", 1), ("above", -1)])
@pytest.mark.parametrize("placing", [dict(), dict(spacing=(1, 0.8, 1.25), direction=TILT, shape=(23, 33, 27))])
def test_curvature_of_a_sphere(camera, inside, sign, placing):
    scene = isospline.Scene([quadratic((1, 1, 1), 5, inside=inside, **placing)])
    for kind, expected in (("mean", sign / 5), ("gaussian", 1 / 25), ("maximum", sign / 5), ("minimum", sign / 5)):
        color = isospline.ColorByCurvature(kind, RAMP, limits=(-1, 1))
        values, _ = value_of(shown(scene, camera, color), (-1, 1))
        # Coefficients are float32: rounded by 1e-5 where the gradient is 10, 1e-4 is a bound for second differences.
        # Principal curvatures come from the root of a difference, which vanishes here.
        principal = kind in ("maximum", "minimum")
        np.testing.assert_allclose(values, expected, atol=1e-2 if principal else 1e-4)


def test_curvature_of_a_cylinder_through_a_transform(camera):
    scene = isospline.Scene()
    scene.add(quadratic((1, 1, 0), 4), np.diag([1.5, 1.5, -1.5, 1]))  # mirrored, of radius 6
    for kind, expected in (("mean", 1 / 12), ("gaussian", 0), ("maximum", 1 / 6), ("minimum", 0)):
        color = isospline.ColorByCurvature(kind, RAMP, limits=(-1, 1))
        values, _ = value_of(shown(scene, camera, color), (-1, 1))
        np.testing.assert_allclose(values, expected, atol=1e-4)


def test_curvature_of_a_torus():
    torus = Torus(center=(32, 32, 32), major_radius=16, minor_radius=7)
    volume = isospline.Volume(torus.values((65, 65, 65)), degree=3)
    scene = isospline.Scene([isospline.Isosurface(volume, 0)])
    camera = isospline.camera_for(scene, view=(1, -1, 1.2), size=SIZE)
    for kind in ("mean", "gaussian", "maximum", "minimum"):
        limits = (-0.3, 0.3)
        values, position = value_of(shown(scene, camera, isospline.ColorByCurvature(kind, RAMP, limits=limits)), limits)
        p = position - 32
        cosine = (np.hypot(p[:, 0], p[:, 1]) - 16) / 7
        k1, k2 = np.full(len(p), 1 / 7), cosine / (16 + 7 * cosine)
        expected = {"mean": (k1 + k2) / 2, "gaussian": k1 * k2, "maximum": k1, "minimum": k2}[kind]
        assert np.ptp(expected) > 0.01 or kind == "maximum"
        np.testing.assert_allclose(values, expected, atol=1e-3)


def test_curvature_is_that_of_the_shape_operator():
    gyroid = Gyroid(period=24)
    volume = isospline.Volume(gyroid.values((48, 48, 48)), degree=3, boundary="periodic")
    scene = isospline.Scene([isospline.Isosurface(volume, 0.3)])
    camera = isospline.camera_for(scene, size=SIZE)
    limits = (-0.5, 0.5)
    for kind, column in (("minimum", 1), ("maximum", 2)):
        values, position = value_of(shown(scene, camera, isospline.ColorByCurvature(kind, RAMP, limits=limits)), limits)
        # The solid is above: the outward normal is against the gradient.
        gradient, hessian = -gyroid.gradient(position), -gyroid.hessian(position)
        length = np.linalg.norm(gradient, axis=1)[:, None, None]
        normal = gradient[..., None] / length
        tangential = np.eye(3) - normal @ normal.swapaxes(1, 2)
        eigenvalues = np.linalg.eigvalsh(tangential @ hessian @ tangential / length)
        eigenvalues = np.sort(
            np.take_along_axis(eigenvalues, np.argsort(np.abs(eigenvalues), axis=1)[:, 1:], axis=1), axis=1
        )  # without that of the normal
        np.testing.assert_allclose(values, eigenvalues[:, column - 1], atol=2e-3)


def test_by_volume(camera, rng):
    scene = isospline.Scene([quadratic((1, 1, 1), 5)])
    # A linear function, exact for a model of degree 1, on a separate grid.
    weights, offset = np.array([0.02, -0.03, 0.05]), 0.4
    z, y, x = np.mgrid[0:9, 0:8, 0:10].astype(float)
    points = np.stack([x, y, z], axis=-1) * (2, 3, 2.5) - 10
    volume = isospline.Volume(points @ weights + offset, spacing=(2, 3, 2.5), origin=(-10, -10, -10), degree=1)
    values, position = value_of(shown(scene, camera, isospline.ColorByVolume(volume, RAMP, limits=(-1, 2))), (-1, 2))
    np.testing.assert_allclose(values, position @ weights + offset, atol=2e-6)

    transform = np.array([(0, -1, 0, 1), (1, 0, 0, 2), (0, 0, 1, -0.5), (0, 0, 0, 1)])
    color = isospline.ColorByVolume(volume, RAMP, transform=transform)
    assert color.limits == (volume.minimum, volume.maximum)
    np.testing.assert_allclose(color.transform, transform, atol=1e-12)
    values, position = value_of(shown(scene, camera, color), color.limits)
    in_volume = np.c_[position, np.ones(len(position))] @ np.linalg.inv(transform).T
    np.testing.assert_allclose(values, in_volume[:, :3] @ weights + offset, atol=2e-6)


def test_by_normal_and_by_depth(camera):
    scene = isospline.Scene([quadratic((1, 1, 1), 5)])
    image = shown(scene, camera, isospline.ColorByNormal())
    seen = np.isfinite(image.depth)
    np.testing.assert_allclose(image.color[seen, :3], (image.normal[seen] + 1) / 2, atol=1e-6)

    values, _ = value_of(shown(scene, camera, isospline.ColorByDepth(RAMP, limits=(19, 28))), (19, 28))
    np.testing.assert_allclose(values, image.depth[seen], atol=2e-6)
    # By default, from the nearest corner of the scene's box to the farthest.
    color = isospline.ColorByDepth(RAMP)
    assert color.limits is None and repr(color) == "ColorByDepth(cmap=array(2, 3), limits=None)"
    lower, upper = scene.bounds
    corners = np.stack(np.meshgrid(*zip(lower, upper)), axis=-1).reshape(-1, 3)
    depths = corners @ camera.world_to_camera[2, :3] + camera.world_to_camera[2, 3]
    limits = depths.min(), depths.max()
    values, _ = value_of(shown(scene, camera, color), limits)
    np.testing.assert_allclose(values, image.depth[seen], atol=2e-5)


@pytest.mark.parametrize("eye", [(0, 0, 0.5), (0, -7, 0)], ids=["inside", "outside"])
def test_by_depth_in_a_panorama(eye):
    """From the nearest point of the scene's box, which is no corner, to the farthest one."""
    scene = isospline.Scene([quadratic((1, 1, 1), 5)])
    corners = np.stack(np.meshgrid(*zip(*scene.bounds)), axis=-1).reshape(-1, 3)
    limits = np.linalg.norm(eye - np.clip(eye, *scene.bounds)), np.linalg.norm(corners - eye, axis=1).max()
    camera = isospline.PanoramicCamera(eye, np.add(eye, (0, 1, 0)))
    image = shown(scene, camera, isospline.ColorByDepth(RAMP))
    values, _ = value_of(image, limits)
    np.testing.assert_allclose(values, image.depth[np.isfinite(image.depth)], atol=2e-5)


def test_maps_of_matplotlib_look_as_they_do_there(camera):
    matplotlib = pytest.importorskip("matplotlib")
    scene = isospline.Scene([quadratic((1, 1, 1), 5)])
    limits = (19, 28)
    for cmap in ("viridis", matplotlib.colormaps["coolwarm"]):
        image = shown(scene, camera, isospline.ColorByDepth(cmap, limits=limits))
        seen = np.isfinite(image.depth)
        exact = matplotlib.colormaps[getattr(cmap, "name", cmap)](np.linspace(0, 1, 256))[:, :3] * 255
        place = np.clip((image.depth[seen] - limits[0]) / (limits[1] - limits[0]), 0, 1) * 255
        expected = np.stack([np.interp(place, np.arange(256), exact[:, channel]) for channel in range(3)], axis=-1)
        assert np.abs(image.to_srgb()[seen][:, :3] - expected).max() <= 1


def test_ridges_and_valleys():
    color = isospline.ridges_and_valleys(0.25, color=(0.4, 0.5, 0.6), ridge=0.9)
    assert (color.kind, color.limits) == ("mean", (-0.25, 0.25))
    np.testing.assert_array_equal(color.cmap, [(0, 0, 0), (0.4, 0.5, 0.6), (0.9, 0.9, 0.9)])


def test_shadings_keep_their_colors():
    for color in (isospline.ColorByNormal(), isospline.ColorByDepth(RAMP, limits=(1, 3))):
        phong = isospline.Phong(color=color)
        assert type(phong.color) is type(color) and f"color={color!r}, ambient" in repr(phong)
        outline = isospline.Outline(surface_color=color)
        assert repr(outline.surface_color) == repr(color) and repr(color) in repr(outline)
    assert repr(color) == "ColorByDepth(cmap=array(2, 3), limits=(1, 3))"
    np.testing.assert_array_equal(isospline.Phong(color=(0.1, 0.2, 1)).color, (0.1, 0.2, 1))


def test_bad_colors(monkeypatch):
    volume = isospline.Volume(np.arange(27.0).reshape(3, 3, 3))
    flat = isospline.Volume(np.ones((3, 3, 3)))
    for make, parameter in (
        (lambda: isospline.Phong(color=(1, -1, 1)), "color"),
        (lambda: isospline.Phong(color=(1, 1)), "color"),
        (lambda: isospline.Outline(surface_color=np.nan), "surface_color"),
        (lambda: isospline.ColorByDepth("viridian"), "cmap"),
        (lambda: isospline.ColorByDepth([(1, 1, 1)]), "cmap"),
        (lambda: isospline.ColorByDepth([(1, 1), (0, 0)]), "cmap"),
        (lambda: isospline.ColorByDepth([(1, 1, 1), (0, 0, -1)]), "cmap"),
        (lambda: isospline.ColorByDepth(RAMP, limits=(1, 1)), "limits"),
        (lambda: isospline.ColorByCurvature(limits=(0, np.inf)), "limits"),
        (lambda: isospline.ColorByCurvature("average", limits=(0, 1)), "kind"),
        (lambda: isospline.ColorByVolume(flat, RAMP), "limits"),
        (lambda: isospline.ColorByVolume(volume, RAMP, transform=np.diag([1, 1, 0, 1])), "transform"),
        (lambda: isospline.ColorByVolume(volume, RAMP, transform=np.diag([1, 1, 1, 2])), "transform"),
        (lambda: isospline.Mesh(*TRIANGLE, normals=[(0, 0, 1)]), "normals"),
        (lambda: isospline.Mesh(*TRIANGLE, normals=[(0, 0, np.nan)] * 3), "normals"),
        (lambda: isospline.Mesh(*TRIANGLE, colors=[(0, 0, 1, 1)] * 3), "colors"),
        (lambda: isospline.Mesh(*TRIANGLE, colors=[(0, 0, -1)] * 3), "colors"),
    ):
        with pytest.raises(ValueError, match=f"^{parameter}: expected .* got "):
            make()
    with pytest.raises(ValueError, match="color: expected .* the name of a colour"):
        isospline.Phong(color="reddest")
    with pytest.raises(TypeError, match="cmap: expected"):
        isospline.ColorByDepth({})
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ImportError, match=r"pip install isospline\[color\]"):
        isospline.ColorByDepth("magma")
    isospline.ColorByDepth(RAMP)


@pytest.mark.parametrize("name", ["viridis", "coolwarm"])
def test_default_maps_equal_those_of_matplotlib_without_it(name, monkeypatch):
    matplotlib = pytest.importorskip("matplotlib")
    expected = srgb_to_linear(matplotlib.colormaps[name](np.linspace(0, 1, 256))[:, :3])
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    np.testing.assert_allclose(color_map(name), expected, atol=2e-5)
    assert isospline.ColorByDepth() == isospline.ColorByDepth("viridis")
    isospline.ColorByCurvature(limits=(-1, 1))


def test_threads_do_not_change_the_colors(camera):
    scene = isospline.Scene([quadratic((1, 1, 1), 5)])
    color = isospline.ColorByCurvature(cmap=RAMP, limits=(0, 1))
    images = []
    try:
        for threads in (1, 2):
            isospline.set_thread_count(threads)
            images.append(shown(scene, camera, color).color.tobytes())
    finally:
        isospline.set_thread_count(0)
    assert images[0] == images[1]


@pytest.mark.parametrize("wrong", [-0.5, 1.5, np.nan, np.inf])
def test_colors_of_maps_are_from_0_to_1(wrong):
    for cmap in (
        [(0, 0, wrong), (1, 1, 1)],
        linear([(0, 0, wrong), (1, 1, 1)]),
        lambda values: np.stack([values, values, np.full_like(values, wrong)], axis=1),
    ):
        with pytest.raises(ValueError, match=rf"^cmap: expected numbers from 0 to 1 .*, got \(0.0, 0.0, {wrong}\)"):
            color_map(cmap)


# Names


def test_names_of_colors_are_taken_wherever_a_color_is(camera):
    srgb = np.array([0xD2, 0xB4, 0x8C]) / 255
    tan = srgb_to_linear(srgb)
    for name in ("tan", "#d2b48c", "#D2B48C", "TAN"):
        np.testing.assert_allclose(isospline.Phong(color=name).color, srgb)
        np.testing.assert_allclose(isospline.Phong(ambient_light=name).ambient_light, tan)
        np.testing.assert_allclose(isospline.Phong(cap_color=name).cap_color, srgb)
        np.testing.assert_allclose(isospline.Outline(2, color=name, surface_color=name).surface_color, srgb)
        np.testing.assert_allclose(isospline.AmbientOcclusion(color=name).color, srgb)
        np.testing.assert_allclose(isospline.Material(name).color, srgb)
        np.testing.assert_allclose(isospline.DirectionalLight((0, 0, 1), intensity=name).intensity, tan)
        np.testing.assert_allclose(isospline.PositionalLight((0, 0, 1), intensity=name).intensity, tan)
        np.testing.assert_allclose(isospline.SphereLight((0, 0, 1), 1.0, radiance=name).radiance, tan)
        np.testing.assert_allclose(isospline.EnvironmentLight(name).radiance, tan)
        np.testing.assert_allclose(isospline.ridges_and_valleys(0.5, color=name).cmap[1], srgb)
        image = isospline.render(isospline.Scene(), camera, size=(2, 2), background=name, light="phong")
        np.testing.assert_allclose(image.color[0, 0], [*tan, 1], atol=1e-6)
    mesh = isospline.Mesh(*TRIANGLE, colors="tan")
    np.testing.assert_allclose(mesh.colors, [srgb] * 3)
    mesh = isospline.Mesh(*TRIANGLE, colors=["white", "tan", (0, 0.5, 1)])
    np.testing.assert_allclose(mesh.colors, [(1, 1, 1), srgb, (0, 0.5, 1)])
    np.testing.assert_allclose(isospline.ColorByDepth(["black", "tan"]).cmap, [(0, 0, 0), srgb])
    np.testing.assert_allclose(color_map([(0, 0, 0), "tan"]), [(0, 0, 0), tan])
    np.testing.assert_allclose(color_map([(0, 0, 0), tuple(srgb)]), [(0, 0, 0), tan])
    image = isospline.render(isospline.Scene(), camera, size=(2, 2), background=(*srgb, 0.5), light="phong")
    np.testing.assert_allclose(image.color[0, 0], [*(0.5 * tan), 0.5], atol=1e-6)
    assert isospline.Phong(color=tuple(srgb)) == isospline.Phong(color="tan") == isospline.Phong(color=linear(tan))


@pytest.mark.parametrize("name", ["rgb(300,0,0)", "rgb(0, 256, 0)"])
def test_names_of_colors_have_numbers_up_to_255(name):
    for make in (lambda: isospline.Phong(color=name), lambda: isospline.colors.named_color(name)):
        with pytest.raises(ValueError, match=r"color: expected numbers .* or the name of a colour.*rgb"):
            make()


def test_names_of_matplotlib():
    pytest.importorskip("matplotlib")
    from matplotlib.colors import BASE_COLORS, CSS4_COLORS, TABLEAU_COLORS, XKCD_COLORS, to_rgb

    from isospline.colors import named_color

    for names in (BASE_COLORS, CSS4_COLORS, TABLEAU_COLORS, list(XKCD_COLORS)[::100], ["C1", "0.25"]):
        for name in names:
            expected = srgb_to_linear(np.round(255 * np.array(to_rgb(name))) / 255)
            np.testing.assert_allclose(named_color(name), expected, atol=3e-3, err_msg=name)


def test_without_matplotlib_the_names_of_css_and_its_short_ones_are_there(monkeypatch):
    from isospline.colors import named_color

    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setitem(sys.modules, "matplotlib.colors", None)
    np.testing.assert_allclose(named_color("tab:blue"), srgb_to_linear(np.array([0x1F, 0x77, 0xB4]) / 255))
    with pytest.raises(ValueError, match="^color: expected numbers from 0 to 1 or the name of a colour"):
        named_color("xkcd:sky blue")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: isospline.Phong(color=(1.5, 0, 0)),
            r"^color: expected numbers from 0 to 1 .*\(1.5, 0.0, 0.0\)$",
        ),
        (lambda: isospline.Phong(color=(255, 128, 0)), '^color: .* did you mean "#ff8000"'),
        (lambda: isospline.Material(255), '^color: .* got 255; did you mean "#ffffff"'),
        (lambda: isospline.Outline(2, surface_color=(0, 0, 2)), "^surface_color: expected numbers from 0 to 1"),
        (
            lambda: isospline.Mesh(*TRIANGLE, colors=[(0, 0, 1.1)] * 3),
            "^colors: expected numbers from 0",
        ),
        (lambda: isospline.Mesh(*TRIANGLE, colors="tna"), "^colors: expected numbers .* or the name"),
        (lambda: isospline.ColorByDepth([(0, 0, 0), (3, 0, 0)]), "^cmap: expected numbers from 0 to 1"),
        (lambda: isospline.ColorByDepth(["black", "tna"]), "^cmap: expected numbers from 0 to 1 or the name"),
        (lambda: isospline.ridges_and_valleys(1, ridge=2), "^ridge: expected numbers from 0 to 1"),
        (lambda: isospline.Phong(color="#11223344"), "^color: expected the name of a colour without an opacity"),
        (
            lambda: isospline.render(
                isospline.Scene(),
                size=(2, 2),
                background=9,
                camera=isospline.PanoramicCamera((0, 0, 0), (0, 1, 0)),
                light="phong",
            ),
            "^background: expected numbers from 0 to 1",
        ),
    ],
)
def test_a_color_out_of_range_is_explained(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_a_background_may_have_an_opacity(camera):
    image = isospline.render(isospline.Scene(), camera, size=(2, 2), background="#ff000080", light="phong")
    np.testing.assert_allclose(image.color[0, 0], [128 / 255, 0, 0, 128 / 255], atol=1e-6)
    assert isospline.PositionalLight((0, 0, 1), intensity=40).intensity[0] == 40  # lights have no bound


def test_unlit_colours_are_those_of_the_rule():
    field = isospline.volumes.torus()
    surface = isospline.Isosurface(field.volume(24), field.level, color=isospline.ColorByDepth("viridis"))
    image = isospline.render(surface, size=(48, 36), light="unlit", layers=("albedo",))
    seen = image.color[..., 3] == 1
    assert seen.sum() > 200 and np.ptp(image.albedo[seen], axis=0).max() > 0.4
    np.testing.assert_allclose(image.color[seen, :3], image.albedo[seen], rtol=1e-6)
