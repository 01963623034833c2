"""Pictures made in bands of rows, so that a checkpoint can keep the finished bands."""

from __future__ import annotations

import os
import time
from typing import Any

import numpy as np

from .. import _core
from ..distributed.windows import Canvas
from ..picture import checkpoints
from ..picture.image import Image
from ..picture.progressive import CHECKPOINT_INTERVAL
from ..picture.rendering import render

#: The largest number of bands of a picture. An interruption loses at most one band.
BANDS = 32


class BandedPicture:
    """A picture of `render` in bands from the top, with the same pixels as the whole picture, bit for bit."""

    def __init__(self, scene: _core.Scene, camera: Any, *, size: tuple[int, int], **options: Any) -> None:
        self._scene, self._camera, self._size, self._options = scene, camera, size, options
        described = {name: _described(value) for name, value in options.items()}
        self._prints = checkpoints.fingerprint(scene, size=tuple(size), **described, camera=camera)
        self._canvas = Canvas((0, 0, *size))
        self.rows = 0  # finished, from the top

    def save_checkpoint(self, path: str | os.PathLike[str]) -> None:
        """Write the finished rows to a file, completely or not at all."""
        layers = {f"layer {name}": pixels[: self.rows] for name, pixels in self._canvas.layers.items()}
        counts = np.array([self.rows, self._canvas.covered], np.int64)
        checkpoints.save(path, {"counts": counts, **layers}, self._prints)

    def load_checkpoint(self, path: str | os.PathLike[str]) -> None:
        """Continue from a file of `save_checkpoint`. The error for another picture names the part that differs."""
        layers = checkpoints.load(path, self._prints, ["counts"])
        counts = layers.pop("counts")
        width, height = self._size
        if counts.shape != (2,) or counts.dtype != np.int64 or not 0 <= counts[0] < height or counts[1] < 0:
            raise ValueError(checkpoints.damaged(path, "its counts are out of range"))
        self.rows, covered = counts.tolist()
        for name, pixels in layers.items():
            if pixels.dtype != np.uint8 or pixels.ndim != 3 or pixels.shape[:2] != (self.rows, width):
                raise ValueError(checkpoints.damaged(path, f"{name} has another shape or type"))
        self._canvas.restore({name.removeprefix("layer "): pixels for name, pixels in layers.items()}, covered)

    def run(self, checkpoint: str | os.PathLike[str], progress: Any = None) -> Image:
        """Render the missing rows. The checkpoint is written at the beginning, every minute, and at the end."""
        width, height = self._size
        step = -(-height // BANDS)
        self.save_checkpoint(checkpoint)  # so that a bad path is an error before the work
        saved = time.monotonic()
        try:
            while True:
                count = min(step, height - self.rows)

                def report(fraction, done=self.rows, count=count):
                    return None if progress is None else progress((done + fraction * count) / height)

                window = (0, self.rows, width, count)
                image = render(
                    self._scene, self._camera, size=self._size, crop=window, progress=report, **self._options
                )
                self._canvas.paste(image)
                if self.rows + count == height:
                    return self._canvas.image()
                # The checkpoint never has the last band, which gives the image its other properties.
                self.rows += count
                if time.monotonic() - saved > CHECKPOINT_INTERVAL:
                    self.save_checkpoint(checkpoint)
                    saved = time.monotonic()
        finally:
            self.save_checkpoint(checkpoint)


def _described(option):
    """An option of `render` as plain values, for a fingerprint."""
    return vars(option) if hasattr(option, "__dataclass_fields__") else option
