"""The command `isospline compare`: how far the surface of a volume is from a mesh or another volume's surface."""

from __future__ import annotations

import argparse
import json

import numpy as np

import isospline

from ..base.views import SIZE
from ..interop.mesh_topology import equal_rows
from ..picture.sequences import check_folder
from ..scene.mesh_files import MESH_SUFFIXES
from ..store.detail import is_store
from .given import MODEL, READING, keywords, refuse_without
from .levels import choose_levels, make_surfaces
from .store import opened
from .summary import unit_power
from .units import unit_transform
from .write import writing

#: The parts of the area of `SurfaceDistance.quantiles`, in percent.
QUANTILES = (50, 95, 99)


def add_compare(commands, compare, add_input, add_model, types):
    """The command and its options."""
    command = commands.add_parser(
        "compare", help="print the distances of an isosurface from a mesh or another isosurface, and show them"
    )
    command.set_defaults(run=compare)
    add_input(command)
    command.add_argument("other", metavar="OTHER", help="a mesh (by its suffix), or another volume or store")
    command.add_argument("-o", "--output", metavar="OUT", help="picture of the distances to write: .png")
    command.add_argument("--table", metavar="OUT", help="table of points and distances to write: .csv")
    command.add_argument("--json", action="store_true", help="print JSON")
    command.add_argument("-q", "--quiet", action="store_true", help="show no progress")
    group = command.add_argument_group("surfaces")
    group.add_argument("-l", "--level", type=float, action="append", help="of FILE; by default the suggested one")
    group.add_argument("--other-level", type=float, metavar="LEVEL", help="of OTHER; by default the suggested one")
    add_model(group)
    group = command.add_argument_group("distances")
    group.add_argument(
        "--unsigned", action="store_true", help="for a mesh that is not closed: no distance is negative, as inside"
    )
    group.add_argument("--samples", type=types.count, default=10000, metavar="N", help="points (default 10000)")
    group.add_argument("--tolerance", type=float, metavar="T", help="of the bounds on the largest distance")
    group.add_argument(
        "--limits", type=types.numbers(2), metavar="A,B", help="distances of the first and the last colour"
    )
    group.add_argument("--size", type=types.size, metavar="WxH", help="in pixels (default 640x480)")


def run(arguments, read, progress, say, unicode):
    """Print the distances, and write what is asked for."""
    for path, suffix in ((arguments.output, ".png"), (arguments.table, ".csv")):
        if path is not None and not path.lower().endswith(suffix):
            raise ValueError(f"{path}: expected a name that ends in {suffix}")
        if path is not None:
            check_folder(path)
    if arguments.output is None:
        refuse_without(arguments, ("limits", "size"), "--output")
    if len(arguments.level or ()) > 1:
        raise ValueError(f"--level: expected one level to compare, got {len(arguments.level)}")
    is_mesh = arguments.other.lower().endswith(MESH_SUFFIXES)
    if is_mesh and arguments.other_level is not None:
        raise ValueError(f"--other-level: expected a volume to compare with, got the mesh {arguments.other}")
    with progress("comparing", arguments):
        surface = _surface(arguments, read, say)
        other = isospline.read_mesh(arguments.other) if is_mesh else _other_surface(arguments, read, say)
        if is_mesh and not arguments.unsigned and not is_closed(other):
            say(f"{arguments.other} is not closed, so signs of distances may be wrong; --unsigned leaves them out")
        scale = unit_transform(surface.volume.unit, arguments, say, other, arguments.other)
        other = other if scale is None else isospline.Scene([(other, scale)])
        found = isospline.surface_distance(
            surface, other, samples=arguments.samples, tolerance=arguments.tolerance, signed=not arguments.unsigned
        )
        if arguments.table:
            with writing():
                found.to_csv(arguments.table)
        if arguments.output:
            _write_picture(arguments, surface, other, found)
    print(_as_json(arguments, surface, found) if arguments.json else _as_text(arguments, surface, found, unicode))


def is_closed(mesh):
    """Whether each edge of a mesh, of whose vertices those at one place are one, belongs to faces on both sides."""
    places = equal_rows(mesh.vertices)[1]
    faces = places[mesh.faces]
    begins, ends = faces.reshape(-1), np.roll(faces, -1, axis=1).reshape(-1)
    there, back = begins * len(places) + ends, ends * len(places) + begins
    return np.array_equal(np.sort(there), np.sort(back))


def _surface(arguments, read, say):
    data = opened(arguments, read)
    chosen = choose_levels(data, arguments, say)
    (surface,) = make_surfaces(data.to_volume(**keywords(arguments, MODEL)), chosen, arguments, {}, say)
    return surface


def _other_surface(arguments, read, say):
    """The surface of OTHER, with the same options except those of the level and, but for NaN, of reading."""
    level = None if arguments.other_level is None else [arguments.other_level]
    options = {name: getattr(arguments, name) for name in (*MODEL, "inside", "largest")}
    options |= dict.fromkeys(READING) | {"big_endian": False}
    if not is_store(arguments.other):
        options["nan"] = arguments.nan
    other = argparse.Namespace(file=arguments.other, level=level, **options)
    return _surface(other, read, lambda text: say(f"{arguments.other}: {text}"))


def _write_picture(arguments, surface, other, found):
    most = float(found.quantiles[-1]) or 1.0
    limits = arguments.limits or ((0.0 if arguments.unsigned else -most), most)
    rule = isospline.ColorByDistance(other, limits=limits, signed=not arguments.unsigned)
    image = isospline.render(
        surface,
        color=rule,
        size=arguments.size or SIZE,
        light=isospline.Studio(fast=True),
        annotate=True,
        legend=False,
    )
    with writing():
        image.write(arguments.output)


def _as_json(arguments, surface, found):
    numbers = {name: {"value": found[name].value, "error": found[name].error} for name in ("mean", "rms")}
    quantiles = {f"{part}%": value for part, value in zip(QUANTILES, found.quantiles.tolist())}
    about = {"path": str(arguments.file), "other": str(arguments.other), "level": surface.level}
    return json.dumps(
        {**about, "unit": surface.volume.unit, **numbers, "quantiles": quantiles, "maximum": list(found.maximum)},
        indent=2,
    )


def _as_text(arguments, surface, found, unicode):
    unit = unit_power(surface.volume.unit, 1, unicode)
    lines = [f"{arguments.file} from {arguments.other}", f"  {'level':<20} {surface.level:.6g}"]
    for title, each in (("mean", found.mean), ("root mean square", found.rms)):
        lines.append(f"  {title:<20} {each.value:<14.6g} +- {each.error:<8.2g} {unit}".rstrip())
    for part, value in zip(QUANTILES, found.quantiles):
        lines.append(f"  {f'{part}% are within':<20} {value:<14.6g} {unit}".rstrip())
    lower, upper = found.maximum
    lines.append(f"  {'largest':<20} {lower:.6g} to {upper:.6g} {unit}".rstrip())
    return "\n".join(lines)
