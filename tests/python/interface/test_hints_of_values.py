"""Hints for values of other types, for values by position, and for misspelt names."""

import re

import pytest

import isospline
from isospline import volumes
from isospline.base import foreign


@pytest.fixture(scope="module")
def surface():
    return isospline.Isosurface(volumes.torus().volume(8), 0.0)


LAMPS = [isospline.DirectionalLight((0, 0, 1)), isospline.PositionalLight((0, 0, 3))]
LAMPS += [isospline.EnvironmentLight(1.0), isospline.SphereLight((0, 0, 3), 1.0)]
LAMPS += [isospline.RectangleLight((0, 0, 3), (1, 0, 0), (0, 1, 0))]


@pytest.mark.parametrize("lamps", [*LAMPS, LAMPS[:1], LAMPS[:2], LAMPS[1:3], LAMPS], ids=lambda value: str(value)[:30])
@pytest.mark.parametrize("call", ["render", "ProgressiveRenderer"])
def test_lights_of_lamps_run(surface, call, lamps):
    function = getattr(isospline, call)
    with pytest.raises(TypeError, match="; did you mean ") as caught:
        function(surface, size=(4, 3), light=lamps)
    given = lamps if isinstance(lamps, list) else [lamps]
    for meaning in str(caught.value).partition("did you mean ")[2].rstrip("?").split(" or "):
        light = eval(re.sub(r"\[.*\]", "lamps", meaning.removeprefix("light=")), {**vars(isospline), "lamps": given})
        function(surface, size=(4, 3), light=light)


def test_too_many_by_position(surface):
    for call, hint in (
        (lambda: surface.volume.sample([(0, 0, 0)], 1), "derivative=1"),
        (lambda: surface.volume.sample([(0, 0, 0)], "gradient"), None),
        (lambda: surface.volume.sample([(0, 0, 0)], 1.5), None),
        (lambda: isospline.SphereLight((0, 0, 0), 1.0, 5.0), "radiance=5.0"),
        (lambda: isospline.SphereLight((0, 0, 0), 1.0, (1, 0.5, 0)), "radiance=(1, 0.5, 0)"),
        (lambda: isospline.SphereLight((0, 0, 0), 1.0, (1, 0.5)), None),
        (lambda: isospline.DirectionalLight((0, 0, 1), surface), None),
        (lambda: isospline.ColorByDepth("viridis", (0.0, 1.0)), "limits=(0.0, 1.0)"),
        (lambda: isospline.ColorByDepth("viridis", 3.0), None),
        (lambda: surface.contains([(0, 0, 0)], True), "certify=True"),
        (lambda: surface.contains([(0, 0, 0)], 1e-3), None),
    ):
        with pytest.raises(TypeError, match="in position") as caught:
            call()
        assert str(caught.value).partition("; did you mean ")[2] == (f"{hint}?" if hint else "")


@pytest.mark.parametrize(
    ("name", "known", "meant"),
    [
        ("colour", ["color", "cap_color"], "color"),
        ("lveel", ["level"], "level"),
        ("fieldofview", ["field_of_view"], "field_of_view"),
        ("IsoSurface", ["Isosurface"], "Isosurface"),
        ("samplse", ["samples"], "samples"),
        ("labels", ["largest", "level"], None),
        ("label", ["level", "name"], None),
        ("base_color", ["cap_color", "surface_color"], None),
        ("min_distance", ["max_distance"], None),
        ("right", ["light"], None),
        ("side", ["size"], None),
        ("edge_w", ["edge_u", "edge_v"], None),
        ("", ["level"], None),
        ("x", ["level"], None),
    ],
)
def test_only_misspellings_are_close(name, known, meant):
    assert foreign.close_name(name, known) == meant


def test_one_edit_of_any_name_is_close():
    """All edits of one letter of some names, made by brute force; words with two edits are not."""
    letters = "abcdefghijklmnopqrstuvwxyz"
    for right in ("opacity", "silhouette_exponent", "level"):
        for i in range(1, len(right)):
            edits = {right[:i] + right[i + 1 :]} | {right[:i] + a + right[i:] for a in letters}
            edits |= {right[:i] + a + right[i + 1 :] for a in letters}
            edits |= {right[:i] + right[i + 1 : i + 2] + right[i] + right[i + 2 :]}
            assert all(foreign.close_name(each, [right]) == right for each in edits)
        assert foreign.close_name(right[:1] + "xx" + right[3:], [right]) is None
        assert foreign.close_name("xx" + right, [right]) is None
