"""The examples run, on small sizes."""

import os
import runpy
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.slow

# Calls that write a file.
WRITING = ("image.write", "part.write", ".save(", ".savefig(", ".tofile(", "write_video(")
EXAMPLES = sorted((Path(__file__).resolve().parents[3] / "examples").glob("*.py"))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs(path, tmp_path):
    source = path.read_text(encoding="utf-8")
    assert len(source.splitlines()) < 60
    if "ISOSPLINE_VOLUMES" in source:
        pytest.importorskip("pyoidn")
        if not os.environ.get("ISOSPLINE_VOLUMES"):
            pytest.skip("ISOSPLINE_VOLUMES is not set")
    runpy.run_path(str(path))["main"](samples=24, size=(24, 18), folder=tmp_path)
    written = sorted(tmp_path.iterdir())
    assert bool(written) == any(call in source for call in WRITING)
    assert all(picture.name.startswith(path.stem[:3]) and picture.stat().st_size > 100 for picture in written)


def example(stem, **arguments):
    (path,) = (path for path in EXAMPLES if path.stem == stem)
    return runpy.run_path(str(path))["main"](**arguments)


def test_ray_queries_find_the_sphere():
    points, normals = example("030-ray-queries")
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 0.7, atol=1e-4)
    np.testing.assert_allclose(normals, points / 0.7, atol=1e-3)


def test_world_space_places_the_sphere():
    assert example("090-world-space") == pytest.approx(30 - 0.7, abs=1e-3)


def test_higher_degrees_come_closer_to_the_formula():
    errors = example("040-sample-the-model")
    assert errors[5, 0] < errors[3, 0] < errors[2, 0] < errors[1, 0]
    assert errors[5, 2] < errors[3, 2] < 0.1


def test_voxel_hopping_finds_the_hits_of_the_scene():
    scene_hits, hopper_hits = example("110-voxel-hopping")
    np.testing.assert_allclose(scene_hits["t_hit"], hopper_hits["t_hit"], rtol=1e-6)
    np.testing.assert_array_equal(scene_hits["primitive_ids"], hopper_hits["primitive_ids"])


def test_thickness_is_that_of_the_heart(tmp_path):
    thickness = example("175-thickness", folder=tmp_path, size=(60, 50))
    assert 1.2 < thickness.max() < 1.3  # its left half is an ellipsoid of 1.25
    assert (thickness > 0.01).mean() > 0.4 and thickness.min() > -1e-9


def test_closest_points_of_a_torus_are_the_closed_form(tmp_path):
    points, nearest = example("180-closest-points", folder=tmp_path, size=(24, 18))
    distance = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 0.5, points[:, 2]) - 0.24
    np.testing.assert_allclose(nearest["distances"], np.abs(distance), atol=1e-3)


def test_common_guesses_of_names_work(tmp_path):
    image = example("200-first-try", samples=32, size=(32, 24), folder=tmp_path)
    assert 0.05 < (np.asarray(image)[..., :3] < 200).any(axis=-1).mean() < 0.8
    assert example("210-photograph", samples=48, size=(33, 25), folder=tmp_path) == pytest.approx(3.3, abs=1e-3)
    assert example("215-scan-beside-part", samples=48, size=(24, 18), folder=tmp_path) < 1e-3
    assert example("220-all-walls") == pytest.approx(3 * 4 * 0.25 / 2, abs=1e-2)
    depths = example("205-other-processes", size=(32, 24))
    assert depths[0] == pytest.approx(depths[2], abs=1e-2) and depths[1] < depths[0]


def test_meshes_and_measures_match_the_solids(tmp_path):
    part = example("235-print-it", samples=48, folder=tmp_path)
    assert part == pytest.approx(1.6**3 / 2, rel=0.1)  # a gyroid halves space
    volume, area, thickness = example("240-measure")
    assert volume == pytest.approx(2 * np.pi**2 * 0.5 * 0.24**2, rel=1e-4)
    assert area == pytest.approx(4 * np.pi**2 * 0.5 * 0.24, rel=1e-4)
    assert thickness == pytest.approx(0.48, rel=1e-2)
    distance = example("245-compare")
    assert 0 < distance.mean.value < 0.01 and distance.maximum[0] < 0.01


def test_sign_tests_lose_pixels(tmp_path):
    lost, wrong = example("255-lost-pixels", size=(120, 100), folder=tmp_path)
    assert 0.01 < lost < 0.04 and 0.05 < wrong < 0.15


def test_pruning_leaves_the_cells_of_table_1(tmp_path):
    """Table 1 of the paper has 80, 67, 60 and 57% for another volume on the same grid."""
    counts = np.array(example("270-paper-figures", size=(32, 18), folder=tmp_path))
    np.testing.assert_allclose(counts[1:] / counts[0], (0.80, 0.67, 0.60, 0.57), atol=0.04)


def test_instances_are_built_once(tmp_path):
    scene = example("165-instances-and-masks", folder=tmp_path, samples=24, size=(24, 18))
    assert (len(scene), scene.build_count) == (170, 2)


def test_a_mesh_is_closed_and_as_near_as_told(tmp_path):
    mesh, distance = example("187-mesh-out", folder=tmp_path, size=(32, 18))
    shape = mesh.to_trimesh()
    assert shape.is_watertight and shape.euler_number == 0
    assert distance <= 0.02
    # The volume of the torus, 2 pi^2 R r^2, to within the tolerance times the area.
    assert shape.volume == pytest.approx(2 * np.pi**2 * 0.5 * 0.24**2, abs=shape.area * 0.02)
