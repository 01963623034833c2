"""What rays find and pictures show as functions of tensors, with gradients: PyTorch on top of `isospline.derivatives`.

Each function takes a scene, and tensors in place of some of its parts: levels, samples, transforms. Arrays go in and
arrays come out, so that any loop of optimization can call it. Numbers, lists and arrays of NumPy in place of tensors
keep NumPy's type: numbers of Python are float64.
"""

from __future__ import annotations

import functools
from math import inf
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from .derivatives.gradients import check_scene
from .derivatives.hits import cast_vjp
from .derivatives.pictures import moved_picture_vjp
from .looks import Phong
from .scene import Isosurface, Scene, Volume
from .scene.public import from_state

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import torch

    Tensors = Mapping[int, torch.Tensor]

__all__ = ["cast", "depth", "mask", "normals", "picture"]


def cast(
    scene: Scene,
    rays: torch.Tensor,
    *,
    levels: Tensors | None = None,
    samples: Tensors | None = None,
    transforms: Tensors | None = None,
    t_near: float = 0.0,
    t_far: float = inf,
    coherent: bool | None = None,
) -> tuple[torch.Tensor, torch.Tensor]:
    """First crossings of rays, as `Scene.cast_rays` finds them, with gradients.

    Parameters
    ----------
    scene : Scene
    rays : (..., 6) tensor, float32 or float64
        Origins and directions.
    levels : mapping of geometry ids to tensors, optional
        Levels, one number each, in place of those of the isosurfaces.
    samples : mapping of geometry ids to tensors, optional
        Samples in place of those of the volumes, in their shapes.
    transforms : mapping of geometry ids to (4, 4) tensors, optional
        Placements in place of those of the objects.
    t_near, t_far : float
        Only crossings with t in [t_near, t_far] count.
    coherent : bool, optional
        As in `Scene.cast_rays`.

    Returns
    -------
    t_hit : (...) tensor
        Of the type and on the device of the rays; inf for rays that miss.
    normals : (..., 3) tensor
        Unit outward normals in the world; zero for rays that miss.

    Raises
    ------
    ModuleNotFoundError
        Without PyTorch: ``pip install isospline[torch]``.
    ValueError
        For a geometry id that is not in the scene or not that of an isosurface, and tensors of another shape.

    Notes
    -----
    Gradients are exact where the first crossing moves smoothly, see `isospline.derivatives.cast_vjp`; they are zero for
    rays that miss or graze. All is computed in double precision on the CPU. Second derivatives are not there.

    Examples
    --------
    The level at which a ray hits at t = 2.4::

        level = torch.tensor(0.0, dtype=torch.float64, requires_grad=True)
        t_hit, normals = isospline.torch.cast(scene, rays, levels={0: level})
        ((t_hit - 2.4) ** 2).sum().backward()
        level.grad
    """
    parameters = _Parameters(scene, levels, samples, transforms)
    given = _tensor(rays)
    if not given.dtype.is_floating_point:
        raise TypeError(f"rays: expected a tensor of real numbers, got {given.dtype}")

    def run(rays, *arrays):
        built = parameters.scene(arrays)
        hits, vjp = cast_vjp(built, rays, t_near=t_near, t_far=t_far, coherent=coherent, normals=True)

        def back(by_t, by_normals):
            gradients = vjp(t_hit=by_t, primitive_normals=by_normals, samples=parameters.has_samples)
            return gradients["rays"], *parameters.of(gradients)

        return (hits.t_hit, hits.primitive_normals), back

    return _apply(run, given, *parameters.tensors)


def picture(
    scene: Scene,
    camera: Any,
    size: tuple[int, int],
    channel: Literal["mask", "depth", "normals"] | Phong = "mask",
    *,
    levels: Tensors | None = None,
    samples: Tensors | None = None,
    transforms: Tensors | None = None,
    camera_motion: torch.Tensor | None = None,
    samples_per_pixel: int = 4,
    tube: float = 1.0,
    background: float = 0.0,
    seed: int = 0,
) -> torch.Tensor:
    """A picture with gradients, those of its outlines included.

    Parameters
    ----------
    scene : Scene
    camera : PerspectiveCamera, OrthographicCamera or ProjectionPlaneCamera
    size : (int, int)
        Width and height, in pixels.
    channel
        As in `isospline.derivatives.picture_vjp`.
    levels, samples, transforms
        As in `cast`.
    camera_motion : (4, 4) tensor, optional
        A matrix that moves the camera in the world, after its own placement; the identity by default.
    samples_per_pixel, tube, background, seed
        As in `isospline.derivatives.picture_vjp`.

    Returns
    -------
    (height, width) or (height, width, 3) tensor
        Of the type and on the device of the first tensor given; float64 on the CPU without one.

    Raises
    ------
    ModuleNotFoundError, ValueError
        As in `cast`.

    See Also
    --------
    isospline.derivatives.picture_vjp : the same without PyTorch, and what is differentiated.
    """
    motion = _torch().eye(4, dtype=_torch().float64) if camera_motion is None else _tensor(camera_motion)
    if not motion.dtype.is_floating_point:  # the picture would have this type
        raise TypeError(f"camera_motion: expected a tensor of real numbers, got {motion.dtype}")
    if not _is_motion(_array(motion)):
        expected = "a finite (4, 4) matrix with an inverse, and with 0, 0, 0, 1 in its last row"
        raise ValueError(f"camera_motion: expected {expected}, got another one")
    parameters = _Parameters(scene, levels, samples, transforms)

    def run(motion, *arrays):
        options = {"samples_per_pixel": samples_per_pixel, "tube": tube, "background": background, "seed": seed}
        found, vjp = moved_picture_vjp(parameters.scene(arrays), camera, size, channel, motion, **options)

        def back(by_picture):
            gradients = vjp(by_picture, samples=parameters.has_samples)
            return gradients["camera"], *parameters.of(gradients)

        return (found,), back

    given = [motion] if camera_motion is not None else parameters.tensors
    return _apply(run, motion, *parameters.tensors, like=given[0] if given else motion)[0]


def depth(scene: Scene, camera: Any, size: tuple[int, int], **options: Any) -> torch.Tensor:
    """Distances along the camera's viewing direction, (height, width), as `picture` with its ``channel="depth"``."""
    return picture(scene, camera, size, "depth", **options)


def normals(scene: Scene, camera: Any, size: tuple[int, int], **options: Any) -> torch.Tensor:
    """Unit outward normals in the world, (height, width, 3), as `picture` with its ``channel="normals"``."""
    return picture(scene, camera, size, "normals", **options)


def mask(scene: Scene, camera: Any, size: tuple[int, int], **options: Any) -> torch.Tensor:
    """The part of each pixel that objects cover, (height, width), as `picture` with its ``channel="mask"``."""
    return picture(scene, camera, size, "mask", **options)


def _is_motion(matrix):
    return (
        matrix.shape == (4, 4)
        and np.isfinite(matrix).all()
        and np.array_equal(matrix[3], (0.0, 0.0, 0.0, 1.0))
        and np.linalg.det(matrix) != 0.0
    )


@functools.cache
def _torch():
    try:
        import torch
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError("isospline.torch needs PyTorch: pip install isospline[torch]") from error
    return torch


def _tensor(given):
    """A tensor as it is, and anything else as NumPy reads it: PyTorch would round Python's numbers to float32."""
    torch = _torch()
    if isinstance(given, torch.Tensor):
        return given
    array = np.array(given, order="C")  # PyTorch takes neither other byte orders nor negative strides
    return torch.as_tensor(array.astype(array.dtype.newbyteorder("="), copy=False))


class _Parameters:
    """The parts of a scene that tensors take the place of."""

    def __init__(self, scene, levels, samples, transforms):
        check_scene(scene)
        self.placed = scene._placed_objects()
        ids = {id for id, *_ in self.placed}
        surfaces = {id: item for id, item, *_ in self.placed if isinstance(item, Isosurface)}
        self.places: list[tuple[str, int]] = []
        self.tensors: list[Any] = []
        for name, given, allowed in (
            ("levels", levels, surfaces),
            ("samples", samples, surfaces),
            ("transforms", transforms, ids),
        ):
            for id, tensor in (given or {}).items():
                if id not in allowed:
                    what = "objects" if name == "transforms" else "isosurfaces"
                    raise ValueError(f"{name}: expected geometry ids of {what}, {sorted(allowed)}, got {id!r}")
                shape = {
                    "levels": (),
                    "samples": surfaces[id].volume.shape if id in surfaces else (),
                    "transforms": (4, 4),
                }
                tensor = _tensor(tensor)
                if tuple(tensor.shape) != shape[name]:
                    raise ValueError(f"{name}: expected shape {shape[name]} for {id}, got {tuple(tensor.shape)}")
                if not tensor.dtype.is_floating_point:
                    raise TypeError(f"{name}: expected a tensor of real numbers for {id}, got {tensor.dtype}")
                self.places.append((name, id))
                self.tensors.append(tensor)
        self.has_samples = bool(samples)

    def scene(self, arrays):
        """The scene with arrays in place of the tensors."""
        given = dict(zip(self.places, arrays))
        built = Scene()
        self.ids = {}
        for id, item, transform, visibility in self.placed:
            level, samples = given.get(("levels", id)), given.get(("samples", id))
            if samples is not None:
                item = _with_samples(item, samples)
            if level is not None:
                item = item.with_level(float(level))
            self.ids[id] = built.add(item)
            built.set_transform(self.ids[id], given.get(("transforms", id), transform))
            built.set_visibility(self.ids[id], visible=visibility.visible, casts_shadow=visibility.casts_shadow)
        return built

    def of(self, gradients):
        return [gradients[name][self.ids[id]] for name, id in self.places]


def _with_samples(surface, samples):
    """The surface of another volume with the same grid and model."""
    volume = surface.volume
    model = ("degree", "boundary", "filter", "smoothing", "axes", "spacing", "origin", "direction", "unit")
    state = surface.__getstate__()
    state["volume"] = Volume(samples, **{name: getattr(volume, name) for name in model})
    return from_state(Isosurface, state)


def _apply(run: Callable[..., Any], *tensors, like=None):
    """`run` of arrays as a function of tensors; it returns arrays and the function that takes gradients back."""
    like = tensors[0] if like is None else like
    return _function().apply(run, like.dtype, like.device, *tensors)


@functools.cache
def _function():
    torch: Any = _torch()

    class Function(torch.autograd.Function):  # type: ignore[misc]
        @staticmethod
        def forward(ctx, run, dtype, device, *tensors):
            found, ctx.back = run(*(_array(tensor) for tensor in tensors))
            ctx.kinds = [(tensor.dtype, tensor.device) for tensor in tensors]
            return tuple(torch.tensor(np.ascontiguousarray(each), dtype=dtype, device=device) for each in found)

        @staticmethod
        @torch.autograd.function.once_differentiable
        def backward(ctx, *by_found):
            found = ctx.back(*(_array(each) for each in by_found))
            made = [
                torch.tensor(np.ascontiguousarray(each), dtype=dtype, device=device)
                for each, (dtype, device) in zip(found, ctx.kinds)
            ]
            return None, None, None, *made

    return Function


def _array(tensor):
    return tensor.detach().cpu().double().numpy()
