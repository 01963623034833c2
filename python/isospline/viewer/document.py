"""The volumes and meshes that a viewer has open, each under a key, and what is known of their values."""

from __future__ import annotations

import os
import threading
from dataclasses import dataclass, field, replace

import numpy as np

from .. import _core
from ..interop import read_mesh
from ..io import VolumeData, read_volume
from ..levels import histogram, levels_of_histogram

#: Suffixes of files that hold meshes; others are read as volumes.
MESH_SUFFIXES = (".stl", ".ply", ".obj", ".off", ".glb", ".gltf", ".vtp", ".vtu", ".msh", ".inp", ".3mf")
#: Formats whose files always say where the patient is: their world is LPS.
PATIENT_FORMATS = ("NIfTI", "DICOM")

# Bars of the histogram in the page, and the points at which the values of a Volume without samples are looked up.
BARS = 256
LOOKED_UP = 500_000


@dataclass(frozen=True, eq=False)
class Source:
    """A volume or a mesh.

    Attributes
    ----------
    key : str
        What states call it.
    item : Volume or Mesh
    path : str or None
        The file that it was read from.
    read_options, model_options : dict
        Of `read_volume` and `Volume`, with which it was read.
    values, counts : array
        The values of a volume's samples, ascending, and how often they occur.
    patient : bool
        Whether world coordinates are a patient's (LPS).
    template : Isosurface or None
        A surface whose options those of other levels have.
    """

    key: str
    item: object
    path: str | None = None
    read_options: dict = field(default_factory=dict)
    model_options: dict = field(default_factory=dict)
    values: np.ndarray = field(default_factory=lambda: np.zeros(0))
    counts: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    patient: bool = False
    template: object = None

    @property
    def is_volume(self):
        return isinstance(self.item, _core.Volume)

    @property
    def name(self):
        return os.path.basename(self.path) if self.path else self.key

    @property
    def expression(self):
        """Python that reads the file again; None where there is no file."""
        if self.path is None:
            return None
        if not self.is_volume:
            return f"isospline.read_mesh({self.path!r})"
        reading = ", ".join([repr(self.path), *(f"{name}={value!r}" for name, value in self.read_options.items())])
        modelling = ", ".join(f"{name}={value!r}" for name, value in self.model_options.items())
        return f"isospline.read_volume({reading}).to_volume({modelling})"

    @property
    def range(self):
        """The least and the greatest value."""
        return float(self.values[0]), float(self.values[-1])

    def suggested_levels(self, count=1):
        """Levels that part the values."""
        return levels_of_histogram(self.values, self.counts, count)

    def window(self):
        """Values to show black and white in slices: all but the rarest."""
        share = np.cumsum(self.counts) / self.counts.sum()
        low, high = (float(self.values[np.searchsorted(share, part)]) for part in (0.01, 0.995))
        return (low, high) if low < high else self.range

    def to_json(self):
        """What the page needs to know."""
        about = {"key": self.key, "name": self.name, "bounds": np.asarray(self.item.bounds).tolist()}
        if not self.is_volume:
            return {**about, "kind": "mesh", "faces": len(self.item.faces)}
        lower, upper = self.range
        ends = (lower, upper if upper > lower else lower + 1)
        bars = np.histogram(self.values, BARS, range=ends, weights=self.counts)[0]
        return {
            **about,
            "kind": "volume",
            "range": [lower, upper],
            "spacing_of_values": float(np.diff(self.values).min()) if 1 < len(self.values) < 4000 else 0.0,
            "histogram": bars.astype(int).tolist(),
            "shape": list(self.item.shape),
            "affine": self.item.affine.tolist(),
            "window": list(self.window()),
            "patient": self.patient,
        }


class Document:
    """Sources by their keys; any thread may add to it and read it."""

    def __init__(self):
        self._lock = threading.Lock()
        self._sources = {}

    def __getitem__(self, key):
        with self._lock:
            source = self._sources.get(key)
        if source is None:
            raise ValueError(f"source: expected the key of an open volume or mesh, got {key!r}")
        return source

    def __iter__(self):
        with self._lock:
            return iter(list(self._sources.values()))

    def add(self, make):
        """Add the source that ``make(key)`` returns for a new key."""
        with self._lock:
            number = len(self._sources) + 1
        source = make(f"source{number}")
        with self._lock:
            while source.key in self._sources:
                number += 1
                source = replace(source, key=f"source{number}")
            self._sources[source.key] = source
        return source

    def source_of_volume(self, volume):
        """The source of a Volume that is open, or None."""
        return next((source for source in self if source.item is volume), None)

    def bounds(self, keys=None):
        """Lower and upper corner of all sources, or of some."""
        boxes = [source.item.bounds for source in self if keys is None or source.key in keys]
        if not boxes:
            return np.array([[-1.0] * 3, [1.0] * 3])
        return np.array([np.min([box[0] for box in boxes], axis=0), np.max([box[1] for box in boxes], axis=0)])


def read_source(path, *, progress=None, read_options=None, model_options=None):
    """A function of a key that reads a file: what `Document.add` takes.

    Parameters
    ----------
    path : path-like
        A volume or, by its suffix, a mesh.
    progress : callable, optional
        ``progress(title, fraction)``.
    read_options, model_options : dict, optional
        Of `read_volume` and of `Volume`, in types that JSON has.
    """
    read_options, model_options = read_options or {}, model_options or {}
    path, report = os.fspath(path), progress or (lambda title, fraction: None)
    name = os.path.basename(path.rstrip("/")) or path
    place = os.path.abspath(path)

    def mesh(key):
        report(f"reading {name}", 0.0)
        return Source(key, read_mesh(path), place)

    def volume(key):
        report(f"reading {name}", 0.0)
        data = read_volume(path, **read_options)
        report(f"counting the values of {name}", 0.0)
        values, counts = histogram(data.data)
        model = data.to_volume(
            **model_options, progress=lambda fraction: report(f"filtering {name}", fraction) and None
        )
        patient = data.format in PATIENT_FORMATS
        return Source(key, model, place, read_options, model_options, values, counts, patient)

    return mesh if path.lower().endswith(MESH_SUFFIXES) else volume


def source_of(item):
    """A function of a key that makes a source of a Volume, VolumeData, array or Mesh: what `Document.add` takes."""

    def make(key):
        if isinstance(item, _core.Mesh):
            return Source(key, item)
        patient = isinstance(item, VolumeData) and item.format in PATIENT_FORMATS
        if isinstance(item, VolumeData):
            model, samples = item.to_volume(), item.data
        elif isinstance(item, _core.Volume):
            model, samples = item, _some_values(item)
        else:
            model, samples = _core.Volume(item), item
        values, counts = histogram(samples)
        return Source(key, model, values=values, counts=counts, patient=patient)

    return make


def _some_values(volume):
    """The model's values at some of its samples, evenly spread."""
    steps = max(1, int(np.ceil((np.prod(volume.shape[:3], dtype=float) / LOOKED_UP) ** (1 / 3))))
    axes = [np.arange(0, count, steps, dtype=float) for count in index_shape(volume)]
    index = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return volume.sample(index @ volume.affine[:3, :3].T + volume.affine[:3, 3])


def index_shape(volume):
    """Samples of a volume along x, y and z."""
    return volume.shape[::-1] if volume.axes == "zyx" else volume.shape

