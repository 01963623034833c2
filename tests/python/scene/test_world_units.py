"""The unit of length of a scene: objects, rules for colours and distances in another one are refused."""

import copy
import pickle

import numpy as np
import pytest

import isospline
from isospline.picture.marks import unit_of

DATA = 5 - np.linalg.norm(np.indices((12, 12, 12)) - 5.5, axis=0)
TO_MM = np.diag([0.001, 0.001, 0.001, 1])


def ball(unit, spacing, **options):
    return isospline.Isosurface(isospline.Volume(DATA, spacing=spacing, unit=unit), 0.0, **options)


MM, UM, BARE, MESH = ball("mm", 1.0), ball("µm", 1000.0), ball("", 1.0), ball("", 1.0).to_mesh()
REFUSED = r"expected an isosurface in mm, as .* are, got one in µm: scale it by 0\.001, in a Scene by its transform"


def test_objects_of_two_units_are_refused():
    for make in (lambda: isospline.Scene([MM, UM]), lambda: isospline.Scene(BARE, MM, MESH, UM)):
        with pytest.raises(ValueError, match=f"objects: {REFUSED}"):
            make()
    scene = isospline.Scene([MESH, BARE, MM])
    with pytest.raises(ValueError, match=f"obj: {REFUSED}"):
        scene.add(UM)
    with pytest.raises(ValueError, match="obj: .*, got one in furlong: scale it, in a Scene"):
        scene.add(ball("furlong", 1.0), [[0.8, 0, 0, 0], [0, -1.2, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    assert scene.ids == [0, 1, 2]  # and none was used
    for same in (ball("millimeters", 1.0), MM, BARE, MESH):
        scene.add(same)
    scene.remove(2), scene.remove(3), scene.remove(4)
    scene.add(UM)
    with pytest.raises(ValueError, match="obj: expected an isosurface in µm, as .*, got one in mm: scale it by 1000"):
        scene.add(MM)


def test_transforms_convert():
    scene = isospline.Scene([(UM, TO_MM), MM])
    np.testing.assert_allclose(scene.bounds, MM.volume.bounds, atol=1)
    moved = scene.add(UM, TO_MM)
    for back in (None, np.eye(4)):
        with pytest.raises(ValueError, match=f"transform: {REFUSED}"):
            scene.set_transform(moved, back)
    np.testing.assert_array_equal(scene.transform(moved), TO_MM)
    scene.set_transform(moved, 2 * TO_MM - np.diag([0, 0, 0, 1]))
    scene.set_transform(1, np.diag([-1, 1, 1, 1]))
    for same in (copy.copy(scene), copy.deepcopy(scene), pickle.loads(pickle.dumps(scene))):
        assert same.ids == scene.ids
    with pytest.raises(ValueError, match=r"transform: expected shape \(4, 4\)"):
        scene.set_transform(moved, np.eye(3))
    with pytest.raises(ValueError, match="geometry_id"):
        scene.set_transform(99, None)


def test_the_unit_of_a_picture_is_that_of_its_world():
    near = np.diag([1.1, 0.9, 1, 1])  # as a registration
    for objects, unit in (
        ([MM, MESH], "mm"),
        ([MM, ball("millimeter", 1.0)], "mm"),
        ([(UM, TO_MM), MM], "mm"),
        ([(MM, near)], "mm"),
        ([(UM, TO_MM)], ""),
        ([MM, BARE], ""),
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
    assert isospline.surface_distance(MM, isospline.Scene([(UM, TO_MM)]), samples=10).rms.value < 1e-5
