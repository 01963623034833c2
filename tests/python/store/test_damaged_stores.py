"""Stores with damaged metadata: a ValueError that names the store, or what is left is a store."""

import copy
import json
import os
import shutil
import time

import numpy as np
import pytest

import isospline
from isospline.cli.main import main

pytest.importorskip("zarr")

DOCUMENTS = [f"{key}zarr.json" for key in ("", "coefficients/0/", "ranges/0/", "0/", "coefficients/", "ranges/")]

DELETED = object()

VALUES = [
    *(None, True, -1, 0, 7, 10**30, -(10**400), 0.5, float("nan"), float("inf"), 1e308, "", "x", "../..", "a" * 5000),
    *("\ud800", [], {}, [[]], [None] * 3, [1, 2, 3], [2**31] * 3, [2**30] * 3, [-1] * 3, [0.5] * 3, ["1"] * 3),
    *([2**30] * 5, [[1, 0, 0]] * 3, [[10**400] * 3] * 3, [{}], "float64", "ranges/0", DELETED),
]

TEXTS = [b"", b"{", b"\xff\xfe", b"null", b"[]", b"1" * 5000, b'{"a":' * 100_000, b"{}" * 3, bytes(1000)]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    z, y, x = np.mgrid[:20, :18, :22].astype(np.float32)
    squares = (z - 10) ** 2 + (y - 9) ** 2 + (x - 11) ** 2
    return isospline.convert(squares, tmp_path_factory.mktemp("made") / "a.zarr")


@pytest.fixture
def store(made, tmp_path):
    return shutil.copytree(made, tmp_path / "a.zarr")


def places(tree, at=()):
    """The keys of all values in a tree of JSON."""
    yield at
    for key in tree if isinstance(tree, dict) else range(len(tree)) if isinstance(tree, list) else ():
        if key != "conversion":
            yield from places(tree[key], (*at, key))


def changed(tree, at, value):
    """A copy of a tree with another value."""
    if not at:
        return value
    tree = copy.deepcopy(tree)
    inner = tree
    for key in at[:-1]:
        inner = inner[key]
    if value is DELETED:
        del inner[at[-1]]
    else:
        inner[at[-1]] = value
    return tree


def use(store):
    """Whether a store opens and works; otherwise a ValueError must name it."""
    begin = time.perf_counter()
    try:
        surface = isospline.Isosurface(isospline.open_volume(store), 25.0)
        isospline.Scene([surface]).cast_rays([[0, 0, 0]], [[1, 1, 1]])
        return True
    except ValueError as error:
        # A transform that is valid in itself, but too large for a scene, is no damage.
        assert str(store) in str(error) or "transform: expected sizes" in str(error)
        assert len(str(error)) < len(str(store)) + 800
        return False
    finally:
        assert time.perf_counter() - begin < 20


@pytest.mark.sweep(2)
@pytest.mark.filterwarnings("ignore")  # values in range may leave no surface
@pytest.mark.parametrize("document", DOCUMENTS[:4])
def test_changed_values_are_refused_or_harmless(store, document, rng):
    path = store / document
    tree = json.loads(path.read_text(encoding="utf-8"))
    results = []
    for at in places(tree):
        for number in rng.choice(len(VALUES), 3, replace=False):
            if at or VALUES[number] is not DELETED:
                path.write_text(json.dumps(changed(tree, at, VALUES[number])), encoding="utf-8")
                results.append(use(store))
    path.write_text(json.dumps(tree), encoding="utf-8")
    assert use(store) and any(results)
    assert not all(results) or document == "0/zarr.json"  # of the image, for other programs


@pytest.mark.parametrize("document", DOCUMENTS)
def test_files_that_are_no_json_are_refused(store, document):
    path = store / document
    text = path.read_bytes()
    is_read = document in DOCUMENTS[:3]
    for content in (*TEXTS, text[:50], text + b"x"):
        path.write_bytes(content)
        assert use(store) != is_read
    path.unlink()
    assert use(store) != is_read
    for make in (os.mkfifo, os.mkdir):
        make(path)
        assert use(store) != is_read
        path.unlink() if make is os.mkfifo else path.rmdir()


DAMAGES = {
    "zarr.json": "zarr.json: expected a file of JSON, got none",
    "coefficients": r"levels\[0\]: coefficients/0/zarr\.json: expected a file of JSON, got none",
    "ranges/0": r"levels\[0\]: ranges/0/zarr\.json: expected a file of JSON, got none",
    "ranges/0/c": "chunk ranges/0/c/0/0/0/0/0 cannot be read: it is missing or truncated",
    "coefficients/0/c": "coefficients/0/c/0/0/0",
}


@pytest.mark.parametrize("key", DAMAGES)
@pytest.mark.parametrize("is_file", [False, True])
def test_missing_parts_are_named(store, key, is_file, capsys):
    path = store / key
    path.unlink() if path.is_file() else shutil.rmtree(path)
    if is_file:
        path.write_bytes(b"")
    expected = "expected JSON" if key == "zarr.json" and is_file else DAMAGES[key]
    with pytest.raises(ValueError, match=rf"a\.zarr.*{expected}"):
        isospline.open_volume(store).sample([[10, 9, 11]])
    assert main(["info", str(store)]) == 2
    printed = capsys.readouterr().err
    assert "a.zarr" in printed and printed.count("\n") == 1


@pytest.mark.parametrize("degree", [1, 2])
def test_ranges_must_cover_the_cells(tmp_path, degree):
    """33 samples have 33 cells at degree 2, and 32 at degree 1: 3 and 2 octets of 16 cells."""
    store = isospline.convert(np.random.default_rng(0).random((33, 33, 33)), tmp_path / "a.zarr", degree=degree)
    path = store / "ranges/0/zarr.json"
    tree = json.loads(path.read_text(encoding="utf-8"))
    octets = {1: 2, 2: 3}[degree]
    assert tree["shape"] == [octets] * 3 + [2, 8]
    for wrong in (octets - 1, octets + 1):
        path.write_text(json.dumps(changed(tree, ("shape",), [wrong, octets, octets, 2, 8])), encoding="utf-8")
        with pytest.raises(ValueError, match=rf"a\.zarr: levels\[0\]: ranges/0: expected shape \({octets}, {octets}"):
            isospline.open_volume(store)


def test_a_damaged_series_is_refused(tmp_path):
    store = isospline.convert(np.zeros((2, 8, 8, 8)), tmp_path / "a.zarr")
    path = store / "zarr.json"
    tree = json.loads(path.read_text(encoding="utf-8"))
    with pytest.raises(ValueError, match=r"a\.zarr: expected one volume"):
        isospline.open_volume(store)
    for value in (7, None, {}, "t/0", [7], [None, {}], ["t/1", "t/0"], [["t/0"]]):
        path.write_text(json.dumps(changed(tree, ("attributes", "isospline", "time_steps"), value)), encoding="utf-8")
        with pytest.raises(ValueError, match=r"a\.zarr: "):
            isospline.open_volume(store)
        if value is not None:
            with pytest.raises(ValueError, match=r"a\.zarr: time_steps: expected"):
                isospline.store.time_steps(store)
