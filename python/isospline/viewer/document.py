"""The volumes and meshes that are open in a viewer, each under a key, with the distribution of their values."""

from __future__ import annotations

import functools
import os
import threading
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..base.units import ratio_of_units
from ..base.values import part, same
from ..clips import HalfSpace
from ..color_rules.rule import _ColorRule
from ..colors import hex_of
from ..io import VolumeData, read_volume
from ..levels import bars, histogram, levels_of_histogram, some_values
from ..looks import Material
from ..picture.rules import own_material
from ..scene import Mesh, Volume
from ..scene.cells import index_shape
from ..scene.mesh_files import MESH_SUFFIXES, read_mesh, unit_of_mesh
from ..store.detail import Scales, is_store
from ..suggest.presentation import Presentation, body_mask, present
from .to_page import SourceAbout

# The number of bars in the page's histogram.
BARS = 256


@dataclass(frozen=True, eq=False)
class Source:
    """A volume or a mesh.

    Attributes
    ----------
    key : str
        The key by which states name the source.
    item : Volume or Mesh
    path : str or None
        The file that it was read from.
    within : str or None
        The folder of the upload that the file belongs to; None for a file that was opened by name.
    read_options, model_options : dict
        The options of `read_volume` and `Volume` that it was read with.
    values, counts : array
        The values of a volume's samples, ascending, and how often they occur.
    patient : bool
        Whether world coordinates are a patient's (LPS).
    mesh_unit : str
        The unit of length that the file of a mesh tells; empty if it is not known.
    template : Isosurface or None
        A surface with the options that other levels get.
    scales : Scales or None
        For a volume in a store; `item` is then its overview.
    masks : dict
        The masks of bodies by their level and their scale; `making` locks it.
    """

    key: str
    item: Any
    path: str | None = None
    within: str | None = None
    read_options: dict[str, Any] = field(default_factory=dict)
    model_options: dict[str, Any] = field(default_factory=dict)
    values: np.ndarray = field(default_factory=lambda: np.zeros(0))
    counts: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    patient: bool = False
    mesh_unit: str = ""
    template: Any = None
    scales: Any = None
    masks: dict[Any, np.ndarray] = field(default_factory=dict)
    making: Any = field(default_factory=threading.Lock)

    @property
    def is_volume(self):
        return isinstance(self.item, Volume)

    def scale(self, camera, size):
        """The scale that a picture needs; None if there is only one level."""
        return None if self.scales is None else self.scales.choose([camera], size)

    def volume(self, scale=None):
        """The volume at a scale of its store, or the overview."""
        return self.item if scale is None else self.scales.volume(scale)

    @property
    def grid(self):
        """What has the grid of a volume's slices and indices: the volume, or the scales of its store."""
        return self.scales or self.item

    @property
    def unit(self):
        """The unit of length; empty if it is not known."""
        return self.item.unit if self.is_volume else self.mesh_unit

    @property
    def name(self):
        return os.path.basename(self.path) if self.path else self.key

    def expression(self, camera, size):
        """Python code that opens the file again, or None without a file.

        A store is opened at the scale that a picture needs. An upload is named without its folder, which is
        removed with the viewer.
        """
        if self.path is None:
            return None
        path = self.path if self.within is None else self.name
        if not self.is_volume:
            return f"isospline.read_mesh({path!r})"
        if self.scales is not None:
            detail = self.scale(camera, size)
            return f"isospline.open_volume({path!r}, scale={detail})"
        reading = ", ".join([repr(path), *(f"{name}={value!r}" for name, value in self.read_options.items())])
        modelling = ", ".join(f"{name}={value!r}" for name, value in self.model_options.items())
        return f"isospline.read_volume({reading}).to_volume({modelling})"

    @property
    def range(self):
        """The smallest and the largest value."""
        return float(self.values[0]), float(self.values[-1])

    @property
    def level_range(self):
        """The lowest and the highest level of an isosurface: at others, there is no surface."""
        whole = self.item if self.scales is None else self.scales.metadata.scales[0]
        return whole.minimum, whole.maximum

    def check_level(self, level):
        """Check that a volume can have an isosurface at a level."""
        lower, upper = self.level_range
        if not lower <= level <= upper:
            raise ValueError(f"level: expected {lower:.6g} to {upper:.6g}, the values of {self.name}, got {level:.6g}")

    @functools.cached_property
    def given_options(self):
        """The options of the surface that was given, without its level, its largest pieces and whether it is closed."""
        if self.template is None:
            return {}
        state = self.template.__getstate__()
        planes = [(plane[:3], plane[3]) for plane in state["clip"]]
        clip = [HalfSpace(offset / (normal @ normal) * normal, normal) for normal, offset in planes]
        cuts = {"clip": clip, "capped": self.template.capped} if clip else {}
        mask = state["mask"]
        if mask is not None:
            mask = mask.astype(bool).reshape(index_shape(self.item)[::-1])  # by z, y and x
            mask = mask if self.item.axes == "zyx" else mask.T
        return {"inside": self.template.inside, "mask": mask, **cuts}

    @functools.cached_property
    def material(self):
        """The look of the surface or the mesh that was given; of a mesh with values, its colour is a rule."""
        given = self.item if self.template is None else self.template
        return (None if isinstance(given, Volume) else own_material(given)) or Material()

    @property
    def rule(self):
        """The rule that is the colour of the surface or the mesh that was given, or None."""
        color = self.material.color
        return color if isinstance(color, _ColorRule) else None

    @property
    def look(self):
        """The given look as fields of `ObjectState`; pictures take the rest of it from `material`."""
        names = ("opacity", "silhouette_opacity", "metallic", "roughness")
        look = {name: getattr(self.material, name) for name in names}
        if self.rule is not None:
            look["color_by"] = "own"
        elif self.material.color is not None:
            look["color"] = hex_of(part(self.material, "color"))
        elif isinstance(self.item, Mesh) and self.item._colors() is not None:
            look["color"] = "white"  # times the colours of the vertices
        return look

    def only_in_memory(self, state):
        """The parameters of the given surface that a session of a state would lack, and the saved Python code."""
        if self.template is None:
            return []
        options, plain = self.given_options, Material()
        names = ("specular", "cap_color", "silhouette_exponent")
        is_lost = {
            "inside": options["inside"] != "above",
            "mask": options["mask"] is not None,
            "clip": "clip" in options,
            "color": any(each.source == self.key and each.color_by == "own" for each in state.objects),
            **{name: not same(getattr(self.material, name), getattr(plain, name)) for name in names},
        }
        return [name for name in is_lost if is_lost[name]]

    @functools.cached_property
    def presentation(self):
        """What is shown by default, as in `render`."""
        suggested = levels_of_histogram(self.values, self.counts)
        if not suggested:
            return Presentation(self.range[0])
        return present(self.item, suggested, self.range[0])

    def default_levels(self):
        """The level of the first isosurface, and the level of the body to which it is confined, or None.

        Volumes in stores have no level of the body, because its components would need all of the store.
        """
        return self.presentation.level, None if self.scales else self.presentation.confined_at

    def mask(self, body_level, scale=None):
        """The mask of the largest piece at a level, computed once; None for a level of None."""
        if body_level is None:
            return None
        with self.making:
            known = (body_level, scale)
            if known not in self.masks:
                self.masks[known] = self._mask(body_level, self.volume(scale))
            return self.masks[known]

    def _mask(self, body_level, volume):
        """The samples to which a surface is confined: those shown by default, or the largest piece at another level."""
        is_default = body_level == self.presentation.confined_at
        return self.presentation.mask(volume) if is_default else body_mask(volume, body_level)

    def mask_expression(self, body_level):
        """Python code of the same mask, for the volume named by the key."""
        if self.presentation.left_out and body_level == self.presentation.confined_at:
            return f"isospline.suggest_mask({self.key})"
        return f"isospline.Isosurface({self.key}, {body_level!r}, largest=1).to_mask(whole_cells=True)"

    def window(self):
        """The values shown as black and white in slices: the range without the lowest 1% and the highest 0.5%."""
        share = np.cumsum(self.counts) / self.counts.sum()
        low, high = (float(self.values[np.searchsorted(share, part)]) for part in (0.01, 0.995))
        return (low, high) if low < high else self.range

    @property
    def middle(self):
        """The middle of a volume, in grid coordinates."""
        return tuple((np.array(index_shape(self.grid)) - 1) / 2)

    def about(self):
        """The description for the page."""
        bounds = tuple(map(tuple, np.asarray(self.item.bounds).tolist()))
        if not self.is_volume:
            about = {"faces": len(self.item.faces), "unit": self.unit, "has_rule": self.rule is not None}
            return SourceAbout(self.key, self.name, "mesh", bounds, **about)
        return SourceAbout(
            self.key,
            self.name,
            "volume",
            bounds,
            range=self.range,
            suggested_levels=tuple(map(float, levels_of_histogram(self.values, self.counts))),
            level_range=self.level_range,
            spacing_of_values=float(np.diff(self.values).min()) if 1 < len(self.values) < 4000 else 0.0,
            histogram=tuple(bars(self.values, self.counts, BARS).tolist()),
            counts=tuple(map(int, index_shape(self.grid))),
            affine=tuple(map(tuple, self.grid.affine.tolist())),
            window=self.window(),
            patient=self.patient,
            unit=self.unit,
            body_level=self.default_levels()[1],
            has_rule=self.rule is not None,
        )


class Document:
    """Sources by their keys; any thread may add and read them."""

    def __init__(self):
        self._lock = threading.Lock()
        self._sources = {}
        self._count = 0  # of keys so far: none is used again

    def __getitem__(self, key):
        source = self.get(key)
        if source is None:
            raise ValueError(f"source: expected the key of an open volume or mesh, got {key!r}")
        return source

    def __contains__(self, key):
        return self.get(key) is not None

    def get(self, key):
        """A source, or None if it is not open."""
        with self._lock:
            return self._sources.get(key)

    def __iter__(self):
        with self._lock:
            return iter(list(self._sources.values()))

    def add(self, make):
        """Add the source that ``make(key)`` returns for a new key; its unit of length is that of the others."""
        with self._lock:
            self._count += 1
            key = f"source{self._count}"
        source = make(key)
        if not np.isfinite(source.item.bounds).all():
            raise ValueError(f"{source.name}: expected a mesh with vertices, got one without")
        source.about()  # what windows are told about it must not fail later
        with self._lock:
            for other in self._sources.values():
                if ratio_of_units(source.unit, other.unit) != 1:
                    raise ValueError(
                        f"{source.name}: expected coordinates in {other.unit}, as in {other.name}, got {source.unit}"
                    )
            self._sources[key] = source
        return source

    def remove(self, key):
        """Close a source."""
        with self._lock:
            self._sources.pop(key, None)

    def source_of_volume(self, volume):
        """The source of a Volume that is open, or None."""
        return next((source for source in self if source.item is volume), None)

    def bounds(self, keys=None):
        """The lower and the upper corner of all sources, or of some."""
        boxes = [source.item.bounds for source in self if keys is None or source.key in keys]
        if not boxes:
            return np.array([[-1.0] * 3, [1.0] * 3])
        return np.array([np.min([box[0] for box in boxes], axis=0), np.max([box[1] for box in boxes], axis=0)])


def read_source(path, *, progress=None, read_options=None, model_options=None, within=None):
    """A function of a key that reads a file, for `Document.add`.

    Parameters
    ----------
    path : path-like
        A volume or, by its suffix, a mesh.
    progress : callable, optional
        ``progress(title, fraction)``.
    read_options, model_options : dict, optional
        Options of `read_volume` and of `Volume`, of types that JSON supports.
    within : str, optional
        The folder of an upload: the file may refer to files in it, and to no others.
    """
    read_options, model_options = read_options or {}, model_options or {}
    path, report = os.fspath(path), progress or (lambda title, fraction: None)
    name = os.path.basename(path.rstrip("/")) or path
    place = os.path.abspath(path)

    def mesh(key):
        report(f"reading {name}", 0.0)
        return Source(key, read_mesh(path, within=within), place, within, mesh_unit=unit_of_mesh(path))

    def volume(key):
        report(f"reading {name}", 0.0)
        data = read_volume(path, within=within, **read_options)
        report(f"counting the values of {name}", 0.0)
        values, counts = histogram(data.data)
        model = data.to_volume(
            **model_options, progress=lambda fraction: report(f"filtering {name}", fraction) and None
        )
        return Source(key, model, place, within, read_options, model_options, values, counts, data.patient)

    def store(key):
        report(f"opening {name}", 0.0)
        levels = Scales(path)
        overview = levels.volume(levels.overview)
        values, counts = histogram(some_values(overview))
        patient = levels.metadata.patient
        return Source(key, overview, place, within, {}, {}, values, counts, patient, scales=levels)

    if is_store(path):
        if within is not None:
            raise ValueError(f"{name}: expected a file, got a store, which is opened by name")
        return store
    return mesh if is_mesh(path) else volume


def is_mesh(path):
    """Whether a file is read as a mesh."""
    return path.lower().endswith(MESH_SUFFIXES) and not is_store(path)


def source_of(item):
    """A function of a key that makes a source of a Volume, VolumeData, array or Mesh, for `Document.add`."""

    def make(key):
        if isinstance(item, Mesh):
            return Source(key, item)
        patient = isinstance(item, (VolumeData, Volume)) and item.patient
        if isinstance(item, VolumeData):
            model, samples = item.to_volume(), item.data
        elif isinstance(item, Volume):
            model, samples = item, some_values(item)
        else:
            model, samples = Volume(item), item
        values, counts = histogram(samples)
        return Source(key, model, values=values, counts=counts, patient=patient)

    return make
