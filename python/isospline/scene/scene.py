"""Scenes of isosurfaces and meshes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from copy import deepcopy
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, SupportsIndex

import numpy as np

from ..base.shown import Shown
from ..certificates import certificate
from .conversions import as_object, as_placed_objects
from .isosurface import Isosurface
from .mesh import Mesh
from .point_queries import PointQueries
from .public import attributes_of, public, with_attributes
from .ray_queries import RayQueries

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from ..base.results import Visibility
    from ..base.types import Placeable, Progress


@public
class Scene(RayQueries, PointQueries, Shown):
    """Isosurfaces and triangle meshes in Embree, for ray queries and pictures.

    Ray queries have the same names and meaning as in Open3D's RaycastingScene. A change of an object, such as a new
    level of an isosurface, takes effect at the next query.

    Parameters
    ----------
    objects : Isosurface, Mesh, or iterable of them
        Also meshes of other libraries, and pairs (object, (4, 4) transform). Added in this order; geometry ids count up
        from 0 and are never reused.
    *more
        Further objects: ``Scene(bone, skin)`` is ``Scene([bone, skin])``.
    build_quality : {"medium", "low", "high"}
        Quality of Embree's acceleration structures. "low" takes half the memory and builds a little faster, but rays
        take up to a fifth longer (measured on CT volumes). "high" splits long triangles; it has no effect on
        isosurfaces.

    Notes
    -----
    Any number of threads may query a scene while others change it and set the levels of its isosurfaces. A query sees
    the scene as it is when the query begins. Changes and queries do not wait for each other. After a change, the first
    query builds the changed objects, and other queries of this scene wait for them.

    Each isosurface and mesh is built once, however often it is added; moving, hiding and removing builds nothing.

    An isosurface has two indexes, with the same hits. The draft is ready some milliseconds after a change of the level.
    The settled one takes longer to build, and rays are faster: see `settle`.

    Examples
    --------
    >>> import numpy as np
    >>> import isospline
    >>> z, y, x = np.mgrid[-8:9, -8:9, -8:9]
    >>> volume = isospline.Volume(np.sqrt(x**2 + y**2 + z**2), origin=(-8, -8, -8))
    >>> scene = isospline.Scene([isospline.Isosurface(volume, 5.0, inside="below")])
    >>> hits = scene.cast_rays([(-20, 0, 0, 1, 0, 0)])
    >>> bool(abs(hits["t_hit"][0] - 15.0) < 0.01)
    True
    >>> np.round(hits["primitive_normals"][0]) + 0.0
    array([-1.,  0.,  0.])
    """

    __slots__ = ()

    def __init__(
        self,
        objects: Placeable | Iterable[Placeable | tuple[Placeable, ArrayLike | None]] = (),
        *more: Placeable | tuple[Placeable, ArrayLike | None],
        build_quality: Literal["low", "medium", "high"] = "medium",
    ) -> None:
        super().__init__(as_placed_objects(objects, *more), build_quality)

    def add(
        self, obj: Placeable, transform: ArrayLike | None = None, *, visible: bool = True, casts_shadow: bool = True
    ) -> int:
        """Adds an object.

        The same isosurface or mesh may be added many times. All instances share its acceleration structure; each adds
        less than a kilobyte.

        Parameters
        ----------
        obj : Isosurface or Mesh
            Or a mesh of trimesh, PyVista, VTK or meshio.
        transform : (4, 4) array_like, optional
            Maps the object's world space to the scene's: an affine map, as [row, column]; may rotate, scale and mirror.
        visible : bool
            Whether `cast_rays`, `list_intersections`, `count_intersections` and pictures see it.
        casts_shadow : bool
            Whether `test_occlusions` and shadow rays see it, and reflected rays of path tracing.

        Returns
        -------
        int
            The object's geometry id; ids are never reused.

        Raises
        ------
        ValueError
            If the transform is not finite, not affine or singular, or the object too large or too small for a scene:
            with a radius above 1e12 units, or with voxels or units below 1e-12. If it is farther than that from the
            middle of the scene, the next query raises the error.
        TypeError
            For another type of object.

        Examples
        --------
        >>> import numpy as np
        >>> import isospline
        >>> triangle = isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
        >>> scene = isospline.Scene([triangle])
        >>> lifted = np.eye(4)
        >>> lifted[2, 3] = 5
        >>> scene.add(triangle, lifted, casts_shadow=False)
        1
        >>> down = [(0.2, 0.2, 10, 0, 0, -1)]
        >>> scene.cast_rays(down)["geometry_ids"], scene.test_occlusions(down, t_far=6)
        (array([1], dtype=uint32), array([False]))
        >>> scene.remove(1)
        >>> scene.ids
        [0]
        """
        return super().add(as_object(obj, "obj"), transform, visible, casts_shadow)

    def remove(self, geometry_id: SupportsIndex) -> None:
        """Removes an object; its geometry id is never reused.

        Parameters
        ----------
        geometry_id : int

        Raises
        ------
        ValueError
            For an id that is not in the scene.
        """
        return super().remove(geometry_id)

    def object(self, geometry_id: SupportsIndex) -> Isosurface | Mesh:
        """The object with a geometry id.

        Parameters
        ----------
        geometry_id : int

        Returns
        -------
        Isosurface or Mesh
            The object that was added.

        Raises
        ------
        ValueError
            For an id that is not in the scene.
        """
        return super().object(geometry_id)

    @property
    def ids(self) -> list[int]:
        """List of int: the geometry ids of the objects, ascending."""
        return super().ids

    def transform(self, geometry_id: SupportsIndex) -> NDArray[np.float64]:
        """(4, 4) float64 array: maps an object's world space to the scene's."""
        return super().transform(geometry_id)

    def set_transform(self, geometry_id: SupportsIndex, transform: ArrayLike | None) -> None:
        """Moves an object. Only the scene's small tree over its objects is rebuilt; if the scene becomes more than
        twice or less than an eighth as large, its objects may be, too.

        Parameters
        ----------
        geometry_id : int
        transform : (4, 4) array_like or None
            As in `add`.

        Raises
        ------
        ValueError
            For an id that is not in the scene, and for a transform as in `add`.
        """
        return super().set_transform(geometry_id, transform)

    def visibility(self, geometry_id: SupportsIndex) -> Visibility:
        """Visibility: which rays see an object."""
        return super().visibility(geometry_id)

    def set_visibility(
        self, geometry_id: SupportsIndex, *, visible: bool | None = None, casts_shadow: bool | None = None
    ) -> None:
        """Shows or hides an object; None leaves a flag unchanged.

        Parameters
        ----------
        geometry_id : int
        visible, casts_shadow : bool, optional
            As in `add`.

        Raises
        ------
        ValueError
            For an id that is not in the scene.
        """
        return super().set_visibility(geometry_id, visible, casts_shadow)

    def certificate(
        self,
        ray: ArrayLike,
        *,
        t_near: float = 0.0,
        t_far: float = math.inf,
        geometry_id: SupportsIndex | None = None,
    ) -> dict[str, Any]:
        """The proof of what one ray meets first, as data to keep and to check.

        It says in rational numbers, without rounding, what `cast_rays` with `certify` says in intervals: where the ray
        first crosses an isosurface, or that it crosses it nowhere. It is a dict for `json.dump`; its parts are
        explained in docs/method.md, "Certificates". `isospline.certificates.check` checks it, and so does the command
        ``isospline verify``.

        Parameters
        ----------
        ray : (6,) array_like
            Origin and direction, in world units.
        t_near, t_far : float
            Only crossings with t in [t_near, t_far] count. t is in units of the direction's length.
        geometry_id : int, optional
            The isosurface, which must have neither `clip`, `mask` nor `largest`, and must not be closed. By default the
            scene's only visible object. Other objects of the scene do not change a certificate.

        Returns
        -------
        dict
            ``statement``: "hit", "miss" or "undecided"; a ray is undecided where it touches the surface or begins on
            it. ``model``: the numbers of the model, and the SHA-256 of its coefficients. ``ray``: its numbers and
            limits. ``cover``: the way before the crossing in pieces without a gap, each with the reason why it is free.
            ``hit``: the ends of an interval of t in which f crosses the level exactly once, the intervals of the
            polynomials' Bernstein coefficients, and those of the gradient's coordinates. ``undecided``: the ends of the
            interval, and a bound on \\|f - level\\| in it.

        Raises
        ------
        ValueError
            If the ray is not one ray of finite numbers, the limits are not in order, there is no such isosurface, or
            nothing can be proven of it.

        Examples
        --------
        >>> import isospline
        >>> field = isospline.volumes.sphere()
        >>> scene = isospline.Scene(isospline.Isosurface(field.volume(16), field.level))
        >>> certificate = scene.certificate((-3, 0.1, 0.2, 1, 0, 0))
        >>> certificate["statement"], len(certificate["cover"])
        ('hit', 4)
        >>> isospline.certificates.check(certificate, scene.object(0).volume)
        """
        return certificate(self, ray, t_near, t_far, geometry_id)

    @property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) float64 array, world units: lower and upper corner of the box of all meshes, cells of shells and caps,
        visible or not; inf, -inf if there are none.
        """
        return super().bounds

    def settle(self, *, progress: Progress = None) -> None:
        """Builds the settled indexes of the isosurfaces now.

        A settled index has a box of Embree around each 2 x 2 x 2 cells, as tight as the surface in them allows. It
        takes about 0.1 s to build for a volume of 256^3 samples, and rays that are traced one by one are a third faster
        than in the draft, which a new level begins with. Without this call, it is built in the background after about
        two million coherent rays at one level of a volume of 256^3, and the next queries use it. A sixth is enough if
        they are not coherent. Pictures for which it pays build it first. Hits are the same in both, bit for bit.
        Surfaces of stores keep the draft.

        Parameters
        ----------
        progress : callable, optional
            Called with the finished fraction; cancels if it returns a false value other than None.

        Raises
        ------
        Cancelled
            If `progress` cancels. Nothing changes then.

        Examples
        --------
        >>> import numpy as np
        >>> import isospline
        >>> z, y, x = np.mgrid[-8:9, -8:9, -8:9]
        >>> volume = isospline.Volume(np.sqrt(x**2 + y**2 + z**2), origin=(-8, -8, -8))
        >>> scene = isospline.Scene([isospline.Isosurface(volume, 5.0, inside="below")])
        >>> scene.is_settled
        False
        >>> scene.settle()
        >>> scene.is_settled
        True
        """
        return super().settle(progress)

    @property
    def is_settled(self) -> bool:
        """Whether rays use settled indexes wherever there are any; see `settle`. False before the first
        query.
        """
        return super().is_settled

    @property
    def memory(self) -> int:
        """Bytes of Embree's acceleration structures and of the cells that are kept with them. Objects that were added
        several times count once.
        """
        return super().memory

    @property
    def build_count(self) -> int:
        """Number of acceleration structures of isosurfaces and meshes that have been built so far. Each new object and
        each new level adds one. Settled indexes add none, and other changes only as `set_transform` tells.
        """
        return super().build_count

    @property
    def build_quality(self) -> Literal["low", "medium", "high"]:
        """How Embree's acceleration structures are built: "low", "medium" or "high"."""
        return super().build_quality

    def __copy__(self) -> Scene:
        copied = scene_of(*self.__reduce__()[1])
        copied._share_built_objects(self)
        return copied

    def __deepcopy__(self, memo: Any) -> Scene:
        memo[id(self)] = copied = scene_of(*deepcopy(self.__reduce__()[1], memo))
        return copied

    def __reduce__(self) -> Any:
        return scene_of, (self.build_quality, self._placed_objects(), type(self), attributes_of(self))


def scene_of(
    build_quality: Any,
    objects: Iterable[Any],
    kind: type[Scene] = Scene,
    attributes: Mapping[str, Any] = MappingProxyType({}),
) -> Scene:
    """A scene of objects with their geometry ids."""
    scene = kind.__new__(kind)
    Scene.__init__(scene, build_quality=build_quality)
    nothing = Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.uint32))
    next_id = 0
    for id, each, transform, visibility in objects:
        for unused in range(next_id, id):  # ids of objects that have been removed
            scene.add(nothing)
            scene.remove(unused)
        scene.add(each, transform, **visibility)
        next_id = id + 1
    return with_attributes(scene, attributes)
