"""Progressive path traced pictures."""

from __future__ import annotations

import math
import numbers
import os
import time
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, Literal

from .. import _core
from ..base.parameters import check_count, check_path, check_type
from ..base.progress import as_callable
from ..base.signatures import explained, explained_methods
from ..base.views import SIZE
from . import checkpoints
from .cameras import camera_for
from .files import in_detail
from .image import Image
from .layers import compiled, names_of
from .lights import named, resolve
from .path_tracer import PathTracer
from .scenes import as_scene

if TYPE_CHECKING:
    from ..base.types import Background, Layer, Progress
    from ..cameras.camera import _Camera


#: Seconds between two checkpoints of `ProgressiveRenderer.run`.
CHECKPOINT_INTERVAL = 60.0

#: `ProgressiveRenderer.run` checks the noise whenever the number of samples is a multiple of this. So a picture that
#: continues from a checkpoint ends at the same sample as without a pause.
NOISE_INTERVAL = 16

# What a checkpoint has.
_SUMS = ("sums", "directs", "tile_samples", "through_centers")


@explained_methods
class ProgressiveRenderer:
    """A path traced picture that is refined step by step, for viewers and for long rendering with limits.

    After any number of steps, the image is the mean of the samples of each pixel so far. It equals the image of
    `render` with that number of samples, bit for bit, for any number of threads. Any thread may call its methods; calls
    wait for each other.

    Parameters
    ----------
    scene : Scene, Isosurface, Mesh and so on
        As in `render`; of a store, the scale is that for the first camera. After a change of it, or of one of its
        objects, call `reset`.
    camera : PerspectiveCamera, ProjectionPlaneCamera, OrthographicCamera or PanoramicCamera, optional
        The camera; by default as in `render`.
    size : (int, int)
        Width and height of the image in pixels.
    light : PathTracer or "path-trace", optional
        Materials and lights; by default ``PathTracer()``.
    background, layers, ambient_occlusion_samples, encoding
        As in `render`.

    Examples
    --------
    >>> import isospline
    >>> field = isospline.volumes.torus()
    >>> volume = field.volume(32)
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
    >>> renderer.run(noise=0.05, time_limit=60)
    Image(32 x 24, ...% covered)
    """

    def __init__(
        self,
        scene: Any,
        camera: _Camera | None = None,
        *,
        size: tuple[int, int] = SIZE,
        light: PathTracer | Literal["path-trace"] | None = None,
        background: Background = None,
        layers: Iterable[Layer] = (),
        ambient_occlusion_samples: int = 16,
        encoding: Literal["linear", "srgb8"] = "linear",
    ) -> None:
        given, scene = scene, as_scene(scene)
        light = named(light)
        if light is not None:
            check_type(light, "light", (PathTracer, _core.PathTracer), "a PathTracer")
        camera = camera_for(scene, size=size) if camera is None else camera
        scene = in_detail(scene, given, [camera], size)
        path_tracer = resolve(scene, PathTracer() if light is None else light)
        self._layers = names_of(layers)
        self._renderer = _core.ProgressiveRenderer(
            scene,
            camera,
            size=size,
            path_tracer=path_tracer,
            background=background,
            layers=compiled(self._layers),
            ambient_occlusion_samples=ambient_occlusion_samples,
            encoding=encoding,
        )
        self._scene = scene
        # The options that determine samples, and their digests once a checkpoint needs them.
        self._parts: dict[str, Any] = dict(size=tuple(map(int, size)), path_tracer=path_tracer, camera=camera)
        self._prints: dict[str, str] | None = None

    def __reduce__(self) -> Any:
        raise TypeError("ProgressiveRenderer: cannot be pickled or copied; save_checkpoint keeps its samples")

    def step(self, samples: int = 1, *, progress: Progress = None) -> None:
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
            If `progress` stopped it. Some parts of the picture then have more samples than others, until the next step.
        RuntimeError
            If the scene has changed since the first step: call `reset`.
        """
        self._renderer.step(samples, progress=progress)

    def run(
        self,
        samples: int | None = None,
        *,
        noise: float | None = None,
        time_limit: float | None = None,
        checkpoint: str | os.PathLike[str] | None = None,
        progress: Progress = None,
    ) -> Image:
        """Add samples until there are enough, the noise is small enough, or the time is over.

        The first limit that is reached ends it. After Ctrl-C or an error, `image` and the checkpoint have the samples
        so far.

        Parameters
        ----------
        samples : int, optional
            Samples per pixel, including existing ones; not limited by default.
        noise : float, optional
            Limit of the property `noise`, above 0; it is checked after every 16 samples.
        time_limit : float, optional
            Seconds, above 0. The first pass over the picture, with two samples, is always completed.
        checkpoint : str or path-like, optional
            A file from which `load_checkpoint` can continue. It is written at the beginning, every minute, and at the
            end in all cases. An older one of this picture is kept until there are as many samples.
        progress : callable or True, optional
            Called with the finished fraction, which is an estimate if noise is the limit; stops the work by returning a
            false value other than None. True shows a bar.

        Returns
        -------
        Image
            As in `image`. With a time limit, some parts may have one sample more than others.

        Raises
        ------
        ValueError
            If no limit is given, and for limits out of range.
        Cancelled
            If `progress` stopped it.
        RuntimeError
            If the scene has changed since the first step: call `reset`.
        OSError
            If the checkpoint cannot be written.
        """
        limits = _Limits(samples, noise, time_limit)
        if checkpoint is not None:
            kept = self._samples_in(checkpoint)
            self._save_from(kept, checkpoint)  # fail early if it cannot be written
        tell = as_callable(progress)
        saved = time.monotonic()
        try:
            while not limits.are_reached(self):
                try:
                    self._step_within(limits, tell)
                except _core.Cancelled:
                    if not limits.is_out_of_time:
                        raise
                    break
                if checkpoint is not None and time.monotonic() - saved > CHECKPOINT_INTERVAL:
                    self._save_from(kept, checkpoint)
                    saved = time.monotonic()
        finally:
            if checkpoint is not None:
                self._save_from(kept, checkpoint)
        return self.image

    def _samples_in(self, path: str | os.PathLike[str]) -> int:
        """The samples of a checkpoint of this picture; 0 for any other file."""
        try:
            check_path(path)
            return int(checkpoints.load(path, self._fingerprint(), _SUMS)["tile_samples"].min())
        except (OSError, ValueError):
            return 0

    def _save_from(self, samples: int, path: str | os.PathLike[str]) -> None:
        if self.samples >= samples:
            self.save_checkpoint(path)

    def _step_within(self, limits: _Limits, tell: Any) -> None:
        """Add one sample, or the first two: a single one would go through the centres and could not be continued."""
        done = self.samples
        count = 2 if done == 0 and limits.samples != 1 else 1

        def report(fraction: float) -> bool:
            if done > 0 and limits.check_time():
                return False
            go_on = None if tell is None else tell(limits.part(done + count * fraction))
            return go_on is None or bool(go_on)

        self.step(count, progress=report)

    def _fingerprint(self) -> dict[str, str]:
        if self._prints is None:
            self._prints = checkpoints.fingerprint(self._scene, **self._parts)
        return self._prints

    def save_checkpoint(self, path: str | os.PathLike[str]) -> None:
        """Write the samples so far to a file, completely or not at all.

        The file has the sums of all samples, 56 bytes per pixel or, with the layer "direct", 80, and digests that
        identify the picture.

        Raises
        ------
        RuntimeError
            If the scene has changed since the first step.
        OSError
            If the file cannot be written.
        """
        check_path(path)
        checkpoints.save(path, self._renderer.state(), self._fingerprint())

    def load_checkpoint(self, path: str | os.PathLike[str], *, progress: Progress = None) -> None:
        """Continue from a file of `save_checkpoint`. The picture is then the same, bit for bit, as without a pause.

        The background and other layers may differ, because samples do not depend on them.

        Raises
        ------
        ValueError
            For a checkpoint of another scene, camera, size, path tracer or version of isospline (the message names it),
            for one without the sums of a requested layer "direct", and for a file that is damaged or not a checkpoint.
            The renderer is then unchanged.
        OSError
            If the file cannot be read.
        """
        check_path(path)
        self._prints = None
        self._renderer.resume(checkpoints.load(path, self._fingerprint(), _SUMS), progress=progress)

    def reset(self, *, camera: _Camera | None = None) -> None:
        """Begin again, with another camera or, after a change of the scene, with the same one."""
        self._renderer.reset(camera)
        self._prints = None
        if camera is not None:
            self._parts["camera"] = camera

    @property
    def image(self) -> Image:
        """The picture so far, as a new `Image`; empty before the first step."""
        return Image(self._renderer.image(), self._layers)

    @property
    def samples(self) -> int:
        """The number of samples of every pixel."""
        return self._renderer.samples

    @property
    def noise(self) -> float:
        """The change of the displayed picture by one standard error of the colour, from 0 to 1.

        It is the root mean square of ``sqrt(color + error) - sqrt(color)`` over pixels and red, green and blue, with
        colours up to 1. Infinite below 2 samples, and while some pixels have a sample more than others.

        References
        ----------
        H. Dammertz et al., "A hierarchical automatic stopping condition for Monte Carlo global illumination", WSCG
        2010 (errors relative to the root of the brightness).
        """
        return self._renderer.noise


class _Limits:
    """The limits of `ProgressiveRenderer.run`."""

    def __init__(self, samples: Any, noise: Any, time_limit: Any) -> None:
        if samples is None and noise is None and time_limit is None:
            raise ValueError("samples: expected a number, or noise or time_limit, got None")
        if samples is not None:
            check_count(samples, "samples")
        for name, value in (("noise", noise), ("time_limit", time_limit)):
            if value is not None:
                check_type(value, name, numbers.Real, "a number")
                if not 0 < value < math.inf:
                    raise ValueError(f"{name}: expected a finite number above 0, got {value!r}")
        self.samples = samples
        self._noise = noise
        self._time_limit = time_limit
        self._began = time.monotonic()
        self._seen_noise: tuple[int, float] | None = None  # a number of samples, and the noise at that number
        self.is_out_of_time = False

    def check_time(self) -> bool:
        """Whether the time is over."""
        if self._time_limit is not None and time.monotonic() - self._began >= self._time_limit:
            self.is_out_of_time = True
        return self.is_out_of_time

    def are_reached(self, renderer: ProgressiveRenderer) -> bool:
        """Whether any of the limits is reached after some steps."""
        done = renderer.samples
        if self.samples is not None and done >= self.samples:
            return True
        if self._noise is not None and done and done % NOISE_INTERVAL == 0:
            noise = renderer.noise
            if math.isfinite(noise):
                self._seen_noise = (done, noise)
                if noise <= self._noise:
                    return True
        return done > 0 and self.check_time()

    def part(self, done: float) -> float:
        """The finished fraction at a number of samples."""
        parts = [0.0]
        if self.samples is not None:
            parts.append(done / self.samples)
        if self._seen_noise is not None:  # noise falls with the square root of the samples
            at, noise = self._seen_noise
            parts.append(done / (at * (noise / self._noise) ** 2))
        if self._time_limit is not None:
            parts.append((time.monotonic() - self._began) / self._time_limit)
        return min(max(parts), 1.0)


@explained
def render_progressive(
    scene: Any, camera: _Camera | None = None, *, samples: int | None = None, **options: Any
) -> Iterator[Image]:
    """Iterate over path traced images of a scene with decreasing noise.

    The number of samples doubles from image to image. Leave the loop, or close the generator, to stop.

    Parameters
    ----------
    scene, camera
        As in `ProgressiveRenderer`.
    samples : int, optional
        Samples per pixel of the last image; by default the iteration does not end.
    **options
        Options of `ProgressiveRenderer`, such as size and light.

    Yields
    ------
    Image
        Images with 1, 2, 4, 8 ... samples per pixel.

    Examples
    --------
    >>> import isospline
    >>> field = isospline.volumes.torus()
    >>> volume = field.volume(32)
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
