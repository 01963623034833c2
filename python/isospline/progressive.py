"""Path traced pictures that become better and better."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, Literal

from . import _core
from .cameras import camera_for
from .image import Image
from .parameters import check_count, check_type
from .signatures import explained, explained_methods

if TYPE_CHECKING:
    from ._core import _Background, _Camera, _Layer, _Progress


@explained_methods
class ProgressiveRenderer:
    """A path traced picture in the making, for viewers.

    After any number of steps the image is the mean of that many samples a pixel: bit for bit what `render` makes of as
    many, for any number of threads. Any thread may call; calls wait for each other.

    Parameters
    ----------
    scene : Scene
        After a change of it, or of one of its objects, call `reset`.
    camera : PerspectiveCamera, ProjectionPlaneCamera, OrthographicCamera or PanoramicCamera, optional
        Where from; by default as of `render`.
    size : (int, int)
        Width and height of the image in pixels.
    integrator : PathTracer, optional
        Materials and lights; by default ``PathTracer()``.
    background, layers, ambient_occlusion_samples, encoding
        As for `render`.

    Examples
    --------
    >>> import isospline
    >>> field = isospline.volumes.torus()
    >>> volume = isospline.Volume(field.samples(32), **field.grid(32))
    >>> scene = isospline.Scene([isospline.Isosurface(volume, field.level)])
    >>> renderer = isospline.ProgressiveRenderer(scene, isospline.camera_for(scene), size=(32, 24))
    >>> renderer.step()
    >>> renderer.step(3)
    >>> renderer.samples
    4
    >>> renderer.image
    Image(32 x 24, ...% covered)
    >>> renderer.reset(camera=isospline.camera_for(scene, view="top"))
    >>> renderer.samples
    0
    """

    def __init__(
        self, scene: _core.Scene, camera: _Camera | None = None, *, size: tuple[int, int] = (640, 360),
        integrator: _core.PathTracer | None = None, background: _Background = None, layers: Iterable[_Layer] = (),
        ambient_occlusion_samples: int = 16, encoding: Literal["linear", "srgb8"] = "linear",
    ) -> None:  # fmt: skip
        check_type(scene, "scene", _core.Scene, "a Scene")
        camera = camera_for(scene, size=size) if camera is None else camera
        integrator = _core.PathTracer() if integrator is None else integrator
        self._renderer = _core.ProgressiveRenderer(
            scene, camera, size=size, integrator=integrator, background=background, layers=layers,
            ambient_occlusion_samples=ambient_occlusion_samples, encoding=encoding,
        )  # fmt: skip

    def step(self, samples: int = 1, *, progress: _Progress = None) -> None:
        """Add samples to every pixel.

        Parameters
        ----------
        samples : int
            At least 1.
        progress : callable, optional
            Called with the finished fraction a few times a second; stops the step by returning a
            false value other than None.

        Raises
        ------
        Cancelled
            Where `progress` stopped it. Parts of the picture then are ahead of others, until the next step.
        RuntimeError
            Where the scene has changed since the first step: call `reset`.
        """
        self._renderer.step(samples, progress=progress)

    def reset(self, *, camera: _Camera | None = None) -> None:
        """Begin again, with another camera or, after a change of the scene, with the same one."""
        self._renderer.reset(camera)

    @property
    def image(self) -> Image:
        """The picture so far, an `Image` of its own; before the first step it is empty."""
        return Image(self._renderer.image())

    @property
    def samples(self) -> int:
        """Samples that every pixel has."""
        return self._renderer.samples


@explained
def render_progressive(
    scene: _core.Scene, camera: _Camera | None = None, *, samples: int | None = None, **options: Any
) -> Iterator[Image]:
    """Iterate over ever better path traced images of a scene.

    Samples double from image to image, so that each is better to see than the one before. Leave the loop, or close the
    generator, to stop.

    Parameters
    ----------
    scene, camera
        As for `ProgressiveRenderer`.
    samples : int, optional
        Samples a pixel of the last image; by default there is no last one.
    **options
        Of `ProgressiveRenderer`, such as size and integrator.

    Yields
    ------
    Image
        Of 1, 2, 4, 8 ... samples a pixel.

    Examples
    --------
    >>> import isospline
    >>> field = isospline.volumes.torus()
    >>> volume = isospline.Volume(field.samples(32), **field.grid(32))
    >>> scene = isospline.Scene([isospline.Isosurface(volume, field.level)])
    >>> camera = isospline.camera_for(scene)
    >>> for image in isospline.render_progressive(scene, camera, size=(32, 24), layers=("variance",)):
    ...     if image.variance.max() < 1e-2:
    ...         break
    """
    if samples is not None:
        check_count(samples, "samples")
    renderer = ProgressiveRenderer(scene, camera, **options)
    return _images(renderer, samples)


def _images(renderer: ProgressiveRenderer, samples: int | None) -> Iterator[Image]:
    while samples is None or renderer.samples < samples:
        more = max(1, renderer.samples)
        renderer.step(more if samples is None else min(more, samples - renderer.samples))
        yield renderer.image
