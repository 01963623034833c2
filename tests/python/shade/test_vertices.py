"""Normals and colours at the vertices of meshes, against barycentric weights."""

import numpy as np
import pytest
from layered import render
from spheres import mesh_sphere

import isospline
from isospline.colors import linear

SIZE = (90, 70)


@pytest.fixture
def camera():
    return isospline.PerspectiveCamera((4, -25, 3), (0, 0, 0), field_of_view=30)


def barycentric(points, corners):
    """Weights of the corners, by least squares; the corners span a plane."""
    system = np.vstack([corners.T, np.ones(3)])
    return np.linalg.lstsq(system, np.c_[points, np.ones(len(points))].T, rcond=None)[0].T


CORNERS = np.array([(-4, 1, -3), (5, 0, -2), (0.5, 2, 4.0)])
PLACED = np.array([(0, 0.5, -1.2, 0.3), (0.2, 1.1, 0.4, -1), (1.3, 0, 0.1, 0.2), (0, 0, 0, 1)])


@pytest.mark.parametrize("transform", [np.eye(4), PLACED], ids=["in place", "transformed"])
def test_vertex_colors_are_linear_between_the_corners(camera, transform):
    colors = np.array([(1, 0, 0.2), (0.1, 1, 0), (0, 0.3, 0.9)])
    scene = isospline.Scene()
    scene.add(isospline.Mesh(CORNERS, [(0, 1, 2)], colors=linear(colors)), transform)
    light = isospline.Phong(ambient=1, diffuse=0, specular=0, lights=[], color=linear((0.5, 1, 0.7)))
    image = render(scene, camera, size=SIZE, light=light)
    seen = np.isfinite(image.depth)
    assert seen.sum() > 300
    placed = CORNERS @ transform[:3, :3].T + transform[:3, 3]
    weights = barycentric(image.position[seen].astype(float), placed)
    np.testing.assert_allclose(image.color[seen, :3], weights @ colors * (0.5, 1, 0.7), atol=5e-6)


MIRRORED = np.diag([-1, 1, 1, 1])


@pytest.mark.parametrize("transform", [np.eye(4), PLACED, MIRRORED], ids=["in place", "transformed", "mirrored"])
def test_vertex_normals_are_interpolated(camera, transform):
    normals = np.array([(-0.3, -1, -0.2), (0.4, -2, 0), (0, -0.7, 0.3)])
    mesh = isospline.Mesh(CORNERS, [(0, 1, 2)], normals=normals)
    np.testing.assert_array_equal(mesh.normals, normals)
    scene = isospline.Scene()
    scene.add(mesh, transform)
    image = render(scene, camera, size=SIZE)
    seen = np.isfinite(image.depth)
    placed = CORNERS @ transform[:3, :3].T + transform[:3, 3]
    units = normals / np.linalg.norm(normals, axis=1)[:, None]
    expected = barycentric(image.position[seen].astype(float), placed) @ units @ np.linalg.inv(transform[:3, :3])
    expected /= np.linalg.norm(expected, axis=1)[:, None]
    # Either all of them are on the visible side of the triangle, or none is.
    to_eye = camera.eye - image.position[seen]
    assert seen.sum() > 300 and len(np.unique(np.sign((expected * to_eye).sum(1)))) == 1
    np.testing.assert_allclose(image.normal[seen], expected, atol=5e-6)
    # Queries keep to the faces.
    hits = scene.cast_rays(camera.rays(SIZE)[seen])
    assert np.ptp(hits["primitive_normals"], axis=0).max() < 1e-12


@pytest.mark.parametrize("corners", [(0, 1, 2), (0, 2, 1)])
def test_a_normal_that_tips_over_the_horizon_stays_on_it(corners):
    """Two of them do, and the one above faces the viewer, as the triangle does."""
    vertices, normals = [(-1, 0, -1), (1, 0, -1), (0, 0, 2)], [(0, 0.3, 1), (0, 0.3, 1), (0, -1, 0)]
    mesh = isospline.Mesh(vertices, [corners], normals=normals)
    camera = isospline.OrthographicCamera((0, -5, -0.9), (0, 0, -0.9), height=0.1)
    normal = render(isospline.Scene([mesh]), camera, size=(4, 4)).normal
    np.testing.assert_allclose(normal, np.broadcast_to((0, 0, 1), (4, 4, 3)), atol=1e-5)
    assert (normal[..., 1] < 0).all()  # towards the viewer, as the face


@pytest.mark.parametrize("light", [isospline.Phong(two_sided=False), "studio", "ambient-occlusion", "outline"])
def test_normals_of_vertices_tell_the_outer_side(camera, light):
    """A mesh that was mirrored by another library, with its faces as they were."""
    ball = mesh_sphere(4.0, 32)
    images = [
        render(isospline.Mesh(ball.vertices, faces, normals=ball.vertices), camera, size=SIZE, light=light)
        for faces in (ball.faces, ball.faces[:, ::-1])
    ]
    seen = np.isfinite(images[0].depth)
    outward = images[0].position[seen] / np.linalg.norm(images[0].position[seen], axis=1)[:, None]
    assert np.quantile(np.abs(images[0].normal[seen] - outward).max(axis=1), 0.9) < 0.02
    np.testing.assert_allclose(images[1].normal, images[0].normal, atol=1e-6)
    assert np.abs(images[1].color - images[0].color).max() < 1e-5


def test_colors_at_vertices_are_srgb():
    colors = np.array([(0, 10, 255), (55, 128, 200), (1, 2, 3)], np.uint8)
    value = colors / 255
    light = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    for given in (colors, value, linear(light)):
        mesh = isospline.Mesh(CORNERS, [(0, 1, 2)], colors=given)
        np.testing.assert_allclose(mesh._colors(), light, rtol=1e-12)
        np.testing.assert_allclose(mesh.colors, value, atol=1e-12)
    assert isospline.Mesh(CORNERS, [(0, 1, 2)]).colors is None and isospline.Mesh(CORNERS, [(0, 1, 2)]).normals is None
