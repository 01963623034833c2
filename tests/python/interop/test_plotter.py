"""Ray traced isosurfaces in a PyVista Plotter: rays of isospline tell which pixels show the surface or the actor."""

import numpy as np
import pytest

import isospline
from isospline import add_to_plotter

pyvista = pytest.importorskip("pyvista")
SIZE = (160, 120)


def ball():
    field = isospline.volumes.sphere(0.7)
    return isospline.Isosurface(field.volume(32), field.level)


@pytest.mark.parametrize("parallel", [False, True])
def test_actors_and_surfaces_hide_each_other(parallel):
    surface, cube = ball(), pyvista.Cube(center=(0.5, -0.3, 0.2), x_length=0.9, y_length=0.7, z_length=0.6)
    plotter = pyvista.Plotter(off_screen=True, window_size=SIZE)
    plotter.background_color = "white"
    plotter.add_mesh(cube, color="red", lighting=False)
    plotter.camera_position = [(3, -4, 2), (0, 0, 0), (0, 0, 1)]
    blue = isospline.Phong(color=(0, 0, 1), ambient=1, diffuse=0, specular=0)
    picture = add_to_plotter(plotter, surface, light=blue)
    plotter.parallel_projection = parallel
    camera = plotter.camera
    shot = plotter.screenshot(return_img=True).astype(int)

    place = camera.position, camera.focal_point, camera.up
    ours = (
        isospline.OrthographicCamera.from_pyvista(place, camera.parallel_scale)
        if parallel
        else isospline.PerspectiveCamera.from_pyvista(place, camera.view_angle)
    )
    both = isospline.Scene([surface, isospline.Mesh.from_pyvista(cube)])
    ids = both.cast_rays(ours.rays(SIZE)).geometry_ids
    seen = np.full(ids.shape, 2)  # white
    seen[(shot[..., 2] > 128) & (shot[..., 0] < 128)] = 0
    seen[(shot[..., 0] > 128) & (shot[..., 2] < 128)] = 1
    expected = np.where(ids <= 1, ids, 2).astype(int)
    assert all((expected == id).mean() > 0.02 for id in range(3))
    assert (seen == expected).mean() > 0.985  # pixels at edges may differ

    surface.level = 0.1
    plotter.render()
    assert (plotter.screenshot(return_img=True) != shot).any()
    picture.remove()
    plotter.render()
    left = plotter.screenshot(return_img=True).astype(int)
    assert not ((left[..., 2] > 128) & (left[..., 0] < 128)).any()
    assert ((left[..., 0] > 128) & (left[..., 2] < 128)).sum() > (seen == 1).sum()


def test_plotters_with_several_views_are_refused():
    plotter = pyvista.Plotter(off_screen=True, shape=(1, 2))
    with pytest.raises(ValueError, match="plotter: expected one with a single view"):
        add_to_plotter(plotter, ball())


@pytest.mark.parametrize("parallel", [False, True])
@pytest.mark.parametrize("y", [-1.0, 1.0, 3.0])
def test_actors_beside_the_surfaces_are_seen(parallel, y):
    plotter = pyvista.Plotter(off_screen=True, window_size=(64, 48))
    plotter.set_background("white")
    plotter.add_mesh(
        pyvista.Plane(center=(0, y, 0), direction=(0, -1, 0), i_size=8, j_size=8), color="blue", lighting=False
    )
    isospline.add_to_plotter(plotter, isospline.Isosurface(isospline.volumes.sphere(0.4).volume(24), 0.0, color="red"))
    plotter.camera_position = [(0, -5, 0), (0, 0, 0), (0, 0, 1)]
    if parallel:
        plotter.enable_parallel_projection()
    np.testing.assert_array_equal(plotter.screenshot(return_img=True)[2, 2], (0, 0, 255))
    plotter.close()
