"""Integrals over isosurfaces, and their components."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .. import _core
from ..base.signatures import methods_of

if TYPE_CHECKING:
    from ..base.results import Components, Measurement
    from ..base.types import Progress


@methods_of("Isosurface")
class SurfaceMeasures(_core.Isosurface):
    """The part of `Isosurface` about its measures."""

    __slots__ = ()

    def enclosed_volume(
        self, *, tolerance: float | None = None, order: int | None = None, progress: Progress = None
    ) -> Measurement:
        r"""The volume of the solid that the surface bounds, in world units cubed.

        .. math:: V = \int_{f \ge f_0} \mathrm{d}^3 x

        The solid is the set of points for which `contains` is true: in the volume's domain, on the `inside` side of the
        level, and not cut away by `mask`, `largest` or `clip`. Whether it is capped or closed makes no difference.

        Parameters
        ----------
        tolerance : float, optional
            The largest relative error, 1e-4 unless an order is given. The smaller it is, the longer it takes.
        order : int, optional
            Instead of a tolerance: quadrature in every cell with so many nodes of Gauss-Legendre rules along each axis,
            2 to 10. Orders 2, 4, 6 and 10 take about 1 : 2.5 : 5 : 13 of the time, and order 2 takes 2 to 14 times that
            of the default tolerance. The true errors of orders 2, 4 and 6 were below 1e-4, 1e-7 and 1e-8 for two CT
            volumes.
        progress : callable, optional
            Called with the finished fraction; cancels if it returns a false value other than None.

        Returns
        -------
        Measurement
            Volume of the spline model. Its error is an estimate, see the notes; the true one is usually far smaller.
            It is at most `tolerance` times the value, except where parts of the surface are too small to be resolved or
            as sharp as noise.

        Raises
        ------
        ValueError
            For an order out of range, a tolerance that is not positive, and both together.

        Notes
        -----
        For a tolerance, lines along the axes are cut with the surface, at the nodes of lattices over the faces of
        cells with random shifts [2]_, which are the same in every run. The errors of cells mostly cancel, because
        the lines continue in the next cell. The stated error is four standard deviations, or more where these are not
        well known, plus 2.5e-7 of the integral for rounding. A second lattice in one of four columns of cells tells the
        deviation. Where the surface is rough in few columns, it is that of the halves of each lattice.
        Solids of less than 1000 cells, and tolerances that lines do not reach, need quadrature in every cell [1]_:
        where the surface is smooth, its error falls geometrically with the order. Its stated error is the sum over all
        parts of cells of the difference from the rules with one and two nodes less, whichever is larger, plus a bound
        on parts that were too small to be resolved. The model itself differs from a smooth sampled function by O(h^2)
        at degree 1 and O(h^4) at degrees 2 and 3, where h is the spacing.

        References
        ----------
        .. [1] R. I. Saye, "High-order quadrature methods for implicitly defined surfaces and volumes in
           hyperrectangles", SIAM Journal on Scientific Computing 37(2), 2015.
        .. [2] R. Cranley and T. N. L. Patterson, "Randomization of number theoretic methods for multiple integration",
           SIAM Journal on Numerical Analysis 13(6), 1976.

        Examples
        --------
        >>> import math
        >>> import isospline
        >>> field = isospline.volumes.sphere(0.7)
        >>> volume = field.volume(32)
        >>> ball = isospline.Isosurface(volume, field.level).enclosed_volume()
        >>> bool(abs(ball.value / (4 / 3 * math.pi * 0.7**3) - 1) < 1e-5)
        True
        """
        return super().enclosed_volume(tolerance, order, progress)

    def area(
        self, *, tolerance: float | None = None, order: int | None = None, progress: Progress = None
    ) -> Measurement:
        r"""The area of the surface, in world units squared.

        .. math:: A = \int_{f = f_0} \mathrm{d}A

        The area includes caps. Nothing is added where the surface ends: at the border of the volume if it is not
        closed, and at a cut that is not capped.

        Parameters
        ----------
        tolerance, order, progress
            As in `enclosed_volume`. The default tolerance takes a quarter to twice the time of order 2; orders 4, 6 and
            10 take 3, 6.5 and 19 times as long as that. The true errors of orders 2, 4 and 6 were below 5e-4, 3e-5 and
            5e-6 for two CT volumes, and 2e-3 at order 2 for a noisy one.

        Returns
        -------
        Measurement
            Its error is estimated as in `enclosed_volume`.

        Raises
        ------
        ValueError
            As in `enclosed_volume`.

        Examples
        --------
        >>> import math
        >>> import isospline
        >>> field = isospline.volumes.torus(0.6, 0.25)
        >>> volume = field.volume(64, degree=3)
        >>> torus = isospline.Isosurface(volume, field.level).area()
        >>> bool(abs(torus.value / (4 * math.pi**2 * 0.6 * 0.25) - 1) < 1e-4)
        True
        """
        return super().area(tolerance, order, progress)

    def mean_curvature(
        self, *, tolerance: float | None = None, order: int | None = None, progress: Progress = None
    ) -> Measurement:
        r"""The integral of the mean curvature over the surface, in world units.

        .. math:: M = \int_{f = f_0} \frac{k_1 + k_2}{2} \, \mathrm{d}A

        For a ball it is :math:`4 \pi r`; the mean breadth of a convex solid is :math:`M / 2 \pi`. Caps are flat and add
        nothing; the edges around them are not counted.

        Parameters
        ----------
        tolerance, order, progress
            As in `enclosed_volume`.

        Returns
        -------
        Measurement
            Its error is estimated as in `enclosed_volume`. The tolerance is relative to the integral of the absolute
            value.

        Raises
        ------
        ValueError
            For a volume of degree 1, whose surfaces have creases, and as in `enclosed_volume`.
        """
        return super().mean_curvature(tolerance, order, progress)

    def gaussian_curvature(
        self, *, tolerance: float | None = None, order: int | None = None, progress: Progress = None
    ) -> Measurement:
        r"""The integral of the Gaussian curvature over the surface.

        .. math:: K = \int_{f = f_0} k_1 k_2 \, \mathrm{d}A

        For a closed surface it is :math:`2 \pi \chi`, where the Euler characteristic :math:`\chi` is 2 for each piece
        minus 2 for each handle. If the surface ends at a border or a cut, it can be any number.

        Parameters
        ----------
        tolerance, order, progress
            As in `enclosed_volume`.

        Returns
        -------
        Measurement
            Its error is estimated as in `enclosed_volume`. The tolerance is relative to the integral of the absolute
            value.

        Raises
        ------
        ValueError
            For a volume of degree 1, whose surfaces have creases, and as in `enclosed_volume`.

        Examples
        --------
        >>> import math
        >>> import isospline
        >>> field = isospline.volumes.torus(0.6, 0.25)
        >>> volume = field.volume(48)
        >>> torus = isospline.Isosurface(volume, field.level)
        >>> round(torus.gaussian_curvature().value / (2 * math.pi), 4) + 0.0
        0.0
        """
        return super().gaussian_curvature(tolerance, order, progress)

    def components(
        self,
        *,
        measured: bool = False,
        tolerance: float | None = None,
        order: int | None = None,
        progress: Progress = None,
    ) -> Components:
        """The connected components of the solid that the surface bounds, the largest first.

        A component is a connected piece of the solid with all of its surface, including that of its cavities. Two cells
        that share a face are connected if the solid reaches that face. All parts of the solid in one cell count as
        connected, so two separate pieces are one component if they pass through the same cell.

        The solid is the one that `mask`, `largest` and `clip` keep. A clip that cuts a piece in two makes two
        components, like a clip filter before a connectivity filter in VTK.

        Pieces can have no volume: a plate on which f is the level and, at degree 1, samples that equal the level among
        lower ones. At degrees 2 and 3, points and curves where f only touches the level are not pieces, because
        rounding decides whether f reaches the level there.

        Parameters
        ----------
        measured : bool
            Whether volumes and areas are integrated, which takes longer than `area` if there are many small components.
            The components are the same. If measured, they are in the order of their volumes, as for `largest`;
            otherwise in that of `inside_counts`, because volumes are not known then.
        tolerance, order, progress
            As in `enclosed_volume`; the tolerance is that of each component.

        Returns
        -------
        Components
            Arrays with one item for each component: `bounds`, `cell_counts`, `inside_counts` and, if measured,
            `enclosed_volumes`, `areas` and their errors. Volumes and areas add up to `enclosed_volume` and `area`,
            which include caps.

        Raises
        ------
        ValueError
            For an order out of range, a tolerance that is not positive, and both together.

        Notes
        -----
        At degree 1, without a clip, these are the labels of ``scipy.ndimage.label`` for ``volume >= level`` with 26
        neighbours. `largest` chooses among the components before the clip, so that moving a cut does not change what is
        kept.

        Examples
        --------
        >>> import numpy as np
        >>> import isospline
        >>> z, y, x = np.mgrid[0:24, 0:24, 0:48]
        >>> balls = [r - np.sqrt((x - c) ** 2 + (y - 12) ** 2 + (z - 12) ** 2) for c, r in ((12, 9), (36, 6))]
        >>> volume = isospline.Volume(np.maximum(*balls))
        >>> found = isospline.Isosurface(volume, 0).components(measured=True)
        >>> len(found.areas), bool(abs(found.enclosed_volumes[1] / (4 / 3 * np.pi * 6**3) - 1) < 1e-2)
        (2, True)
        >>> isospline.Isosurface(volume, 0, largest=1).contains([(12, 12, 12), (36, 12, 12)])
        array([ True, False])
        """
        return super().components(measured, tolerance, order, progress)
