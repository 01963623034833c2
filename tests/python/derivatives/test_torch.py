"""The functions of isospline.torch. Most of them need PyTorch, which `make test-torch` installs."""

import sys

import numpy as np
import pytest

import isospline
import isospline.torch
from isospline import volumes

FIELD = volumes.torus(0.6, 0.25)
SIZE = (24, 20)
CAMERA = isospline.PerspectiveCamera((4, 1.13, 1.5), (0, 0, 0), field_of_view=36)


@pytest.fixture
def torch():
    return pytest.importorskip("torch", exc_type=ImportError)


def scene():
    return isospline.Scene(isospline.Isosurface(FIELD.volume(24, degree=3), FIELD.level))


def rays(torch, **options):
    rng = np.random.default_rng(0)
    origins = np.array([3, 0.3, 0.1]) + 0.1 * rng.normal(size=(5, 3))
    return torch.tensor(np.hstack([origins, -origins + 0.6 * np.array([0, 1, 0])]), **options)


def test_the_error_without_torch_names_the_extra(monkeypatch):
    isospline.torch._torch.cache_clear()
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(ModuleNotFoundError, match=r"isospline.torch needs PyTorch: pip install isospline\[torch\]"):
        isospline.torch.mask(scene(), CAMERA, SIZE)
    isospline.torch._torch.cache_clear()


def test_gradients_of_hits_pass_gradcheck(torch):
    at_home = scene()
    samples = torch.tensor(FIELD.values((24, 24, 24)), dtype=torch.float64)
    level = torch.tensor(0.01, dtype=torch.float64, requires_grad=True)
    upper = torch.eye(4, dtype=torch.float64)[:3].clone().requires_grad_()
    shift = torch.tensor(0.0, dtype=torch.float64, requires_grad=True)

    def hits(rays, level, upper, shift):
        transform = torch.cat([upper, torch.eye(4, dtype=torch.float64)[3:]])
        options = {"levels": {0: level}, "samples": {0: samples + shift}, "transforms": {0: transform}}
        return isospline.torch.cast(at_home, rays, **options)

    given = (rays(torch, requires_grad=True), level, upper, shift)
    # Samples are stored as float32: steps are larger than their rounding.
    assert torch.autograd.gradcheck(hits, given, eps=1e-4, atol=1e-3, rtol=1e-3)


def test_pictures_have_the_gradients_of_the_function_without_torch(torch):
    level = torch.tensor(FIELD.level, dtype=torch.float64, requires_grad=True)
    transform = torch.eye(4, dtype=torch.float64, requires_grad=True)
    motion = torch.eye(4, dtype=torch.float64, requires_grad=True)
    options = {"levels": {0: level}, "transforms": {0: transform}, "camera_motion": motion}
    for name in ("mask", "depth", "normals"):
        for tensor in (level, transform, motion):
            tensor.grad = None
        found = getattr(isospline.torch, name)(scene(), CAMERA, SIZE, **options)
        found.sum().backward()
        picture, vjp = isospline.derivatives.picture_vjp(scene(), CAMERA, SIZE, name)
        expected = vjp(np.ones_like(picture), samples=False)
        assert np.array_equal(found.detach(), picture)
        assert float(level.grad) == expected["levels"][0]
        assert np.allclose(transform.grad, expected["transforms"][0])
        assert np.allclose(motion.grad, expected["camera"])


def test_a_moved_camera_sees_what_a_scene_moved_back_shows(torch):
    motion = torch.eye(4, dtype=torch.float64)
    motion[0, 3], motion[2, 3] = 0.1, -0.2
    back = torch.linalg.inv(motion)
    moved = isospline.torch.depth(scene(), CAMERA, SIZE, camera_motion=motion)
    assert torch.allclose(moved, isospline.torch.depth(scene(), CAMERA, SIZE, transforms={0: back}))


def test_single_precision_stays_so(torch):
    single = rays(torch, dtype=torch.float32, requires_grad=True)
    t_hit, normals = isospline.torch.cast(scene(), single)
    assert t_hit.dtype == normals.dtype == torch.float32
    (t_hit[t_hit.isfinite()].sum() + normals.sum()).backward()
    assert single.grad.dtype == torch.float32 and single.grad.abs().sum() > 0
    samples = torch.tensor(FIELD.values((24, 24, 24)), dtype=torch.float32, requires_grad=True)
    picture = isospline.torch.mask(scene(), CAMERA, SIZE, samples={0: samples})
    picture.sum().backward()
    assert picture.dtype == samples.grad.dtype == torch.float32 and samples.grad.shape == (24, 24, 24)


def test_numbers_in_place_of_tensors_are_not_rounded(torch):
    level = torch.tensor(0.03, dtype=torch.float64)
    t_hit, _ = isospline.torch.cast(scene(), rays(torch, dtype=torch.float64), levels={0: level})
    of_numbers, _ = isospline.torch.cast(scene(), rays(torch).tolist(), levels={0: 0.03})
    assert of_numbers.dtype == torch.float64 and torch.equal(of_numbers, t_hit)
    odd = rays(torch).numpy()[::-1].astype(">f8")
    odd.flags.writeable = False
    assert torch.equal(isospline.torch.cast(scene(), odd, levels={0: 0.03})[0], t_hit.flip(0))
    motion = np.eye(4)
    motion[0, 3] = 0.1
    moved = isospline.torch.depth(scene(), CAMERA, SIZE, levels={0: 0.03}, camera_motion=motion)
    options = {"levels": {0: level}, "camera_motion": torch.tensor(motion)}
    assert moved.dtype == torch.float64 and torch.equal(moved, isospline.torch.depth(scene(), CAMERA, SIZE, **options))


def test_rays_that_miss_have_no_gradient(torch):
    away = torch.tensor([[3.0, 0, 0, 1, 0, 0]], dtype=torch.float64, requires_grad=True)
    t_hit, normals = isospline.torch.cast(scene(), away)
    assert t_hit.isinf().all() and not normals.any()
    ((t_hit - 2.4) ** 2 + normals.sum()).sum().backward()  # whose gradient by t_hit is inf
    assert not away.grad.any()


def test_wrong_arguments_get_one_sentence(torch):
    level = torch.tensor(0.0)
    with pytest.raises(TypeError, match="scene: expected a Scene, got int"):
        isospline.torch.cast(3, rays(torch))
    with pytest.raises(ValueError, match=r"levels: expected geometry ids of isosurfaces, \[0\], got 4"):
        isospline.torch.mask(scene(), CAMERA, SIZE, levels={4: level})
    with pytest.raises(ValueError, match=r"transforms: expected shape \(4, 4\) for 0, got \(3, 3\)"):
        isospline.torch.mask(scene(), CAMERA, SIZE, transforms={0: torch.eye(3)})
    projective = torch.eye(4)
    projective[3, 0] = 0.5
    for motion in (projective, torch.eye(4) * torch.nan, torch.zeros(4, 4), torch.eye(3)):
        with pytest.raises(ValueError, match=r"camera_motion: expected a finite \(4, 4\) matrix with an inverse"):
            isospline.torch.mask(scene(), CAMERA, SIZE, camera_motion=motion)
    with pytest.raises(TypeError, match="camera_motion: expected a tensor of real numbers, got torch.int64"):
        isospline.torch.mask(scene(), CAMERA, SIZE, camera_motion=torch.eye(4, dtype=torch.int64))
