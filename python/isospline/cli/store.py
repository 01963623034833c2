"""Volumes that stay in a store, for ``isospline render``, ``info``, ``measure`` and ``mesh``."""

from __future__ import annotations

import functools
import warnings

import numpy as np

from ..base.parameters import describe_not_finite
from ..base.system import warn
from ..io import VolumeData
from ..levels import some_values
from ..store.detail import Scales, is_store
from ..suggest.presentation import present, present_data
from .given import MODEL, OF_FILES, keywords, refuse_with, refuse_without
from .summary import bounds_of, summarize
from .types import memory

#: The options of volumes that stay in a store.
OF_STORES = ("memory_limit", "exact")


def add_memory_limit(command):
    """The option of all commands for volumes that stay in a store; returns its group."""
    group = command.add_argument_group("store", "a folder that isospline convert has written")
    group.add_argument(
        "--memory-limit",
        type=memory,
        metavar="SIZE",
        help="most memory of chunks and bricks (default 4GB)",
    )
    return group


def add_store_options(command):
    """Options for pictures of volumes that stay in a store."""
    add_memory_limit(command).add_argument(
        "--exact", action="store_true", help="render the data's own resolution; by default voxels are about pixels"
    )


def opened(arguments, read):
    """The volume of a command: a store, or what ``read(arguments)`` gives for a file."""
    if is_store(arguments.file):
        return Store(arguments)
    refuse_without(arguments, OF_STORES, "a store", arguments.file)
    return read(arguments)


def finite(volume, path, hint=""):
    """The volume of a file, whose samples must be finite; `hint` is about NaN."""
    if found := describe_not_finite(volume.data):
        hint = hint if np.isnan(volume.data).any() else ""
        raise ValueError(f"{path}: expected finite samples, got {found}{hint}")
    return volume


class Store:
    """A store in place of a `VolumeData`: values of its overview, and whether they are of a patient."""

    def __init__(self, arguments):
        self.scales = Scales(arguments.file, **keywords(arguments, ["memory_limit"]))
        self._check_options(arguments)

    @property
    def patient(self):
        return self.scales.metadata.patient

    @property
    def unit(self):
        return self.scales.metadata.unit

    @functools.cached_property
    def data(self):
        return some_values(self.overview)

    @property
    def overview(self):
        return self.scales.volume(self.scales.overview)

    @property
    def direction(self):
        return self.scales.metadata.scales[self.scales.overview].direction

    def _check_options(self, arguments):
        """Refuse a model other than that of the store, and options of files with samples."""
        for name, value in keywords(arguments, MODEL).items():
            held = getattr(self.scales.metadata, name)
            if value != held:
                raise ValueError(f"--{name}: expected {held}, as in the store, got {value}")
        refuse_with(arguments, OF_FILES, f"the store {arguments.file}, whose samples isospline convert has read")

    def to_volume(self, **model):
        """The volume of the data's own resolution; its model is that of the store."""
        return self.scales.volume(0)

    def summary(self, path):
        """What `summarize` finds out about a file: the histogram is that of the overview."""
        levels, metadata = self.scales, self.scales.metadata

        def placed(level, samples, **others):
            return VolumeData(
                samples,
                level.spacing,
                level.origin,
                level.direction,
                unit=metadata.unit,
                patient=self.patient,
                **others,
            )

        finest, overview = metadata.scales[0], metadata.scales[levels.overview]
        about = f"isospline store, degree {metadata.degree}, {len(metadata.scales)} scales"
        if levels.overview or self.data.size < np.prod(overview.shape):
            about += f"; mean and histogram are those of {self.data.size} values of level {levels.overview}"
        whole = placed(finest, np.broadcast_to(np.float32(0), finest.shape))
        return {
            **summarize(placed(overview, self.data[:, None, None], format=about), path),
            "size": list(finest.shape[::-1]),
            "type": "float32",
            "bytes": whole.data.nbytes,
            "spacing": list(finest.spacing),
            "origin": list(finest.origin),
            "bounds": bounds_of(whole),
            "minimum": finest.minimum,
            "maximum": finest.maximum,
        }

    def scene_and_cameras(self, make_scene, make_cameras, arguments):
        """The scene of a picture at the scale that it needs, the cameras, and a sentence about the level.

        ``make_scene(volume)`` gives a tuple that begins with a scene, and ``make_cameras(made)`` the cameras of what
        it gave. Warnings are those of the scene that is returned: the overview may have another range.
        """
        levels = self.scales
        first = 0 if arguments.exact else levels.overview
        with warnings.catch_warnings(record=True) as told:
            made = make_scene(levels.volume(first))
            cameras = make_cameras(made)
        detail = first if arguments.exact else levels.choose(cameras, arguments.size)
        if detail != first:
            made = make_scene(levels.volume(detail))
        else:
            for each in told:
                warn(str(each.message))
        hint = "; --exact renders level 0" if detail else ""
        return made, cameras, levels.describe(detail) + hint


def presented(data, suggested, inside="above"):
    """The presentation of a file, or of a store, which is that of pictures of it in Python."""
    if isinstance(data, Store):
        return present(data.overview, inside=inside)
    return present_data(data, suggested, data.data.min(), inside)
