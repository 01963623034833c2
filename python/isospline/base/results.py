"""Results of queries: mappings from names to arrays whose items are also attributes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .handed import handed
from .measurement import Measurement, measurement_of
from .signatures import explained_methods
from .tables import Result, Table
from .tables import item as _item

__all__ = [
    "ClosestPoints",
    "Components",
    "Crossings",
    "Hits",
    "HopStatistics",
    "LabelComparison",
    "LabelMeasures",
    "LabelTable",
    "LeftOut",
    "LevelMeasures",
    "Measurement",
    "MeshReport",
    "Paging",
    "PrintReport",
    "SurfaceDistance",
    "SurfaceSamples",
    "Visibility",
    "measurement_of",
]

_XYZ = ("x", "y", "z")
_MATRIX = tuple(f"{row}_{column}" for row in _XYZ for column in _XYZ)
_PROVEN = "a tolerance or faces of to_print_mesh"
_CORNERS = tuple(f"{corner}_{axis}" for corner in ("lower", "upper") for axis in _XYZ)


@handed
@explained_methods
class Hits(Table):
    """The first crossings of rays, as `Scene.cast_rays` returns them: ``hits.t_hit`` is ``hits["t_hit"]``.

    It has the arrays named by `outputs`; the leading axes are those of the rays. The type of real numbers is that of
    the rays, float32 or float64, unless `dtype` is given.
    """

    t_hit: NDArray[Any] = _item("t_hit", "(...) t of the crossing, inf if the ray misses.")
    geometry_ids: NDArray[np.uint32] = _item("geometry_ids", "(...) uint32, `INVALID_ID` if the ray misses.")
    primitive_ids: NDArray[np.uint64] = _item(
        "primitive_ids", "(...) uint64: the place of the cell in its volume or the face of a mesh."
    )
    primitive_normals: NDArray[Any] = _item(
        "primitive_normals", "(..., 3) unit outward normals in world space, zero if the ray misses.", _XYZ
    )
    positions: NDArray[Any] = _item("positions", "(..., 3) points in world space, NaN if the ray misses.", _XYZ)
    primitive_uvs: NDArray[np.float32] = _item(
        "primitive_uvs", "(..., 2) float32, weights of a triangle's second and third corner.", ("u", "v")
    )
    gradient_magnitudes: NDArray[Any] = _item(
        "gradient_magnitudes", "(...) for an isosurface's model, in values per world unit; 0 for meshes."
    )
    dt_dlevel: NDArray[Any] = _item("dt_dlevel", "(...) of t by the level; 0 for meshes and caps.")
    dt_dorigin: NDArray[Any] = _item("dt_dorigin", "(..., 3) of t by the ray's origin.", _XYZ)
    dt_ddirection: NDArray[Any] = _item("dt_ddirection", "(..., 3) of t by the ray's direction.", _XYZ)
    grazing: NDArray[np.bool_] = _item("grazing", "(...) bool: rays whose derivatives are not given, but zero.")
    dnormal_dlevel: NDArray[Any] = _item("dnormal_dlevel", "(..., 3) of the normal by the level.", _XYZ)
    dnormal_dorigin: NDArray[Any] = _item(
        "dnormal_dorigin", "(..., 3, 3) of the normal's coordinates by those of the origin.", _MATRIX
    )
    dnormal_ddirection: NDArray[Any] = _item(
        "dnormal_ddirection", "(..., 3, 3) of the normal's coordinates by those of the direction.", _MATRIX
    )
    coefficient_indices: NDArray[np.int64] = _item(
        "coefficient_indices", "(..., (n+1)^3) int64: places in ``volume.coefficients.ravel('K')``.", is_list=True
    )
    coefficient_weights: NDArray[Any] = _item(
        "coefficient_weights", "(..., (n+1)^3) weights of these coefficients in f at the hit.", is_list=True
    )
    coefficient_gradients: NDArray[Any] = _item(
        "coefficient_gradients", "(..., (n+1)^3, 3) gradients of these weights by the position.", _XYZ, is_list=True
    )
    statuses: NDArray[np.uint8] = _item(
        "statuses",
        "(...) uint8, what is proven of the ray: 0 for a miss, 1 for a hit, 2 if undecided.",
        option="certify=True",
    )
    t_bounds: NDArray[np.float64] = _item(
        "t_bounds",
        "(..., 2) float64, proven bounds of the first crossing's t: both inf for a miss; upper one inf if undecided.",
        ("lower", "upper"),
        option="certify=True",
    )
    level_bounds: NDArray[np.float64] = _item(
        "level_bounds",
        "(...) float64: an undecided ray is at most this far from the level, in values, at its lower t bound; else 0.",
        option="certify=True",
    )
    normal_axes: NDArray[np.float64] = _item(
        "normal_axes",
        "(..., 3) float64, unit axes of proven cones around the outward normals of hits; zero if nothing is known.",
        _XYZ,
        option="certify=True",
    )
    normal_angles: NDArray[np.float64] = _item(
        "normal_angles",
        "(...) float64: no outward normal of a hit is farther from the axis, in radians; NaN if the ray misses.",
        option="certify=True",
    )
    model_distances: NDArray[np.float64] = _item(
        "model_distances",
        "(...) float64, proven bounds of the distance from the hit to the surface of the unrounded coefficients.",
        option="certify=True",
    )

    def select(self, rays: NDArray[Any]) -> Hits:
        """The hits of some of the rays.

        Parameters
        ----------
        rays : bool or int array
            The rays: any index of the leading axes, such as ``np.isfinite(hits.t_hit)``.

        Returns
        -------
        Hits
        """
        return Hits({name: array[rays] for name, array in self.items()})


@handed
class Crossings(Table):
    """All crossings of rays, as `Scene.list_intersections` returns them: those of ray i are the items from
    ``ray_splits[i]`` to ``ray_splits[i + 1]``.
    """

    ray_splits: NDArray[np.int64] = _item(
        "ray_splits", "(N + 1,) int64: where the crossings of each ray begin.", is_column=False
    )
    ray_ids: NDArray[np.int64] = _item("ray_ids", "(M,) int64: the ray of each crossing.")
    t_hit: NDArray[np.float64] = _item("t_hit", "(M,) float64, ascending along each ray.")
    geometry_ids: NDArray[np.uint32] = _item("geometry_ids", "(M,) uint32.")
    primitive_ids: NDArray[np.uint64] = _item("primitive_ids", "(M,) uint64, as in `Hits`.")
    primitive_uvs: NDArray[np.float32] = _item("primitive_uvs", "(M, 2) float32, as in `Hits`.", ("u", "v"))
    primitive_normals: NDArray[np.float64] = _item("primitive_normals", "(M, 3) float64: unit, outward, world.", _XYZ)
    positions: NDArray[np.float64] = _item("positions", "(M, 3) float64, world space.", _XYZ)
    entering: NDArray[np.bool_] = _item("entering", "(M,) bool: whether the ray enters the solid there.")


@handed
class ClosestPoints(Table):
    """The nearest points of surfaces, as `Isosurface.closest_points` and `Scene.closest_points` return them.

    Only those of scenes have geometry ids and uvs.
    """

    points: NDArray[np.float64] = _item("points", "(..., 3) float64, world space; NaN if there is none.", _XYZ)
    distances: NDArray[np.float64] = _item("distances", "(...) float64, world units.")
    error_bounds: NDArray[np.float64] = _item(
        "error_bounds", "(...) float64: the true distance is smaller by at most this, world units; 0 on meshes."
    )
    geometry_ids: NDArray[np.uint32] = _item("geometry_ids", "(...) uint32; `INVALID_ID` if there is none.")
    primitive_ids: NDArray[np.uint64] = _item("primitive_ids", "(...) uint64, as in `Hits`.")
    primitive_uvs: NDArray[np.float64] = _item(
        "primitive_uvs",
        "(..., 2) float64, weights of a triangle's second and third corner; 0 on isosurfaces.",
        ("u", "v"),
    )
    primitive_normals: NDArray[np.float64] = _item("primitive_normals", "(..., 3) float64: unit, outward, world.", _XYZ)


@handed
class SurfaceSamples(Table):
    """Random points of a surface, uniform by area, as `Isosurface.sample_points` returns them."""

    points: NDArray[np.float64] = _item("points", "(N, 3) float64, world space.", _XYZ)
    primitive_ids: NDArray[np.uint64] = _item("primitive_ids", "(N,) uint64, as in `Hits`.")
    primitive_normals: NDArray[np.float64] = _item("primitive_normals", "(N, 3) float64: unit, outward, world.", _XYZ)


@handed
class Components(Table):
    """The connected components of a solid, as `Isosurface.components` returns them: the largest first.

    Volumes, areas and their errors exist only if they were measured, by ``components(measured=True)``.
    """

    enclosed_volumes: NDArray[np.float64] = _item(
        "enclosed_volumes", "(N,) float64, world units cubed.", option="measured=True"
    )
    volume_errors: NDArray[np.float64] = _item(
        "volume_errors", "(N,) float64: estimated errors of `enclosed_volumes`.", option="measured=True"
    )
    areas: NDArray[np.float64] = _item(
        "areas", "(N,) float64, world units squared: including the surfaces of cavities.", option="measured=True"
    )
    area_errors: NDArray[np.float64] = _item(
        "area_errors", "(N,) float64: estimated errors of `areas`.", option="measured=True"
    )
    bounds: NDArray[np.float64] = _item(
        "bounds",
        "(N, 2, 3) float64, world units: lower and upper corner of the box of each component's cells, within the clip.",
        _CORNERS,
    )
    cell_counts: NDArray[np.int64] = _item(
        "cell_counts", "(N,) int64: number of cells that contain a part of each component."
    )
    inside_counts: NDArray[np.int64] = _item(
        "inside_counts",
        "(N,) int64: number of cells that are completely in each component, by their Bernstein coefficients.",
    )


class LabelTable(Table):
    """The labels of a map, as `Labels.table` returns them."""

    numbers: NDArray[np.int64] = _item("numbers", "(N,) int64: numbers of labels.")
    names: NDArray[np.str_] = _item("names", "(N,) str: names of labels.")
    voxel_counts: NDArray[np.int64] = _item("voxel_counts", "(N,) int64: numbers of voxels.")


class LabelMeasures(LabelTable):
    """The measures of labels and their smooth surfaces, as `Labels.measure` returns them."""

    enclosed_volumes: NDArray[np.float64] = _item("enclosed_volumes", "(N,) float64, world units cubed: of surfaces.")
    volume_errors: NDArray[np.float64] = _item("volume_errors", "(N,) float64: estimated errors of the integrals.")
    areas: NDArray[np.float64] = _item("areas", "(N,) float64, world units squared.")
    area_errors: NDArray[np.float64] = _item("area_errors", "(N,) float64: estimated errors of the integrals.")
    centroids: NDArray[np.float64] = _item("centroids", "(N, 3) float64, world units: centroids of the voxels.", _XYZ)


class LabelComparison(Table):
    """How the labels of two maps differ, as `Labels.compare` returns it. Distances are those of smooth surfaces."""

    numbers: NDArray[np.int64] = _item("numbers", "(N,) int64: numbers of labels, of the first map if it has them.")
    names: NDArray[np.str_] = _item("names", "(N,) str: their names.")
    dice: NDArray[np.float64] = _item("dice", "(N,) float64: Dice coefficients of the voxels, from 0 to 1.")
    hausdorff_lower: NDArray[np.float64] = _item(
        "hausdorff_lower", "(N,) float64, world units: lower bounds on Hausdorff distances."
    )
    hausdorff_upper: NDArray[np.float64] = _item(
        "hausdorff_upper", "(N,) float64, world units: upper bounds on Hausdorff distances."
    )
    mean_distances: NDArray[np.float64] = _item(
        "mean_distances", "(N,) float64, world units: mean distance of both surfaces' points from the other surface."
    )
    mean_errors: NDArray[np.float64] = _item(
        "mean_errors", "(N,) float64, world units: standard errors of `mean_distances`."
    )


@handed
class LeftOut(Table):
    """Parts of a surface that a mesh leaves out, in `MeshReport`."""

    positions: NDArray[np.float64] = _item("positions", "(N, 3) float64: centres of boxes, world units.", _XYZ)
    sizes: NDArray[np.float64] = _item(
        "sizes", "(N, 3) float64: edges of these boxes along the volume's axes, world units.", _XYZ
    )
    distances: NDArray[np.float64] = _item(
        "distances", "(N,) float64: bounds on their distances from the mesh, world units."
    )


@handed
class MeshReport(Result):
    """What is proven of a mesh, as ``Isosurface.to_mesh(tolerance, return_report=True)`` returns it."""

    distance: float = _item("distance", "Bound on the distance of surface and mesh, world units.")
    left_out: LeftOut = _item("left_out", "The parts of the surface that are left out.")
    self_intersections: int = _item("self_intersections", "Number of pairs of faces that cross.")
    missing_volume: float = _item(
        "missing_volume", "The surface's enclosed volume less that of the mesh, estimated, world units cubed."
    )


class LevelMeasures(Table):
    """The measures of surfaces at several levels, as `isospline.measure` returns them."""

    levels: NDArray[np.float64] = _item("levels", "(N,) float64: as given.")
    enclosed_volumes: NDArray[np.float64] = _item("enclosed_volumes", "(N,) float64, world units cubed.")
    volume_errors: NDArray[np.float64] = _item("volume_errors", "(N,) float64: estimated errors of the integrals.")
    areas: NDArray[np.float64] = _item("areas", "(N,) float64, world units squared, with caps.")
    area_errors: NDArray[np.float64] = _item("area_errors", "(N,) float64: estimated errors of the integrals.")


class PrintReport(Result):
    """What was done for a mesh that can be printed, as `Isosurface.to_print_mesh` returns it. ``str`` is a sentence."""

    pieces: int = _item("pieces", "Number of connected components of the solid, of which the largest is kept.")
    cavities: int = _item("cavities", "Number of cavities that were filled.")
    closed_at_border: bool = _item("closed_at_border", "Whether the piece reaches the volume's border, and ends there.")
    faces: int = _item("faces", "Number of triangles.")
    watertight: bool = _item(
        "watertight", "True; False if the mesh touches itself, which is not watertight in formats without indices."
    )
    distance: float = _item("distance", "As in `MeshReport`, before cavities were filled.", option=_PROVEN)
    left_out: LeftOut = _item("left_out", "As in `MeshReport`.", option=_PROVEN)
    self_intersections: int = _item(
        "self_intersections", "As in `MeshReport`, before cavities were filled.", option=_PROVEN
    )
    missing_volume: float = _item(
        "missing_volume", "As in `MeshReport`, of all pieces, before cavities were filled.", option=_PROVEN
    )

    def __str__(self) -> str:
        parts = ["closed at the border"] if self.closed_at_border else []
        parts.append(f"kept 1 of {self.pieces:,} pieces" if self.pieces > 1 else "1 piece")
        if self.cavities:
            parts.append(f"filled {self.cavities:,} {'cavity' if self.cavities == 1 else 'cavities'}")
        parts += [
            f"{self.faces:,} faces",
            "watertight" if self.watertight else "watertight except where it touches itself",
        ]
        if "self_intersections" in self:
            count = self.self_intersections
            parts.append(f"{count:,} pairs of faces cross" if count else "no faces cross")
        return ", ".join(parts)


class SurfaceDistance(Table):
    """One-sided distances of one surface from another: the result of `surface_distance`.

    As a table, it has a row for each point.
    """

    mean: Measurement = _item(
        "mean",
        "Measurement, world units: over the area of the surface, with the standard error of the sampling; of signed "
        "distances, if they are.",
        is_column=False,
    )
    rms: Measurement = _item("rms", "Measurement, world units: the root mean square.", is_column=False)
    quantiles: NDArray[np.float64] = _item(
        "quantiles",
        "(3,) float64, world units: the distances, without sign, that 50, 95 and 99% of the area are within.",
        is_column=False,
    )
    maximum: tuple[float, float] = _item(
        "maximum",
        "A lower and an upper bound on the largest distance, world units: the one-sided Hausdorff distance.",
        is_column=False,
    )
    points: NDArray[np.float64] = _item("points", "(N, 3) float64, world units: points, uniform by area.", _XYZ)
    distances: NDArray[np.float64] = _item(
        "distances", "(N,) float64, world units: their distances; if signed, negative inside of the other surface."
    )


@handed
class Visibility(Result):
    """Which rays see an object of a scene, as `Scene.visibility` returns it."""

    visible: bool = _item("visible", "Whether cameras and all ray queries except `test_occlusions` see it.")
    casts_shadow: bool = _item("casts_shadow", "Whether `test_occlusions`, shadow rays and reflections see it.")


@handed
class Paging(Result):
    """What a volume of a store has read since it was opened, as `Volume.paging` is."""

    folder: str = _item("folder", "The folder of its array.")
    memory_limit: int = _item("memory_limit", "Bytes that it may keep.")
    memory: int = _item("memory", "Bytes that it keeps.")
    bytes_read: int = _item("bytes_read", "Bytes read from disk.")
    chunks_read: int = _item("chunks_read", "Chunks read from disk.")
    bricks_made: int = _item("bricks_made", "Bricks made from chunks.")
    bricks_dropped: int = _item("bricks_dropped", "Bricks that were dropped for others.")


@handed
class HopStatistics(Result):
    """What the rays of a `research.VoxelHopper` did."""

    hops: int = _item("hops", "Steps from one voxel to the next.")
    strides: int = _item("strides", "Steps across empty bricks.")
    evaluated_cells: int = _item("evaluated_cells", "Cells in which the surface was searched.")
    mean_hop_length: float = _item("mean_hop_length", "Of hops and strides, in voxels, or 0 without any.")
