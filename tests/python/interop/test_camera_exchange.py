"""Cameras from and to other libraries: VTK's own matrices, and K [R | t] in NumPy."""

import pickle

import numpy as np
import pytest
from projections import project
from scipy.spatial.transform import Rotation

import isospline

cv2 = pytest.importorskip("cv2")

SIZE = (320, 200)
POSITION = [(3, -5, 2), (0.5, 0.2, 0.1), (0.1, 0.2, 1)]


def vtk_pixels(camera, points):
    """Pixel coordinates, y down, of points by the matrix of a vtkCamera."""
    matrix = camera.GetCompositeProjectionTransformMatrix(SIZE[0] / SIZE[1], -1, 1)
    matrix = np.array([[matrix.GetElement(row, column) for column in range(4)] for row in range(4)])
    clip = np.c_[points, np.ones(len(points))] @ matrix.T
    x, y = clip[:, :2].T / clip[:, 3]
    return np.stack([(1 + x) / 2, (1 - y) / 2], axis=-1) * SIZE


@pytest.fixture
def vtk_camera():
    vtk = pytest.importorskip("vtk")
    camera = vtk.vtkCamera()
    camera.SetPosition(POSITION[0])
    camera.SetFocalPoint(POSITION[1])
    camera.SetViewUp(POSITION[2])
    camera.SetClippingRange(0.1, 100)
    return camera


@pytest.mark.slow
def test_perspective_projects_as_vtk_does(vtk_camera, rng):
    vtk_camera.SetViewAngle(37)
    points = rng.uniform(-1, 1, (50, 3))
    camera = isospline.PerspectiveCamera.from_pyvista(POSITION, 37)
    np.testing.assert_allclose(project(camera.world_to_ndc(SIZE), points, SIZE), vtk_pixels(vtk_camera, points))
    assert camera.to_pyvista() == (tuple(tuple(map(float, point)) for point in POSITION), 37)


def test_orthographic_projects_as_vtk_does(vtk_camera, rng):
    vtk_camera.ParallelProjectionOn()
    vtk_camera.SetParallelScale(1.75)
    points = rng.uniform(-1, 1, (50, 3))
    camera = isospline.OrthographicCamera.from_pyvista(POSITION, 1.75)
    np.testing.assert_allclose(project(camera.world_to_ndc(SIZE), points, SIZE), vtk_pixels(vtk_camera, points))
    assert camera.height == 3.5
    assert camera.to_pyvista() == (tuple(tuple(map(float, point)) for point in POSITION), 1.75)


@pytest.mark.parametrize("axis", ["horizontal", "diagonal"])
def test_other_fields_of_view_become_vertical(axis, rng):
    camera = isospline.PerspectiveCamera(*POSITION, 50, field_of_view_axis=axis)
    position, view_angle = camera.to_pyvista(SIZE)
    again = isospline.PerspectiveCamera.from_pyvista(position, view_angle)
    np.testing.assert_allclose(again.rays(SIZE), camera.rays(SIZE))
    with pytest.raises(ValueError, match="size: expected"):
        camera.to_pyvista()


def test_from_pyvista_accepts_sequences_of_three():
    class Position:  # as pyvista.CameraPosition
        def __getitem__(self, index):
            return POSITION[index]

    assert repr(isospline.PerspectiveCamera.from_pyvista(Position())) == repr(isospline.PerspectiveCamera(*POSITION))
    for wrong, error in (("iso", ValueError), (POSITION[:2], ValueError), ([1, 2, 3], ValueError), (7, TypeError)):
        with pytest.raises(error, match="camera_position: expected"):
            isospline.PerspectiveCamera.from_pyvista(wrong)
    with pytest.raises(ValueError, match="field_of_view: expected"):
        isospline.PerspectiveCamera.from_pyvista(POSITION, 190)


def test_errors_of_parallel_projection_name_its_scale():
    place = ((0, -9, 3), (0, 0, 0), (0, 0, 1))
    for scale in (0, -1, np.inf, np.nan):
        with pytest.raises(ValueError, match="parallel_scale: expected a finite number above 0"):
            isospline.OrthographicCamera.from_pyvista(place, scale)


INTRINSICS = np.array([(410, 3.5, 150.25), (0, 395, 110.75), (0, 0, 1)])
ROTATION = Rotation.from_rotvec([0.4, -1.1, 2.0])
TRANSLATION = np.array([0.3, -0.2, 7.5])


def opencv_pixels(points, intrinsics=INTRINSICS, rotation=ROTATION.as_matrix(), translation=TRANSLATION):
    """cv2.projectPoints without distortion."""
    image = (points @ rotation.T + translation) @ intrinsics.T
    return image[:, :2] / image[:, 2:]


@pytest.mark.parametrize("rotation", [ROTATION.as_matrix(), ROTATION.as_rotvec(), ROTATION.as_rotvec()[:, None]])
def test_from_opencv_projects_as_opencv_does(rotation, rng):
    points = rng.uniform(-1, 1, (50, 3))
    for translation in (TRANSLATION, TRANSLATION[:, None]):
        camera = isospline.ProjectionPlaneCamera.from_opencv(INTRINSICS, rotation, translation, SIZE)
        # OpenCV has whole numbers at the centres of pixels, isospline at their edges.
        pixels = project(camera.world_to_ndc(SIZE), points, SIZE) - 0.5
        np.testing.assert_allclose(pixels, opencv_pixels(points), atol=1e-9)
        in_camera = points @ camera.world_to_camera[:3, :3].T + camera.world_to_camera[:3, 3]
        expected = (points @ ROTATION.as_matrix().T + TRANSLATION)[:, 2]
        np.testing.assert_allclose(in_camera[:, 2], expected, atol=1e-9)


@pytest.mark.parametrize("pixel_center", [0, 0.5])
def test_to_opencv_projects_as_the_camera_does(pixel_center, rng):
    cameras = [
        isospline.PerspectiveCamera(*POSITION, 40),
        isospline.PerspectiveCamera(*POSITION, 70, field_of_view_axis="diagonal"),
        isospline.ProjectionPlaneCamera((0.3, -4, 0.2), corner=(-1, -2, 1), right=(2.5, 0.1, 0), down=(0.1, 0.3, -1.5)),
        isospline.ProjectionPlaneCamera.from_opencv(INTRINSICS, ROTATION.as_matrix(), TRANSLATION, SIZE),
    ]
    points = rng.uniform(-1, 1, (50, 3))
    for camera in cameras:
        intrinsics, rotation, translation = camera.to_opencv(SIZE, pixel_center=pixel_center)
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(rotation) == pytest.approx(1)
        assert (np.tril(intrinsics, -1) == 0).all() and intrinsics[2, 2] == 1 and (np.diag(intrinsics) > 0).all()
        expected = project(camera.world_to_ndc(SIZE), points, SIZE) - 0.5 + pixel_center
        np.testing.assert_allclose(opencv_pixels(points, intrinsics, rotation, translation), expected, atol=1e-9)
    principal_point = np.array([(0, 0, 1), (0, 0, 1), (0, 0, 0)])
    np.testing.assert_allclose(intrinsics, INTRINSICS + pixel_center * principal_point, atol=1e-9)


@pytest.mark.parametrize(
    "arguments, parameter",
    [
        (dict(intrinsics=np.eye(4)), "intrinsics"),
        (dict(intrinsics=INTRINSICS.T), "intrinsics"),
        (dict(intrinsics=np.diag([400, 400, 2])), "intrinsics"),
        (dict(intrinsics=np.diag([400, np.nan, 1])), "intrinsics"),
        (dict(rotation=2 * np.eye(3)), "rotation"),
        (dict(rotation=np.diag([1, 1, -1])), "rotation"),
        (dict(rotation=(1, 2, 3, 4)), "rotation"),
        (dict(translation=(1, 2)), "translation"),
        (dict(translation=(1, 2, np.inf)), "translation"),
        (dict(size=(0, 200)), "size"),
        (dict(pixel_center=np.nan), "pixel_center"),
    ],
)
def test_bad_calibrations(arguments, parameter):
    good = {"intrinsics": INTRINSICS, "rotation": np.eye(3), "translation": TRANSLATION, "size": SIZE}
    with pytest.raises(ValueError, match=f"^{parameter}: expected .* got "):
        isospline.ProjectionPlaneCamera.from_opencv(**{**good, **arguments})


# cv2.projectPoints ignores skew.
LENS_INTRINSICS = np.array([(410, 0, 150.25), (0, 395, 110.75), (0, 0, 1)])
# Coefficients of a wide lens in OpenCV's order, by their number; 8: a rational model, 12: with a thin prism.
DISTORTIONS = {
    4: (-0.21, 0.05, 0.003, -0.002),
    5: (0.18, -0.07, -0.004, 0.001, 0.02),
    8: (0.3, 0.1, 0.002, -0.003, 0.01, 0.55, 0.15, 0.02),
    12: (-0.15, 0.02, 0.001, 0.002, 0.003, 0.05, -0.01, 0.002, 0.004, -0.001, -0.003, 0.002),
    14: (-0.2, 0.04, 0.001, 0.002, 0.003, 0, 0, 0, 0, 0, 0, 0, 0, 0),
}


def distorting_camera(distortion, size=SIZE, **options):
    return isospline.ProjectionPlaneCamera.from_opencv(
        LENS_INTRINSICS, ROTATION.as_matrix(), TRANSLATION, size, distortion=distortion, **options
    )


def distorted_pixels(points, distortion):
    rotation = cv2.Rodrigues(ROTATION.as_matrix())[0]
    return cv2.projectPoints(points, rotation, TRANSLATION, LENS_INTRINSICS, np.array(distortion))[0][:, 0]


@pytest.mark.sweep(2)
@pytest.mark.slow
@pytest.mark.parametrize("count", DISTORTIONS)
def test_points_on_rays_are_where_opencv_distorts_them_to(count, rng):
    distortion = DISTORTIONS[count]
    camera = distorting_camera(distortion)
    rays = camera.rays(SIZE).reshape(-1, 6)
    points = rays[:, :3] + rng.uniform(2, 20, (len(rays), 1)) * rays[:, 3:]
    v, u = np.mgrid[: SIZE[1], : SIZE[0]]
    pixels = distorted_pixels(points, distortion)
    np.testing.assert_allclose(pixels, np.stack([u, v], axis=-1).reshape(-1, 2), atol=1e-9)
    # t is the depth, as without distortion
    depths = (points @ ROTATION.as_matrix().T + TRANSLATION)[:, 2]
    np.testing.assert_allclose(depths, ((points - rays[:, :3]) / rays[:, 3:])[:, 0], rtol=1e-9)
    assert abs(distorting_camera(None).rays(SIZE).reshape(-1, 6) - rays).max() > 0.005
    # The other way, by OpenCV's own iteration.
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 500, 1e-15)
    whole = np.stack([u, v], axis=-1).reshape(-1, 1, 2).astype(float)
    lens = LENS_INTRINSICS, np.array(distortion)
    if hasattr(cv2, "undistortPointsIter"):  # OpenCV 4: undistortPoints takes no criteria there
        undistorted = cv2.undistortPointsIter(whole, *lens, None, None, criteria)[:, 0]
    else:
        undistorted = cv2.undistortPoints(whole, *lens, criteria=criteria)[:, 0]
    in_camera = rays[:, 3:] @ ROTATION.as_matrix().T
    np.testing.assert_allclose(in_camera[:, :2] / in_camera[:, 2:], undistorted, atol=1e-7)


@pytest.mark.parametrize(
    "focal_length, distortion",
    [
        (51.2, (-0.47, 0.1, 0, 0)),  # Newton's method from the distorted point fails at (4, 6)
        (20.0, (0.72, -0.13, -0.01, 0)),  # and here it finds points behind a fold that is beyond the image
        (21.0, (0.53, -0.15, 0.01, -0.01)),
    ],
)
def test_all_pixels_of_strong_lenses_are_undistorted(focal_length, distortion):
    intrinsics = np.array([[focal_length, 0, 31.5], [0, focal_length, 23.5], [0, 0, 1]])
    size = 64, 48
    camera = isospline.ProjectionPlaneCamera.from_opencv(intrinsics, np.eye(3), (0, 0, 0), size, distortion=distortion)
    directions = camera.rays(size)[..., 3:]
    lens = np.zeros(3), np.zeros(3), intrinsics, np.array(distortion)
    pixels = cv2.projectPoints(directions.reshape(-1, 1, 3), *lens)[0].reshape(48, 64, 2)
    v, u = np.mgrid[:48, :64]
    np.testing.assert_allclose(pixels, np.stack([u, v], axis=-1), atol=1e-6)
    # Neighbours are neighbours.
    on_plane = directions[..., :2] / directions[..., 2:]
    steps = np.linalg.norm(np.diff(on_plane, axis=1), axis=2)
    assert steps.max() < 20 * np.median(steps)


def test_pictures_of_other_sizes_show_the_same_of_a_distorted_view():
    camera = distorting_camera(DISTORTIONS[5])
    larger = camera.rays((3 * SIZE[0], 3 * SIZE[1]))
    np.testing.assert_allclose(larger[1::3, 1::3], camera.rays(SIZE), atol=1e-12)


def test_distorted_pictures_agree_with_opencv_projection():
    field = isospline.volumes.torus(0.6, 0.25)
    volume = field.volume(32)
    scene = isospline.Scene(isospline.Isosurface(volume, field.level))
    eye = np.array([0.4, -2.2, 1.1])
    forward = -eye / np.linalg.norm(eye)
    right = np.cross(forward, (0, 0, 1)) / np.linalg.norm(np.cross(forward, (0, 0, 1)))
    rotation = np.array([right, np.cross(forward, right), forward])
    distortion = np.array(DISTORTIONS[8])
    camera = isospline.ProjectionPlaneCamera.from_opencv(
        LENS_INTRINSICS, rotation, -rotation @ eye, SIZE, distortion=distortion
    )
    image = isospline.render(scene, camera, size=SIZE, layers=("position", "depth"), light="phong")
    seen = np.isfinite(image.depth)
    assert 1000 < seen.sum() < seen.size
    pixels = cv2.projectPoints(
        image.position[seen].astype(float), cv2.Rodrigues(rotation)[0], -rotation @ eye, LENS_INTRINSICS, distortion
    )[0][:, 0]
    v, u = np.nonzero(seen)
    np.testing.assert_allclose(pixels, np.stack([u, v], axis=-1), atol=1e-3)  # positions are float32
    assert image.world_to_ndc is None


def test_a_distorting_camera_is_a_value(tmp_path):
    camera = distorting_camera(DISTORTIONS[5])
    assert camera.distortion.tolist() == [*DISTORTIONS[5], *(0,) * 7]
    assert distorting_camera(np.zeros(5)).distortion is None and distorting_camera(None).distortion is None
    assert camera == distorting_camera([DISTORTIONS[5]]) and camera != distorting_camera(None)
    assert pickle.loads(pickle.dumps(camera)) == camera
    assert camera.replace(distortion=None) == distorting_camera(None)
    for mine, theirs in zip(camera.to_opencv(SIZE), (LENS_INTRINSICS, ROTATION.as_matrix(), TRANSLATION)):
        np.testing.assert_allclose(mine, theirs, atol=1e-9)


@pytest.mark.parametrize(
    "distortion, message",
    [
        ((0.1, 0.2, 0.3), "expected 4, 5, 8 or 12 coefficients, got 3"),
        ((0.1, 0, 0, np.nan), "expected finite numbers, got nan"),
        ((*(0.1,) * 4, *(0,) * 8, 0.02, 0), "expected a sensor that is not tilted"),
        ((-2.5, 0, 0, 0), r"expected coefficients that do not fold the image of this size, got a fold"),
        ("wide", "expected 4, 5, 8 or 12 coefficients, got"),
    ],
)
def test_bad_distortions(distortion, message):
    with pytest.raises((ValueError, TypeError), match=f"^distortion: {message}"):
        distorting_camera(distortion)
    with pytest.raises(ValueError, match="camera: expected one whose lens has no distortion"):
        distorting_camera(DISTORTIONS[4]).world_to_ndc(SIZE)
