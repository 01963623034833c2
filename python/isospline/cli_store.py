"""Pictures of volumes that stay in a store, for ``isospline render``."""

from __future__ import annotations

import functools

from .store.detail import LevelsOfDetail


def add_store_options(command):
    """Options of volumes that stay in a store."""
    group = command.add_argument_group("store", "a folder that isospline convert has written")
    group.add_argument(
        "--exact", action="store_true", help="render the data's own resolution; by default voxels are about pixels"
    )
    group.add_argument(
        "--memory-limit", default="4GB", metavar="SIZE", help="of chunks and bricks in memory (default 4GB)"
    )


class Store:
    """What `isospline.VolumeData` is for a file: samples of an overview, and whether they are of a patient."""

    def __init__(self, arguments):
        self.levels_of_detail = LevelsOfDetail(arguments.file, arguments.memory_limit)
        self._check_model(arguments)

    @property
    def patient(self):
        return self.levels_of_detail.metadata.patient

    @functools.cached_property
    def data(self):
        return self.levels_of_detail.volume(self.levels_of_detail.overview).coefficients

    def _check_model(self, arguments):
        """Refuse a model other than that of the store."""
        defaults = {"degree": 2, "boundary": "mirror", "filter": "interpolate", "smoothing": 0.0}
        for name, default in defaults.items():
            given, held = getattr(arguments, name), getattr(self.levels_of_detail.metadata, name)
            if given not in (default, held):
                raise ValueError(f"--{name}: expected {held}, as in the store, got {given}")

    def scene_and_cameras(self, make_scene, make_cameras, arguments):
        """The scene of a picture at the level of detail that it needs, the cameras, and a sentence about the level.

        ``make_scene(volume)`` gives a tuple that begins with a scene, and ``make_cameras(made)`` the cameras of what
        it gave.
        """
        levels = self.levels_of_detail
        detail = 0 if arguments.exact else levels.overview
        made = make_scene(levels.volume(detail))
        cameras = make_cameras(made)
        if not arguments.exact:
            detail = levels.choose(cameras, arguments.size)
            if detail != levels.overview:
                made = make_scene(levels.volume(detail))
        hint = "; --exact renders level 0" if detail else ""
        return made, cameras, levels.describe(detail) + hint


def least_sample(data):
    """The least sample of a file or a store; coefficients may be less."""
    return data.levels_of_detail.metadata.levels[0].minimum if isinstance(data, Store) else data.data.min()
