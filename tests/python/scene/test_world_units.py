"""The unit of length of a scene: rules for colours and distances in another one are refused."""

import numpy as np
import pytest

import isospline
from isospline.picture.marks import unit_of

DATA = 5 - np.linalg.norm(np.indices((12, 12, 12)) - 5.5, axis=0)
TO_MM = np.diag([0.001, 0.001, 0.001, 1])


def ball(unit, spacing, **options):
    return isospline.Isosurface(isospline.Volume(DATA, spacing=spacing, unit=unit), 0.0, **options)


MM, UM, BARE, MESH = ball("mm", 1.0), ball("µm", 1000.0), ball("", 1.0), ball("", 1.0).to_mesh()


def test_the_unit_of_a_picture_is_that_of_its_world():
    near = np.diag([1.1, 0.9, 1, 1])  # as a registration
    for objects, unit in (
        ([MM, MESH], "mm"),
        ([MM, ball("millimeter", 1.0)], "mm"),
        ([(UM, TO_MM), MM], "mm"),
        ([(MM, near)], "mm"),
        ([(UM, TO_MM)], ""),
        ([MM, BARE], ""),
        ([MM, UM], ""),
        ([MESH], ""),
    ):
        assert unit_of(isospline.Scene(objects)) == unit


@pytest.mark.parametrize("light", [None, "phong", "path-trace"])
def test_rules_for_colors_have_the_unit_of_the_scene(light):
    def picture(rule, **options):
        options = {"light": light, "size": (16, 12), "samples": 1, **options}
        return isospline.render(MM, color=rule, **options)

    for rule in (
        isospline.ColorByDistance(UM),
        isospline.ColorByDistance(isospline.Scene([MESH, UM]), limits=(-1, 1)),
        isospline.ColorByVolume(UM.volume),
        isospline.ColorByThickness(surface=UM),
    ):
        with pytest.raises(
            ValueError, match=r"color: expected a rule in mm, as the scene is, got one in µm: .* 0\.001"
        ):
            picture(rule)
    converted = isospline.Scene([(UM, TO_MM)])
    found = picture(isospline.ColorByDistance(converted, limits=(-1, 1)))
    np.testing.assert_allclose(found.color, picture(isospline.ColorByDistance(MM, limits=(-1, 1))).color, atol=1e-3)
    picture(isospline.ColorByDistance(MESH)), picture(isospline.ColorByVolume(BARE.volume))
    picture(isospline.ColorByThickness(surface=UM, transform=TO_MM, limits=(0, 1)))


def test_rules_of_objects_and_lights_have_the_unit_of_the_scene(tmp_path):
    rule = isospline.ColorByDistance(UM)
    own = ball("mm", 1.0, color=rule)
    for light in ("phong", isospline.Studio(), isospline.PathTracer()):
        with pytest.raises(ValueError, match="color: expected a rule in mm"):
            isospline.render(own, light=light, size=(16, 12))
    for light in (
        isospline.Studio(material=isospline.Material(isospline.ColorByVolume(UM.volume))),
        isospline.PathTracer(material=isospline.Material(isospline.ColorByVolume(UM.volume))),
        isospline.Phong(color=isospline.ColorByVolume(UM.volume)),
    ):
        with pytest.raises(ValueError, match="color: expected a rule in mm"):
            isospline.render(MM, light=light, size=(16, 12))
    with pytest.raises(ValueError, match="color: expected a rule in mm"):
        isospline.turntable(own, tmp_path / "turn", frames=2, size=(16, 12))


def test_distances_from_a_scene_have_its_unit():
    with pytest.raises(ValueError, match="other: expected an isosurface in mm, as surface is, got one in µm"):
        isospline.surface_distance(MM, isospline.Scene([MESH, UM]), samples=10)
    with pytest.raises(ValueError, match="other: expected an isosurface in mm, as surface is, got one in µm"):
        isospline.surface_distance(MM, isospline.Scene([MM, UM]), samples=10)
    assert isospline.surface_distance(MM, isospline.Scene([(UM, TO_MM)]), samples=10).rms.value < 1e-5
