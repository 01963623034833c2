"""Hints for names of other libraries: the table, the errors that it makes, and the page of the documentation."""

import operator
import sys

import pytest

import isospline
from isospline.base import foreign

NAMES, KEYWORDS = foreign.tables()["names"], foreign.tables()["keywords"]
OWNERS = {name: isospline if name == "isospline" else getattr(isospline, name) for name in NAMES}
ROWS = [
    (owner, name, meaning)
    for owner, table in NAMES.items()
    for names, meaning in table.items()
    for name in names.split(", ")
]
KEYWORD_ROWS = [
    (call, keyword, meaning)
    for call, table in KEYWORDS.items()
    if call != "any"  # those are in test_hints_run.py
    for keywords, meaning in table.items()
    for keyword in keywords.split(", ")
]


@pytest.fixture(scope="module")
def objects():
    surface = isospline.Isosurface(isospline.volumes.torus().volume(8), 0.0)
    return {
        "isospline": isospline,
        "Isosurface": surface,
        "Volume": surface.volume,
        "VolumeData": isospline.VolumeData(isospline.volumes.torus().values(8)),
        "Mesh": surface.to_mesh(),
        "SurfaceDistance": isospline.surface_distance(surface, surface, samples=10),
        "Scene": isospline.Scene(surface),
        "Image": isospline.render(surface, size=(4, 4), light="phong"),
        "PerspectiveCamera": isospline.camera_for(surface),
    }


@pytest.mark.parametrize(("owner", "name", "meaning"), ROWS, ids=lambda value: str(value)[:40])
def test_an_unknown_name_is_answered(objects, owner, name, meaning):
    with pytest.raises(AttributeError) as caught:
        getattr(objects[owner], name)
    assert str(caught.value).endswith(f"has no attribute {name!r}; did you mean {meaning}?")


@pytest.mark.parametrize(("call", "keyword", "meaning"), KEYWORD_ROWS, ids=lambda value: str(value)[:40])
def test_an_unknown_keyword_is_answered(call, keyword, meaning):
    with pytest.raises(TypeError) as caught:
        operator.attrgetter(call)(isospline)(**{keyword: 1})
    assert str(caught.value) == f"{keyword}: unknown keyword of {call}; did you mean {meaning}?"


def test_close_names_are_answered_too(objects):
    for owner, name, meaning in (
        ("isospline", "Isosurfaces", "Isosurface"),
        ("Mesh", "verticez", "vertices"),
        ("Volume", "coefficientz", "coefficients"),
    ):
        with pytest.raises(AttributeError, match=rf"; did you mean {meaning}\?$"):
            getattr(objects[owner], name)
    with pytest.raises(AttributeError, match=r"has no attribute 'nonsense'$"):
        objects["Scene"].nonsense
    assert not hasattr(objects["Isosurface"], "__nonsense__")


def test_the_error_of_a_property_is_its_own(objects):
    with pytest.raises(AttributeError, match=r'^depth: expected render\(\.\.\., layers=\("depth",\)\)'):
        objects["Image"].depth


def test_the_page_has_the_table(repository, monkeypatch):
    monkeypatch.syspath_prepend(str(repository / "docs"))
    import names

    text = names.PAGE.read_text(encoding="utf-8")
    assert names.with_names(text) == text, "run: python docs/names.py"
    sys.modules.pop("names")


def test_dir_is_what_is_public():
    assert set(dir(isospline)) == {*isospline.__all__, "__version__"}
    assert all(not name.startswith("_") for name in isospline.__all__)
