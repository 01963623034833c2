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


def seen_by(add, change):
    """The pixels of what `add` adds to a Plotter, in front of a green plane, after a change of the Plotter."""
    plotter = pyvista.Plotter(off_screen=True, window_size=SIZE)
    plotter.background_color = "black"
    plotter.disable_anti_aliasing()
    plane = pyvista.Plane(center=(0, 0.1, 0), direction=(0, -1, 0), i_size=0.5, j_size=3)
    plotter.add_mesh(plane, color="green", lighting=False)
    add(plotter)
    plotter.camera_position = [(2, -3, 2), (0, 0, 0), (0, 0, 1)]
    change(plotter, plotter.camera)
    plotter.renderer.ResetCameraClippingRange()
    shot = plotter.screenshot(return_img=True)
    plotter.close()
    return shot[..., 2] > 128


def move(_, camera):
    camera.SetModelTransformMatrix(
        pyvista.vtkmatrix_from_array([(1, 0, 0, 0.3), (0, 1, 0, 0), (0, 0, 2, 0), (0, 0, 0, 1)])
    )


CHANGES = {
    "nothing": lambda plotter, camera: None,
    "stretched": lambda plotter, camera: plotter.set_scale(zscale=2, reset_camera=False),
    "mirrored": lambda plotter, camera: plotter.set_scale(xscale=-1, reset_camera=False),
    "horizontal angle": lambda plotter, camera: camera.SetUseHorizontalViewAngle(True),
    "shifted": lambda plotter, camera: camera.SetWindowCenter(0.3, 0.2),
    "moved": move,
    "sheared": lambda plotter, camera: camera.SetViewShear(0.2, 0.1, 1),
    "half of the window": lambda plotter, camera: plotter.renderer.SetViewport(0.5, 0, 1, 1),
}


@pytest.mark.sweep(6)
@pytest.mark.parametrize("parallel", [False, True])
@pytest.mark.parametrize("name", CHANGES)
def test_surfaces_are_where_actors_would_be(name, parallel, capsys):
    field = isospline.volumes.torus()
    surface = isospline.Isosurface(field.volume(32), field.level, color="white")
    mesh = surface.to_pyvista()

    def change(plotter, camera):
        camera.SetParallelProjection(parallel)
        camera.SetParallelScale(1.2)
        CHANGES[name](plotter, camera)

    expected = seen_by(lambda plotter: plotter.add_mesh(mesh, color="white", lighting=False), change)
    found = seen_by(lambda plotter: add_to_plotter(plotter, surface, light="unlit"), change)
    assert expected.sum() > 500
    if parallel and name in ("stretched", "mirrored", "moved", "sheared"):
        assert "ValueError: plotter: expected a parallel projection without shear" in capsys.readouterr().err
    else:
        assert (found != expected).mean() < 0.005


def test_scenes_without_surfaces_leave_actors_alone():
    plotter, scene = pyvista.Plotter(off_screen=True, window_size=SIZE), isospline.Scene()
    plotter.add_mesh(pyvista.Sphere(), color="red", lighting=False)
    bounds = plotter.bounds
    picture = add_to_plotter(plotter, scene)
    shot = plotter.screenshot(return_img=True)
    assert plotter.bounds == bounds
    assert (shot == (255, 0, 0)).all(axis=-1).mean() > 0.1
    scene.add(isospline.Isosurface(isospline.volumes.sphere(0.7).volume(32), 0.0))
    plotter.render()
    assert (plotter.screenshot(return_img=True) == (255, 0, 0)).all(axis=-1).sum() == 0
    np.testing.assert_allclose(plotter.bounds, scene.bounds.T.ravel(), rtol=1e-6)
    picture.remove()
    plotter.render()
    assert plotter.bounds == bounds
    np.testing.assert_array_equal(plotter.screenshot(return_img=True), shot)
    plotter.close()
