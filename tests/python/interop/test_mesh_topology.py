"""Edges, components and volumes of meshes. The oracles are SciPy and trimesh."""

import numpy as np
import pytest

from isospline.interop.mesh_topology import components_of, equal_rows, open_edges, signed_volumes

trimesh = pytest.importorskip("trimesh")


@pytest.mark.parametrize("count", [1, 30, 300, 3000])
def test_components_are_those_of_a_graph(rng, count):
    sparse = pytest.importorskip("scipy.sparse")
    from scipy.sparse import csgraph

    faces = rng.integers(0, 1000, (count, 3)).astype(np.uint32)
    labels, found = components_of(faces, 1000)
    ends = np.concatenate([faces[:, :2], faces[:, 1:]])
    graph = sparse.coo_matrix((np.ones(len(ends)), ends.T), (1000, 1000))
    of_vertices = csgraph.connected_components(graph, directed=False)[1]
    expected = of_vertices[faces[:, 0]]
    assert found == len(np.unique(expected)) == labels.max() + 1
    assert len(np.unique(np.stack([labels, expected]), axis=1).T) == found  # the same sets


def test_a_long_strip_is_one_component():
    """In an order of vertices that is far from that of the strip."""
    places = np.random.default_rng(3).permutation(20_002)
    faces = places[np.arange(20_000)[:, None] + np.arange(3)]
    labels, found = components_of(faces, 20_002)
    assert found == 1 and not labels.any()


def test_open_edges_are_those_that_trimesh_finds(rng):
    shape = trimesh.creation.icosphere(2)
    for faces, count in (
        (shape.faces, 0),
        (shape.faces[1:], 3),
        (np.concatenate([shape.faces, shape.faces[:1]]), 3),
        (np.concatenate([shape.faces[:1, ::-1], shape.faces[1:]]), 3),
        (shape.faces[[]], 0),
    ):
        assert open_edges(np.asarray(faces, np.uint32)) == count
        if len(faces):
            tested = trimesh.Trimesh(shape.vertices, faces, process=False)
            assert (tested.is_watertight and tested.is_winding_consistent) == (count == 0)


def test_volumes_have_the_sign_of_the_orientation():
    ball, box = trimesh.creation.icosphere(3, radius=2), trimesh.creation.box((1, 2, 3))
    vertices = np.concatenate([ball.vertices + (1e4, 0, 0), box.vertices])
    faces = np.concatenate([ball.faces, box.faces[:, ::-1] + len(ball.vertices)])
    labels, count = components_of(faces, len(vertices))
    assert signed_volumes(vertices, faces, labels, count) == pytest.approx([ball.volume, -6], rel=1e-9)


def test_equal_rows_are_grouped(rng):
    rows = rng.integers(-1, 2, (200, 3)) * 1.0
    rows[::3] *= -1.0  # some are -0.0
    first, groups = equal_rows(rows)
    expected = np.unique(rows + 0.0, axis=0, return_inverse=True)[1].reshape(-1)
    assert len(np.unique(np.stack([groups, expected]), axis=1).T) == len(first) == expected.max() + 1
    np.testing.assert_array_equal(rows[first][groups], rows)
