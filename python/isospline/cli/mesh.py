"""The command `mesh`: its options, and the mesh that they ask for."""

from __future__ import annotations

from ..interop.mesh_output import MESHES
from ..interop.mesh_parts import is_written_in_parts, write_stl_in_parts
from ..interop.three_mf import unit_for
from ..picture.sequences import check_folder
from .write import writing


def add_mesh_options(group):
    """Add the options of the mesh."""
    group.add_argument(
        "--tolerance",
        type=float,
        metavar="DISTANCE",
        help="largest distance between surface and mesh, world units; by default a vertex on each edge that it crosses",
    )
    group.add_argument("--faces", type=int, metavar="N", help="largest number of triangles, in place of --tolerance")
    group.add_argument(
        "--for-print",
        action="store_true",
        help="for 3D printers: close the solid at the border of the volume, keep only its largest piece, fill its "
        "cavities, and check that the mesh is watertight",
    )


def check_mesh_options(arguments):
    """Check before the work begins that options agree and the output can be written; complete those for printing."""
    if not arguments.output.lower().endswith(MESHES):
        raise ValueError(f"{arguments.output}: expected a name that ends in {', '.join(MESHES)}")
    check_folder(arguments.output)
    if len(arguments.level or ()) > 1:
        raise ValueError(f"--level: expected one level for a mesh, got {len(arguments.level)}: write a mesh for each")
    if not arguments.for_print:
        return
    if arguments.largest not in (None, 1):
        raise ValueError(f"--largest: expected 1 or nothing with --for-print, got {arguments.largest}")
    if (arguments.clip or arguments.clip_box) and not arguments.capped:
        raise ValueError("--for-print: expected --capped with --clip and --clip-box, got none")
    arguments.closed = True


def write_mesh(surface, arguments, progress):
    """Write the mesh of a surface that the options ask for; returns what is said about it."""
    if arguments.for_print:
        made, report = surface.to_print_mesh(arguments.tolerance, faces=arguments.faces, progress=progress)
        said, distance = str(report), report.get("distance")
    elif is_written_in_parts(surface, arguments.output, arguments.tolerance, arguments.faces):
        with writing():
            return f"{write_stl_in_parts(surface, arguments.output, progress):,} faces, written in parts"
    elif arguments.tolerance is None and arguments.faces is None:
        made, distance = surface.to_mesh(progress=progress), None
        said = repr(made)
    else:
        made, distance = surface.to_mesh(
            arguments.tolerance, faces=arguments.faces, return_distance=True, progress=progress
        )
        said = repr(made)
    unit = unit_for(arguments.output, surface.volume)
    with writing():
        made.write(arguments.output, unit=unit)
    return said if distance is None else f"{said}, at most {distance:.3g} from the surface"
