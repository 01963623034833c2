"""Certificates of rays: true by exact arithmetic, checked by a program of its own, and false if a number is changed."""

import ast
import copy
import json
import subprocess
import sys

import numpy as np
import pytest

import isospline
from isospline import certificates, volumes
from isospline.certificates import CertificateError, checker

STATUSES = {"miss": 0, "hit": 1, "undecided": 2}


@pytest.fixture(scope="module")
def scene():
    field = volumes.sphere()
    return isospline.Scene(isospline.Isosurface(field.volume(20), field.level))


@pytest.fixture(scope="module")
def volume(scene):
    return scene.object(0).volume


@pytest.fixture(scope="module")
def hit(scene):
    return scene.certificate((-3, 0.11, 0.23, 1, 0.05, 0.01))


@pytest.mark.sweep(1)
@pytest.mark.filterwarnings("ignore:level .* has an empty shell")
@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("placed", [False, True])
def test_certificates_are_true_and_decide_more(degree, placed):
    pytest.importorskip("flint")
    from exact_rays import UNDECIDED, Case

    rng = np.random.default_rng(degree + 10 * placed)
    counts = dict.fromkeys(STATUSES, 0)
    for _ in range(4):
        case = Case(rng, degree, placed=placed)
        rays = case.rays(rng, 8)
        found = case.scene.cast_rays(rays, certify=True)
        for ray, status in zip(rays.tolist(), found.statuses, strict=True):
            certificate = case.scene.certificate(ray)
            statement = certificate["statement"]
            certificates.check(json.loads(json.dumps(certificate)), case.volume)
            counts[statement] += 1
            last = certificate.get(statement, {"from": np.inf, "to": np.inf, "bound": 0.0})
            bounds = last["from"], np.inf if statement == "undecided" else last["to"]
            bound = last.get("bound", 0.0) + 1e-12  # the oracle's point may be beside the lattice, within rounding
            assert case.holds(ray, STATUSES[statement], bounds, bound, 0, np.inf), (ray, certificate)
            assert statement == "undecided" or status in (UNDECIDED, STATUSES[statement])
    assert min(counts["hit"], counts["miss"]) >= 3 and counts["undecided"] < 6, counts


def test_a_hit_is_that_of_cast_rays(scene, hit):
    ray = [*hit["ray"]["origin"], *hit["ray"]["direction"]]
    found = scene.cast_rays(ray, certify=True)
    assert hit["statement"] == "hit" and [hit["hit"]["from"], hit["hit"]["to"]] == found.t_bounds.tolist()
    lower, upper = np.transpose(hit["hit"]["gradient"])
    middle = (lower + upper) / 2
    assert (upper - lower).max() < 1e-9
    assert -middle / np.linalg.norm(middle) == pytest.approx(found.primitive_normals, abs=1e-8)
    covers = hit["cover"]
    assert covers[0]["from"] == 0 and [each["to"] for each in covers[:-1]] == [each["from"] for each in covers[1:]]
    assert {each["reason"] for each in covers} == {"outside", "box", "polynomials"}


def numbers_in(data, path=()):
    """The paths of all numbers in nested lists and dicts."""
    if isinstance(data, (dict, list)):
        for key, value in data.items() if isinstance(data, dict) else enumerate(data):
            yield from numbers_in(value, (*path, key))
    elif isinstance(data, (int, float)) and not isinstance(data, bool):
        yield path


def changed(certificate, path, change, sealed):
    """A copy with one changed number; `sealed` makes the digest that of the changed content."""
    result = copy.deepcopy(certificate)
    inside = result
    for key in path[:-1]:
        inside = inside[key]
    inside[path[-1]] = change(inside[path[-1]])
    if sealed:
        result["digest"] = checker.digest(result)
    return result


CHANGES = {
    "next": lambda x: x + 1 if isinstance(x, int) else float(np.nextafter(x, np.inf)) if x else 2.0**-40,
    "before": lambda x: x - 1 if isinstance(x, int) else float(np.nextafter(x, -np.inf)) if x else -(2.0**-40),
    "negative": lambda x: -x if x != 0 else 7,
}


@pytest.mark.sweep(1)
@pytest.mark.parametrize("change", CHANGES)
def test_a_changed_number_is_noticed(hit, volume, change):
    coefficients = memoryview(volume._stored_coefficients.reshape(-1))
    paths = [*numbers_in(hit)]
    assert len(paths) > 80
    for path in paths:
        with pytest.raises(CertificateError):
            certificates.check(changed(hit, path, CHANGES[change], sealed=False), volume)
        # Even if the digest is made again: no number of a hit can be another.
        if path[:2] != ("model", "smoothing"):
            with pytest.raises((ValueError, ArithmeticError, LookupError)):
                checker.check(changed(hit, path, CHANGES[change], sealed=True), coefficients)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda found: found["cover"].pop(3),
        lambda found: found["cover"].reverse(),
        lambda found: found.update(statement="miss"),
        lambda found: found["cover"][2].update(side="above"),
        lambda found: found["cover"][1].update(reason="believe me"),
        lambda found: found["hit"]["polynomials"].clear(),
        lambda found: found["hit"].update({"from": found["hit"]["to"]}),
        lambda found: found["model"].update(shape=[-20, -20, 20]),
        lambda found: found["model"].update(shape=[8000, 1, 1]),
        lambda found: found["model"].update(shape=[20, 20, 20, True]),
        lambda found: found["model"].update(filter="none"),
        lambda found: found["model"].update(level="0.0"),
        lambda found: found["model"]["affine"].append([0.0, 0.0, 0.0, 1.0]),
        lambda found: found["model"]["affine"][0].append(0.0),
        lambda found: found["ray"].update(direction=[1.0, 0.05]),
        lambda found: found["cover"][0].update(axis=-3),
        lambda found: found.update(undecided={"from": 0.0, "to": 1.0, "bound": 0.0}),
        lambda found: found.update(version=True),
    ],
)
def test_a_spoiled_proof_is_noticed(hit, volume, spoil):
    spoiled = copy.deepcopy(hit)
    spoil(spoiled)
    spoiled["digest"] = checker.digest(spoiled)
    with pytest.raises(CertificateError, match="certificate: expected one"):
        certificates.check(spoiled, volume)


def test_a_false_statement_cannot_be_proven(scene, volume, hit):
    """A miss up to behind the crossing, with a cover that skips it."""
    forged = copy.deepcopy(hit)
    forged["statement"] = "miss"
    forged["ray"]["t_far"] = hit["hit"]["to"] + 1e-3
    forged["cover"].append({**hit["cover"][-1], "from": hit["hit"]["from"], "to": forged["ray"]["t_far"]})
    del forged["hit"]
    forged["digest"] = checker.digest(forged)
    with pytest.raises(CertificateError, match="is not proven to be free"):
        certificates.check(forged, volume)


@pytest.mark.filterwarnings("ignore:level 0 has an empty shell")
def test_what_cannot_be_said():
    """Sides that are none, misses without a cover, and doubts that are none."""
    flat = isospline.Volume(np.zeros((4, 4, 4)), degree=1)
    on_level = isospline.Scene(isospline.Isosurface(flat, 0.0)).certificate((1, 1, -1, 0, 0, 1))
    assert on_level["statement"] == "undecided" and on_level["undecided"]["bound"] == 0
    forged = {name: value for name, value in on_level.items() if name != "undecided"} | {"statement": "miss"}
    box = {"reason": "box", "first_cell": [0, 0, 0], "last_cell": [0, 0, 2], "side": "on"}
    ends = {"reason": "outside", "axis": 2}
    forged["cover"] = [
        {"from": 0.0, "to": 0.5, **ends, "side": "below"},
        {"from": 0.5, "to": 4.5, **box},
        {"from": 4.5, "to": None, **ends, "side": "above"},
    ]
    ramp = isospline.Volume(np.arange(4.0)[:, None, None] * np.ones((4, 4, 4)), degree=1)
    scene = isospline.Scene(isospline.Isosurface(ramp, 1.5))
    at_level = scene.certificate((1, 1, -1, 0, 0, 1), t_near=2.5, t_far=2.5)
    assert at_level["statement"] == "undecided"
    empty = {name: value for name, value in at_level.items() if name != "undecided"} | {
        "statement": "miss",
        "cover": [],
    }
    plain = scene.certificate((1, 1, -1, 0, 0, 1))
    long = {name: value for name, value in plain.items() if name != "hit"} | {"statement": "undecided", "cover": []}
    long["undecided"] = {"from": 0.0, "to": 4.0, "bound": 1.5}
    crossing = {name: plain["hit"][name] for name in ("from", "to")}
    bound = max(abs(x) for polynomial in plain["hit"]["polynomials"] for ends in polynomial for x in ends)
    doubted = long | {"cover": plain["cover"], "undecided": {**crossing, "bound": bound}}
    nowhere = scene.certificate((5, 1, -1, 0, 0, 1)) | {"statement": "undecided", "cover": []}
    nowhere["undecided"] = {"from": 0.0, "to": 2.0**-21, "bound": 0.0}
    for each, of in ((forged, flat), (empty, ramp), (long, ramp), (doubted, ramp), (nowhere, ramp)):
        with pytest.raises(CertificateError):
            certificates.check(each | {"digest": checker.digest(each)}, of)


def test_far_rays_and_rays_beside_an_edge():
    field = volumes.sphere()
    scene = isospline.Scene(isospline.Isosurface(field.volume(16), field.level))
    for ray in ((-4e15, 0.1, 0.2, 1, 0, 0), (-1e16, 0.1, 0.2, 1e16, 0, 0), (1e300, 1e300, 1e300, -1, -1, -1)):
        certificates.check(scene.certificate(ray), scene.object(0).volume)
    noise = isospline.Volume(np.random.default_rng(1).normal(size=(6, 6, 6)), degree=3)
    beside = isospline.Scene(isospline.Isosurface(noise, 0.0))
    certificate = beside.certificate((-0.125, 0.12499999999999999, 2.5, 4, -4, 0))
    assert certificate["statement"] == "miss"
    certificates.check(certificate, noise)


def test_another_volume_is_noticed(hit, volume):
    with pytest.raises(TypeError, match="volume: expected a Volume, got NoneType"):
        certificates.check(hit, None)
    samples = volume.sample(np.stack(np.meshgrid(*[np.linspace(-0.9, 0.9, 20)] * 3), -1))
    with pytest.raises(CertificateError, match="certificate: expected one that proves"):
        certificates.check(hit, isospline.Volume(samples, spacing=volume.spacing, origin=volume.origin))
    moved = isospline.Volume(np.zeros((20, 20, 20)), spacing=volume.spacing, origin=(0, 0, 1))
    with pytest.raises(CertificateError, match="is not that of the volume"):
        certificates.check(hit, moved)
    for damaged in ({}, {**hit, "cover": 3}, {**hit, "model": []}):
        with pytest.raises(CertificateError, match="certificate: expected one"):
            certificates.check(damaged, volume)


def test_the_checker_stands_alone(repository, tmp_path, hit, volume):
    path = repository / "python" / "isospline" / "certificates" / "checker.py"
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) < 200
    imported = {
        name.split(".")[0]
        for each in ast.walk(ast.parse(text))
        if isinstance(each, (ast.Import, ast.ImportFrom))
        for name in ([each.module] if isinstance(each, ast.ImportFrom) else [alias.name for alias in each.names])
    }
    assert imported <= {"fractions", "hashlib", "itertools", "json", "math", "pathlib", "sys"}
    certificates.write_coefficients(volume, tmp_path / "coefficients.f32")
    for certificate, code in ((hit, 0), (changed(hit, ("model", "level"), lambda x: x + 1, sealed=True), 1)):
        (tmp_path / "certificate.json").write_text(json.dumps(certificate), encoding="utf-8")
        files = [tmp_path / "certificate.json", tmp_path / "coefficients.f32"]
        ended = subprocess.run(
            [sys.executable, "-I", "-S", path, *files], capture_output=True, encoding="utf-8", check=False
        )
        assert ended.returncode == code, ended.stderr
        assert (ended.stdout == "proven\n") == (code == 0)


def test_limits_and_places_of_rays(scene, volume):
    ray = (-3, 0.11, 0.23, 1, 0.05, 0.01)
    crossing = scene.certificate(ray)["hit"]
    for limits, statement in (
        ({"t_far": crossing["from"]}, "miss"),
        ({"t_far": 1.0}, "miss"),
        ({"t_near": crossing["to"]}, "hit"),
        ({"t_near": 50.0}, "miss"),
        ({"t_near": -20.0, "t_far": crossing["to"]}, "hit"),
        ({"t_near": 1.0, "t_far": 1.0}, "miss"),
        ({"t_near": 2.5, "t_far": 2.5}, "miss"),
        ({"t_near": crossing["from"] - 1e-9, "t_far": crossing["from"] - 1e-9}, "miss"),
    ):
        found = scene.certificate(ray, **limits)
        assert found["statement"] == statement, limits
        certificates.check(found, volume)
    for beside in ((-3, 5, 0, 1, 0, 0), (-3, 0, 0, -1, 0, 0), (-3, 2, 0, 1, -1, 0), (-4, 4, 0, 1, -1, 0)):
        found = scene.certificate(beside)
        certificates.check(found, volume)
        assert found["statement"] == ("miss" if beside[0] == -3 and beside[1] != 2 else found["statement"])


def test_one_isosurface_of_several(volume):
    level = float(volume.sample([0.1, 0.2, 0.3]))
    surface = isospline.Isosurface(volume, level)
    moved = np.eye(4)
    moved[:3, 3] = 0, 4, 0
    scene = isospline.Scene([surface, (surface, moved), isospline.Mesh(np.eye(3), [(0, 1, 2)])])
    ray = (-3, 0.2, 0.3, 1, 0, 0)
    first, second = (scene.certificate(ray, geometry_id=id) for id in (0, 1))
    assert first["statement"] == "hit" and second["statement"] == "miss"
    assert second["model"]["transform"][1][3] == 4
    certificates.check(second, volume)
    with pytest.raises(ValueError, match="geometry_id: expected the id of an isosurface, because 3 objects are"):
        scene.certificate(ray)
    with pytest.raises(ValueError, match="geometry_id: expected the id of an isosurface, got that of a mesh"):
        scene.certificate(ray, geometry_id=2)
    with pytest.raises(ValueError, match="geometry_id: expected an id of the scene, got 9"):
        scene.certificate(ray, geometry_id=9)


@pytest.mark.parametrize(
    ("ray", "options", "message"),
    [
        ((0, 0, 0, 0, 0, 0), {}, "ray: expected six finite numbers, with a direction that is not zero"),
        ((0, 0, np.nan, 0, 0, 1), {}, "ray: expected six finite numbers"),
        ([(0, 0, 0, 0, 0, 1)], {}, r"ray: expected six finite numbers.*shape \(1, 6\)"),
        ((0, 0, 0, 0, 0, 1), {"t_near": 2, "t_far": 1}, "t_near: expected a finite number that is at most t_far"),
        ((0, 0, 0, 0, 0, 1), {"t_near": -np.inf}, "t_near: expected a finite number"),
        ((0, 0, 0, 0, 0, 1), {"t_near": None}, "t_near: expected numbers for t_near and t_far, got None and inf"),
        ((0, 0, 0, 0, 0, 1), {"geometry_id": "a"}, "geometry_id: expected an int, got 'a'"),
        ("abc", {}, "ray: expected an array of real numbers"),
        (np.ones(6) * 1j, {}, "ray: expected an array of real numbers"),
        ([(0, 0), (1, 2, 3)], {}, "ray: expected an array of real numbers"),
    ],
)
def test_bad_rays(scene, ray, options, message):
    with pytest.raises((ValueError, TypeError), match=message):
        scene.certificate(ray, **options)


def test_cut_surfaces_have_no_certificate(volume):
    cut = isospline.Isosurface(volume, 0.0, clip=[isospline.HalfSpace((0, 0, 0), (0, 0, 1))])
    with pytest.raises(ValueError, match="certify: expected isosurfaces that are neither clipped"):
        isospline.Scene(cut).certificate((0, 0, -3, 0, 0, 1))
