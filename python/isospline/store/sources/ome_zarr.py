"""Folders of Zarr and N5: the choice of the volume's array, and the place of its samples."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...base.parameters import printable
from ...io import VolumeData
from ...io.checks import one_unit
from ...io.told import warn_of_place
from .. import ome
from ..metadata import read_metadata
from .chunked import ORDERS, ChunkedSource, load, read_json

#: Files that identify a folder of Zarr or N5.
ZARR_FILES, N5_FILE = ("zarr.json", ".zarray", ".zgroup"), "attributes.json"

# The transformations of coordinates that are applied.
_STEPS = ("identity", "scale", "translation")
# What all levels of a group of N5 have, as far as they do not say it.
_SPACINGS = ("pixelResolution", "resolution")
_OF_ALL_LEVELS = (*_SPACINGS, "units", "offset", "affineTransform")
_COARSE = r"s(?!0$)\d{1,3}"
_MULTISCALES = 'a multiscale image of OME-Zarr, or one array; name="KEY" names an array'


class _Level(NamedTuple):
    """A level of a multiscale image, by what its group says of it."""

    group: Path
    attributes: dict[str, Any]  # of the group
    image: dict[str, Any]
    number: int

    @property
    def dataset(self) -> dict[str, Any]:
        dataset: dict[str, Any] = self.image["datasets"][self.number]
        return dataset


def is_zarr(path: Path) -> bool:
    """Whether a folder is an array or a group of Zarr."""
    return any((path / name).is_file() for name in ZARR_FILES)


def is_n5(path: Path) -> bool:
    """Whether a folder is a dataset or a group of N5."""
    return (path / N5_FILE).is_file() and not is_zarr(path)


def open_zarr(
    path: Path, name: str | None, axes: str = "zyx", time: int | None = None
) -> tuple[ChunkedSource, int | None]:
    """The samples of a Zarr folder: a named array, the only array, or the finest level of a multiscale image.

    A named array, and one that is opened by its own path, has the place that an image in a group above it tells.

    Also returns the number of its time steps, or None for a volume.
    """
    node = load("load_node", path, "zarr", key=name or "")
    attributes = node["attributes"]
    if "isospline" in attributes and "ome" not in attributes:
        if "time_steps" in attributes["isospline"]:
            steps = "give a list of its steps, isospline.store.time_steps(path), or one of them"
            raise ValueError(f"{printable(path)}: expected a volume, got the store of a time series: {steps}")
        raise ValueError(f"{printable(path)}: expected samples, got a store without them: open it with open_volume")
    level = None
    if "shape" in node:
        level = _level_of(path / (name or ""), len(node["shape"]))
        told = attributes if level is None or _is_transformed(attributes) else level.dataset
        if level is None or _is_transformed(told):
            source = ChunkedSource(path, "zarr", name or "", ORDERS[axes])
            return _move_by_transform(source, told["transform"]) if _is_transformed(told) else source, None
        attributes = level.attributes
    image = next(iter(_multiscales(attributes)), None) if level is None else level.image
    if image is None:
        keys = node["arrays"]
        if len(keys) != 1:
            raise ValueError(f"{printable(path)}: expected {_MULTISCALES}, got arrays {', '.join(keys) or 'none'}")
        return ChunkedSource(path, "zarr", f"{name}/{keys[0]}" if name else keys[0], ORDERS[axes]), None
    if axes != "zyx":
        raise ValueError(f'axes: expected "zyx" for an image that names its axes, got "{axes}"')
    source, steps = _open_multiscale(path, name, image, time, level)
    if "isospline" in attributes:  # a store tells its directions, and lengths of these, which OME-Zarr cannot
        store = read_metadata(path / (name or "") if level is None else level.group)
        scale = store.scales[0 if level is None else level.number]
        source.move(spacing=scale.spacing, origin=scale.origin, direction=scale.direction, patient=store.patient)
    return source, steps


def _multiscales(attributes):
    """The multiscale images in a group's attributes, of OME-Zarr 0.5 or an earlier version."""
    of_ome = attributes.get("ome", attributes)
    images = of_ome.get("multiscales") if isinstance(of_ome, dict) else None
    return [image for image in images if isinstance(image, dict)] if isinstance(images, list) else []


def _levels(image):
    """The levels of an image, as objects of which each has a path."""
    datasets = image.get("datasets")
    return datasets if isinstance(datasets, list) and all(isinstance(each, dict) for each in datasets) else []


def _level_of(array, dimension):
    """The level of an image that an array is, by the groups of Zarr above it; None if none of them lists it."""
    array = Path(os.path.abspath(array))
    for group in array.parents:
        if not is_zarr(group):
            break
        attributes, key = load("load_node", group, "zarr", key="")["attributes"], array.relative_to(group).as_posix()
        for image in _multiscales(attributes):
            for number, dataset in enumerate(_levels(image)):
                # Images without axes are of five dimensions, or of another program.
                if dataset.get("path") == key and ("axes" in image or dimension == 5 or _is_transformed(dataset)):
                    return _Level(group, attributes, image, number)
    return None


def _open_multiscale(path, name, image, time, level=None):
    """The finest level of an image, or the given one, which the path and the name tell then."""
    try:
        axes = [axis if isinstance(axis, dict) else {"name": axis} for axis in image.get("axes", list("tczyx"))]
        names = [str(axis["name"]) for axis in axes]
        datasets = image["datasets"] if level is None else [level.dataset]
        scales = [_transformation(dataset, image, len(axes)) for dataset in datasets]
        finest = min(range(len(scales)), key=lambda number: np.prod([scales[number][0][names.index(n)] for n in "zyx"]))
        key, (scale, translation) = datasets[finest]["path"], scales[finest]
        space = [names.index(axis) for axis in "zyx"]
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ValueError(f"{printable(path)}: expected multiscales with axes z, y and x, got {error}") from error
    if level is None:
        key = f"{name}/{key}" if name else key
    else:
        key = name or ""
    shape = load("load_node", path, "zarr", key=key)["shape"]
    if len(shape) != len(names):
        raise ValueError(f"{printable(path)}: expected an array with axes {', '.join(names)}, got shape {tuple(shape)}")
    others = {axis: 0 for axis in range(len(names)) if axis not in space}
    steps = None
    for axis in others:
        if names[axis] == "t" and shape[axis] > 1:
            steps = shape[axis]
            others[axis] = time or 0
        elif shape[axis] != 1:
            raise ValueError(f"{printable(path)}: expected one item along {names[axis]}, got {shape[axis]}")
    source = ChunkedSource(path, "zarr", key, space, others)
    unit = one_unit([axes[axis].get("unit") for axis in space])
    origin = np.array([float(translation[axis]) for axis in reversed(space)])
    spacing = tuple(float(scale[axis]) for axis in reversed(space))
    source.move(spacing=spacing, origin=tuple(origin.tolist()), unit=unit)
    direction = ome.direction_of([axes[axis] for axis in reversed(space)])
    if direction is not None:
        # A patient's world is in millimetres.
        source.move(direction=direction, origin=tuple((direction @ origin).tolist()), patient=unit == "millimeter")
    return source, steps


def _transformation(dataset, image, dimension):
    """Scale and translation of a level: its own, followed by those of the whole image."""
    scale, translation = np.ones(dimension), np.zeros(dimension)
    for step in (*dataset.get("coordinateTransformations", ()), *image.get("coordinateTransformations", ())):
        if step.get("type", "identity") not in _STEPS or "path" in step:
            told = "one in a file" if "path" in step else step.get("type")
            raise ValueError(f"a transformation that is none of {', '.join(_STEPS)}: {told}")
        factor = np.asarray(step.get("scale", np.ones(dimension)), float)
        scale, translation = scale * factor, translation * factor
        translation = translation + np.asarray(step.get("translation", np.zeros(dimension)), float)
    if scale.shape != (dimension,) or not (np.isfinite(scale).all() and (scale > 0).all()):
        raise ValueError(f"scale {scale.tolist()}")
    return scale, translation


def open_n5(path: Path, name: str | None) -> ChunkedSource:
    """A dataset of N5, or the finest level, s0, of a multiscale one."""
    key = name or ""
    attributes = read_json(path / key / N5_FILE)
    if "dimensions" in attributes:
        group = read_json(Path(os.path.abspath(path / key)).parent / N5_FILE)
    else:
        group = attributes
        key = f"{key}/s0".lstrip("/")
        attributes = read_json(path / key / N5_FILE)
    if "dimensions" not in attributes:
        raise ValueError(f'{printable(path)}: expected a dataset of N5, or a group of levels s0, s1, ...; name="KEY"')
    source = ChunkedSource(path, "n5", key, (2, 1, 0))  # its axes are x, y, z
    level = os.path.basename(os.path.abspath(path / key))
    told = _told_of_level(group, level, attributes)
    if "resolution" in attributes:
        told.pop("pixelResolution", None)
    found = {**told, **attributes}
    if _is_transformed(found):
        return _move_by_transform(source, found["transform"])
    # n5-ij and BigDataViewer write pixelResolution, or resolution and units, and Paintera an offset, all x first.
    pixel = found.get("pixelResolution")
    spacing: Any = pixel.get("dimensions") if isinstance(pixel, dict) else pixel or found.get("resolution")
    if spacing is None and any(each in group for each in _SPACINGS) and re.fullmatch(_COARSE, level):
        text = f"the group has no downsamplingFactors of {level}: a spacing of 1 is assumed; say spacing=(x, y, z)"
        warn_of_place(path, {"of_spacing": text})
    units: Any = pixel.get("unit") if isinstance(pixel, dict) else found.get("units")
    unit = one_unit([ome.name_of_unit(each) for each in ([units] if isinstance(units, str) else units or ())])
    factors = _three(found.get("downsamplingFactors", 1), "downsamplingFactors")
    full = _three(1 if spacing is None else spacing, "resolution")
    # A sample of a coarse level is in the middle of those that it averages, as in n5-viewer.
    origin = _three(found.get("offset", 0), "offset") + (factors - 1) / 2 * full
    _moved(source, full * factors, origin, unit or None)
    return _transformed(source, found["affineTransform"]) if "affineTransform" in found else source


def _told_of_level(group, name, attributes):
    """What a group tells of its level with this name, which has these attributes; empty for other datasets."""
    if transform := _transforms_by_level(group).get(name):
        return transform
    level = re.fullmatch(r"s(\d{1,3})", name)
    if level is None or "dimensions" in group:
        return {}
    number, factors = int(level[1]), group.get("scales", group.get("downsamplingFactors"))
    told = {each: value for each, value in group.items() if each != "downsamplingFactors"}
    if number == 0:
        return told
    told = {each: told[each] for each in _OF_ALL_LEVELS if each in told}
    if isinstance(factors, list) and number < len(factors) and isinstance(factors[number], list):
        return {**told, "downsamplingFactors": factors[number]}
    # Without factors, nobody knows what the group's distances are at this level.
    return told if "downsamplingFactors" in attributes else {}


def _transformed(source, affine):
    """Apply the affine transform of n5-viewer, 3 x 4 numbers, to the place of samples."""
    try:
        matrix = np.array(affine, float)
    except (TypeError, ValueError):
        matrix = np.empty(0)
    if matrix.shape != (3, 4) or not np.isfinite(matrix).all() or np.linalg.matrix_rank(matrix[:, :3]) < 3:
        raise ValueError(f"expected affineTransform to be 3 x 4 numbers of an invertible matrix, got {affine}")
    steps, origin = matrix[:, :3] * np.array(source.spacing), matrix @ (*source.origin, 1.0)
    place = VolumeData.from_affine(np.empty((0, 0, 0)), np.column_stack([steps, origin]))
    return source.move(spacing=place.spacing, origin=place.origin, direction=place.direction)


def _transforms_by_level(group):
    """The transforms of a group's levels in COSEM's metadata, by the name of the level."""
    levels = [each for image in _multiscales(group)[:1] for each in _levels(image) if "transform" in each]
    return {str(each.get("path")): {"transform": each["transform"]} for each in levels}


def _is_transformed(attributes):
    """Whether attributes have a transform of COSEM: those of other programs have the same name."""
    return isinstance(attributes.get("transform"), dict) and "axes" in attributes["transform"]


def _move_by_transform(source, transform):
    """Place samples by a transform of COSEM: axes in any order, and for each of them scale, translate and units."""
    try:
        places = [list(transform["axes"]).index(axis) for axis in "xyz"]
        scale, translation, units = (
            [transform[name][place] for place in places] for name in ("scale", "translate", "units")
        )
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise ValueError(
            f"expected a transform with axes x, y and z, scale, translate and units, got {error}"
        ) from error
    unit = one_unit([ome.name_of_unit(each) for each in units])
    return _moved(source, _three(scale, "scale"), _three(translation, "translate"), unit or None)


def _moved(source, spacing, origin, unit):
    if not (spacing > 0).all():
        raise ValueError(f"expected positive distances of samples, got {spacing.tolist()}")
    return source.move(spacing=tuple(spacing.tolist()), origin=tuple(origin.tolist()), unit=unit)


def _three(values, name):
    """Three finite numbers, of as many or of one for all axes."""
    array = np.array(values, float) if np.ndim(values) else np.full(3, values, float)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise ValueError(f"expected three finite numbers as {name}, got {array.tolist()}")
    return array
