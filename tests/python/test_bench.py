"""The benchmark: its oracle is right, and a small run of it writes what it should."""

import json
import sys

import numpy as np
import pytest
from scipy import ndimage


@pytest.fixture
def bench(repository, monkeypatch):
    monkeypatch.syspath_prepend(repository / "bench")
    yield
    for name in [name for name in sys.modules if name.split(".")[0] in ("compare", "comparison")]:
        del sys.modules[name]


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_oracle_finds_the_first_change_of_sign(bench, rng, degree):
    from comparison.oracle import Oracle

    data = rng.normal(size=(7, 8, 9))
    oracle = Oracle(data, 0.2, np.diag([0.5, 2.0, 1.0, 1.0]), degree, "mirror")
    rays = np.concatenate([rng.uniform(-4, 12, (60, 3)), rng.normal(size=(60, 3))], axis=1)
    rays[:20, 3:] = (rng.uniform(1, 6, (60, 3)) * [0.5, 2.0, 1.0] - rays[:, :3])[:20]
    origins, directions = oracle.to_index(rays)
    found = 0
    for origin, direction, t_hit in zip(origins, directions, oracle.first_crossings(rays)):
        planes = oracle.plane_crossings(origin, direction)
        if len(planes) < 2:
            assert t_hit == np.inf
            continue
        t = np.linspace(planes[0], planes[-1], 4000)
        coordinates = (origin + t[:, None] * direction).T[::-1]
        above = ndimage.map_coordinates(data, coordinates, order=degree, mode="mirror") >= 0.2
        changes = np.flatnonzero(above[1:] != above[:-1])
        if len(changes):
            assert t_hit <= t[changes[0] + 1]
            found += 1
        if np.isfinite(t_hit):
            assert abs(oracle.values((origin + t_hit * direction)[None])[0]) < 1e-10
            assert (above[t < t_hit] == above[0]).all()
    assert found > 15


def test_oracle_sees_both_roots_of_a_close_pair(bench):
    from comparison.oracle import first_sign_change
    from numpy.polynomial import chebyshev

    for gap in (1e-2, 1e-4, 1e-6):
        series = chebyshev.poly2cheb(np.polynomial.polynomial.polyfromroots([0.3 - gap, 0.3 + gap, 2.0]))
        assert first_sign_change(series) == pytest.approx(0.3 - gap, abs=1e-7)
    assert first_sign_change(chebyshev.poly2cheb([1e-6 + 0.09, -0.6, 1.0])) is None


def test_a_small_run(bench, tmp_path, capsys):
    import compare

    status = compare.main([
        "--fields", "gyroid", "--sizes", "24", "--size", "40", "30", "--real", "none", "--repetitions", "1",
        "--oracle-rays", "200", "--output", str(tmp_path), "--threads", "0",
        "--methods", "hop_bracket", "hop_exact", "stride_exact", "embree_bracket", "embree_exact",
    ])  # fmt: skip
    assert status == 0
    assert "ratio" in capsys.readouterr().out
    summary = json.loads((tmp_path / "compare.json").read_text())
    assert summary["isotropic_hop_length"] == pytest.approx(2 / 3, abs=2e-3)
    assert {"cpu", "cores", "commit", "date", "versions"} <= set(summary["machine"])
    assert [result["view"] for result in summary["results"]] == ["whole", "close"]
    for result in summary["results"]:
        for name in ("hop_exact", "stride_exact", "embree_exact"):
            method = result["methods"][name]
            assert (method["differ"], method["oracle"]["lost"], method["oracle"]["wrong"]) == (0, 0, 0)
        assert result["methods"]["hop_bracket"]["ratio"] == 1.0
