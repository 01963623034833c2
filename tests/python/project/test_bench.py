"""The benchmark: its oracle is correct, and a small run writes the expected files."""

import copy
import json
import os
import subprocess
import sys

import numpy as np
import PIL.Image
import pytest
from scipy import ndimage

import isospline

pytestmark = pytest.mark.slow


@pytest.fixture
def bench(repository, monkeypatch):
    monkeypatch.syspath_prepend(repository / "bench")
    yield
    for name in [name for name in sys.modules if name.split(".")[0] in ("publish", "report", "rows", "run", "suite")]:
        del sys.modules[name]


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_oracle_finds_the_first_change_of_sign(bench, rng, degree):
    from suite.oracle import Oracle

    data = rng.normal(size=(7, 8, 9))
    oracle = Oracle(data, 0.2, np.diag([0.5, 2.0, 1.0, 1.0]), degree, "mirror")
    rays = np.concatenate([rng.uniform(-4, 12, (60, 3)), rng.normal(size=(60, 3))], axis=1)
    rays[:20, 3:] = (rng.uniform(1, 6, (60, 3)) * [0.5, 2.0, 1.0] - rays[:, :3])[:20]
    origins, directions = (array.astype(np.float64) for array in oracle.to_index(rays))
    found = 0
    for origin, direction, t_hit in zip(origins, directions, oracle.first_crossings(rays)):
        lower, upper = np.full(3, oracle.first_plane), oracle.first_plane + oracle.cells
        ends = np.sort([(lower - origin) / direction, (upper - origin) / direction], axis=0)
        enter, leave = max(0.0, ends[0].max()), ends[1].min()
        if enter >= leave:
            assert t_hit == np.inf
            continue
        t = np.linspace(enter, leave, 4000, dtype=np.float64)
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
    from numpy.polynomial import chebyshev
    from suite.oracle import first_sign_changes

    gaps = (1e-2, 1e-4, 1e-6)
    pairs = [np.polynomial.polynomial.polyfromroots([0.3 - gap, 0.3 + gap, 2.0]) for gap in gaps]
    none, touching_end = [1e-6 + 0.09, -0.6, 1.0], [-1.0, 1.0]
    series = np.zeros((5, 4))
    for row, given in zip(series, (*pairs, none, touching_end)):
        row[: len(given)] = chebyshev.poly2cheb(given)
    found = first_sign_changes(series)
    assert found[:3] == pytest.approx([0.3 - gap for gap in gaps], abs=1e-7)
    assert np.isnan(found[3])
    assert found[4] == 1


@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("boundary", ["mirror", "periodic"])
def test_oracle_leaves_out_only_cells_whose_coefficients_are_on_one_side(bench, rng, degree, boundary):
    from suite.oracle import MODES, Oracle

    data = rng.normal(size=(5, 6, 7))
    oracle = Oracle(data, 0.9, np.eye(4), degree, boundary, coefficients=data)
    before, behind = (degree + 1) // 2 - degree % 2, degree // 2 + degree % 2
    padded = np.pad(data, 3, mode={"mirror": "reflect", "grid-wrap": "wrap"}[MODES[boundary]])
    for z, y, x in np.ndindex(*reversed(oracle.cells)):
        reached = padded[tuple(slice(at + 3 - before, at + 3 + behind + 1) for at in (z, y, x))]
        assert reached.shape == (degree + 1,) * 3
        assert oracle.straddles[z, y, x] == (reached.min() <= 0.9 <= reached.max())


@pytest.mark.parametrize("seed", range(3))
def test_tiles_hold_each_pixel_once_and_neighbours_together(bench, seed):
    from suite.views import in_tiles

    width, height = 4 * np.random.default_rng(seed).integers(1, 9, 2)
    pixels = np.zeros((height, width, 6))
    pixels[..., 1], pixels[..., 0] = np.mgrid[:height, :width]
    tiles = in_tiles(pixels)
    assert len(np.unique(tiles[:, :2], axis=0)) == width * height
    spread = np.ptp(tiles.reshape(-1, 16, 6)[..., :2], axis=1)
    assert (spread == 3).all()
    with pytest.raises(ValueError, match="size: expected multiples of 4"):
        in_tiles(np.zeros((4, 6, 6)))


def test_mean_hop_over_isotropic_lines_is_cauchys(bench):
    from suite.views import isotropic_lines

    volume = isospline.Volume(np.zeros((48, 48, 48), np.float32))
    with pytest.warns(UserWarning):  # the shell is empty
        hopper = isospline.research.VoxelHopper(isospline.Isosurface(volume, 1.0))
    hopper.cast_rays(isotropic_lines(volume.bounds, 100_000, np.random.default_rng(0)))
    assert hopper.statistics["mean_hop_length"] == pytest.approx(2 / 3, abs=2e-3)


def test_directions_of_ambient_occlusion_are_cosine_distributed(bench):
    from suite.views import from_the_surface

    rays = np.array([[0.0, 0, 5, 0, 0, -2]])
    hits = {"t_hit": np.array([1.0]), "primitive_normals": np.array([[0.0, 0, -1]])}  # seen from its inside
    new = from_the_surface(rays, hits, 100_000, np.random.default_rng(0), 0.5)
    np.testing.assert_allclose(new[:, :3], np.tile([0, 0, 3.5], (len(new), 1)), atol=1e-12)
    cosine = new[:, 5]
    assert cosine.min() >= 0
    # density 2 cos d(cos): the mean is 2/3, the mean of the square 1/2
    assert cosine.mean() == pytest.approx(2 / 3, abs=5e-3)
    assert (cosine**2).mean() == pytest.approx(1 / 2, abs=5e-3)


def test_missed_goals_state_their_factor(bench):
    from suite.goal import at_least, at_most, none_of

    assert at_least("x", 4, {"a": 5.0, "b": 2.0}).verdict == "missed by a factor of 2.00"
    assert at_least("x", 4, {"a": 5.0, "b": 4.0}).verdict == "met"
    assert at_most("x", 4, {"a": 5.0, "b": 4.0}, "s").verdict == "missed by a factor of 1.25"
    assert "(a)" in at_most("x", 4, {"a": 5.0, "b": 4.0}, "s").measured
    assert none_of("x", {"a": 0, "b": 3}, 10**8).verdict == "missed by 3"
    assert none_of("x", {"a": 0}, 10**8).measured == "0 of 10^8"
    assert none_of("x", {}, 0).verdict == at_least("x", 4, {}).verdict == "not measured"


def test_a_goal_for_a_median_states_the_worst_as_well(bench):
    from suite.goal import at_least

    goal = at_least("x", 4, {"a": 1.0, "b": 5.0, "c": 6.0}, of_median=True)
    assert (goal.measured, goal.verdict) == ("5 times; worst 1 times (a)", "met")
    assert at_least("x", 4, {"a": 1.0, "b": 2.0}, of_median=True).verdict == "missed by a factor of 2.67"


def test_outliers_are_measured_again(bench):
    from suite.clock import OUTLIER, measure_outliers_again

    asked = []

    def measure(names):
        asked.append(list(names))
        return dict.fromkeys(names, 1.0)

    seconds = {"calm": [1.0, OUTLIER, 1.0], "disturbed": [1.0, 9.0, 1.0, 8.0, 1.0]}
    measure_outliers_again(seconds, measure)
    assert asked == [["disturbed"], ["disturbed"]]
    assert seconds == {"calm": [1.0, OUTLIER, 1.0], "disturbed": [1.0] * 5}

    hopeless = {"x": [1.0, 1.0, 5.0]}
    measure_outliers_again(hopeless, lambda names: {"x": 5.0})
    assert hopeless == {"x": [1.0, 1.0, 5.0]}


def test_the_spread_is_half_of_the_range(bench):
    from suite.clock import spread
    from suite.tables import markdown_table, with_spread

    text = with_spread(spread([0.009, 0.010, 0.012]), 1e3)
    assert text == "10 ±15%"
    assert "|---:|" in markdown_table(("ms",), [(text,)])


def test_memory_that_the_api_leaves_out_still_counts(bench):
    from rows import memory

    result = {"subject": "x", "cells": 100, "reported": 3000}
    all_told, left_out = (memory.goals([result | {"held": held}]) for held in (3000, 13_000))
    assert [goal.verdict for goal in all_told] == ["met", "met"]
    assert left_out[0].measured.startswith("130 bytes a cell")
    assert [goal.verdict.split()[0] for goal in left_out] == ["missed", "missed"]


def test_judge_counts_lost_and_wrong_hits(bench):
    from suite.judge import differences

    inf = np.inf
    t_true = np.array([1.0, 1.0, inf, inf, 1.0, 1.0])
    t_hit = np.array([1.0, inf, 1.0, inf, 1.1, 1.0 + 1e-5])
    found = differences(t_hit, t_true, np.full(6, 2.0))
    assert (found["lost"], found["wrong"]) == (1, 2)
    assert found["distance_max"] == pytest.approx(0.2)


def test_a_peer_that_ends_its_process_is_skipped_with_its_message(bench):
    from suite.peers import Skipped, require

    require("nothing", "pass")
    with pytest.raises(Skipped, match="it does not run here: LLVM ERROR: cannot select: f32"):
        require("it", "import os; os.write(2, b'LLVM ERROR: cannot select: f32 0xaf\\n more\\n'); os.abort()")
    with pytest.raises(Skipped, match="No module named 'no_such_module'"):
        require("it", "import no_such_module")


SMALL = [
    "--quick",
    "--procedural-size",
    "24",
    "--size",
    "32",
    "32",
    "--repetitions",
    "1",
    "--agreement-rays",
    "2000",
    "--accuracy-rays",
    "12",
    "--escape-rays",
    "3000",
    "--incoherent-rays",
    "1000",
    "--growth-sizes",
    "16",
    "24",
    "--level-sizes",
    "24",
    "--prefilter-sizes",
    "24",
    "--large-size",
    "40",
    "--threads",
    "0",
]


@pytest.fixture(scope="module")
def small_run(repository, tmp_path_factory):
    """The summary and the folder of a run of all rows at the smallest sizes, except rows with a window or Mitsuba."""
    if not (repository / "build" / "release" / "bench" / "isospline_bench").exists():
        pytest.skip("the C++ benchmarks have not been built: cmake --build --preset release")
    folder = tmp_path_factory.mktemp("bench")
    rows = [
        "primary",
        "packets",
        "incoherent",
        "growth",
        "level",
        "animation",
        "picture",
        "call",
        "importing",
        "agreement",
        "accuracy",
        "escape",
        "prefilter",
        "memory",
        "mesh",
        "answers",
        "large",
    ]
    command = [sys.executable, repository / "bench" / "run.py", *rows, *SMALL, "--output", folder]
    result = subprocess.run(command, capture_output=True, encoding="utf-8", check=False, env=os.environ)
    assert result.returncode == 0, result.stdout + result.stderr
    summary = json.loads((folder / "benchmarks.json").read_text(encoding="utf-8"))
    assert list(summary) == rows
    return summary, folder


@pytest.mark.long
def test_a_small_run_finds_no_mistake(bench, small_run):
    from report.document import all_goals

    summary, _ = small_run
    for entry in summary.values():
        assert {"cpu", "cores", "commit", "date", "versions"} <= set(entry["machine"])
        assert entry["results"] and not {"error", "skipped"} & set(entry)
    assert [result["view"] for result in summary["primary"]["results"]] == ["whole", "close"] * 2
    for row in ("primary", "packets"):
        assert [result["hit"] for result in summary[row]["results"] if result["view"] == "close"] == [1, 1]
    goals = {goal.what: goal for goal in all_goals(summary)}
    for what in ("lost or wrong pixels", "hits that differ", "position of the hit", "rays that escape"):
        (goal,) = (goal for name, goal in goals.items() if name.startswith(what))
        assert goal.verdict == "met", goal


@pytest.mark.long
def test_the_page_of_a_small_run(bench, small_run):
    from rows import ROWS

    summary, folder = small_run
    page = (folder / "benchmarks.md").read_text(encoding="utf-8")
    assert "a quick run, not for citing" in page
    for name in summary:
        assert f"## {ROWS[name].TITLE}\n" in page
    for goal, _ in ROWS["primary"].GOALS:
        assert f"| {goal} |" in page


@pytest.mark.long
def test_the_json_has_one_result_a_line(small_run):
    summary, folder = small_run
    lines = (folder / "benchmarks.json").read_text(encoding="utf-8").splitlines()
    results = [json.loads(line.removesuffix(",")) for line in lines if line.startswith("   {")]
    assert results == [result for entry in summary.values() for result in entry["results"]]


@pytest.mark.long
def test_plots_of_a_small_run(bench, small_run, tmp_path):
    pytest.importorskip("matplotlib")
    from report import plots

    summary = copy.deepcopy(small_run[0])
    paths = plots.write(summary, tmp_path)
    assert set(paths) == {"rates", "wrong", "growth"}
    for path in paths.values():
        with PIL.Image.open(path) as picture:
            assert min(picture.size) > 300
            assert len(picture.convert("RGB").getcolors(1 << 20)) > 20

    # If no method has wrong rays, the figure of wrong rays is not drawn.
    for result in summary["primary"]["results"]:
        for method in result["methods"].values():
            method["oracle"] |= {"lost": 0, "wrong": 0}
    assert set(plots.write(summary, tmp_path)) == {"rates", "growth"}
    assert not paths["wrong"].exists()


def test_a_row_that_was_not_measured_is_in_the_goals(bench):
    from report import document

    entry = {"results": [], "skipped": "no such thing"}
    assert "not measured: no such thing" in document.goal_table({"mitsuba": entry})


def test_simulated_clusters_obey_known_bounds(bench, rng):
    from suite.simulation import Network, Work, efficiency, enlarged, makespan

    instant = Network(machine=np.inf, store=np.inf, latency=0.0)
    same = Work(np.full(60, 2.0), np.zeros(60), np.zeros(60))
    assert [makespan(same, workers, instant) for workers in (1, 7, 60, 1000)] == [120, 18, 2, 2]
    uneven = Work(rng.exponential(size=200), np.zeros(200), np.zeros(200))
    for workers in (2, 9, 50):
        best = max(uneven.seconds.sum() / workers, uneven.seconds.max())  # no schedule is faster
        assert best <= makespan(uneven, workers, instant) <= (2 - 1 / workers) * best
    # Serial parts: the scheduler, the shared store, and the client's network.
    assert makespan(Work(np.zeros(50), np.zeros(50), np.zeros(50), overhead=0.1), 50, instant) == pytest.approx(5)
    shared = Network(machine=100.0, store=200.0, latency=0.0)
    assert makespan(Work(np.zeros(4), np.full(4, 50.0), np.zeros(4)), 4, shared) == pytest.approx(1)
    assert makespan(Work(np.zeros(4), np.zeros(4), np.full(4, 50.0)), 4, shared) == pytest.approx(2)
    assert efficiency(same, 60, instant) == 1
    costs = np.arange(6.0)
    assert enlarged(costs, 3, 2).reshape(4, 6)[::2, ::2].tolist() == costs.reshape(2, 3).tolist()


def test_the_published_page_is_up_to_date(bench, repository):
    import publish

    published = [repository / "docs" / name for name in ("benchmarks.json", "benchmarks.md")]
    assert len({path.exists() for path in published}) == 1
    assert publish.MARKED.search((repository / "README.md").read_text(encoding="utf-8"))
    if published[0].exists():
        assert published[1].read_text(encoding="utf-8") == publish.page(repository)
        assert (repository / "docs" / "distributed.md").read_text(encoding="utf-8") == publish.distributed(repository)
        assert (repository / "README.md").read_text(encoding="utf-8") == publish.readme(repository)
