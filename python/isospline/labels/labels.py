"""Label maps."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.mistakes import sentence
from ..base.parameters import check_integer
from ..base.progress import as_callable, part_of
from ..base.results import LabelComparison, LabelMeasures, LabelTable
from ..base.signatures import explained_methods
from ..io import VolumeData
from ..io.read import check_frame
from ..scene import Isosurface, Scene
from . import files
from .comparison import compare
from .measures import measure
from .segments import Segment, as_labels, find, find_all, renamed, segments_of, whole_numbers, with_voxels
from .surfaces import SMOOTHING, check_smoothing, surface_of

Label = int | str


@explained_methods
class Labels:
    """A label map: each voxel has the number of a segment, such as an organ, or that of the background.

    Parameters
    ----------
    data : (nz, ny, nx) integer array, or VolumeData
        The labels. Real numbers are accepted if all are whole, and of 32 bits. An array that can be written to is
        copied.
    spacing, origin, direction : optional
        The place in the world, as in `VolumeData`; by default that of `data`.
    names : dict, optional
        Names by number, ``{1: "liver"}``, or numbers by name, as in nnU-Net's dataset.json. Other labels are called by
        their number, such as "label 2".
    colors : dict, optional
        Colours by number or name, each as in `Material`. Others are those of the file, or of a categorical map.
    background : int
        The number that is no label.

    Raises
    ------
    ValueError, TypeError
        For an array that has not three dimensions of whole numbers, for images of other libraries, and for another
        type of a parameter.

    See Also
    --------
    Labels.read : from a file.

    Examples
    --------
    >>> import numpy as np, isospline
    >>> z, y, x = np.mgrid[:24, :24, :24]
    >>> ball = (x - 12) ** 2 + (y - 12) ** 2 + (z - 12) ** 2 < 81
    >>> labels = isospline.Labels(np.where(ball, 1 + (x > 11), 0), names={1: "left", 2: "right"})
    >>> labels
    Labels(shape=(24, 24, 24), 2 labels: 1 left, 2 right)
    >>> left = labels.surface("left")
    >>> bool(abs(left.enclosed_volume().value / labels.mask("left").sum() - 1) < 0.005)
    True
    """

    def __init__(
        self,
        data: ArrayLike | VolumeData,
        *,
        spacing: ArrayLike | None = None,
        origin: ArrayLike | None = None,
        direction: ArrayLike | None = None,
        names: Mapping[Any, Any] | None = None,
        colors: Mapping[Any, Any] | None = None,
        background: int = 0,
    ) -> None:
        given = {name: value for name, value in check_frame(spacing, origin, direction).items() if value is not None}
        self._set(as_labels(data).replace(**given), {}, names, colors, background)

    @classmethod
    def read(
        cls,
        path: str | os.PathLike[str],
        *,
        names: Mapping[Any, Any] | None = None,
        colors: Mapping[Any, Any] | None = None,
        background: int = 0,
        **place: Any,
    ) -> Labels:
        """Read a label map from any format of `read_volume`.

        Names and colours are those of the file: of the segments in a ``.seg.nrrd`` of 3D Slicer, also of overlapping
        ones in several layers, of those in a DICOM segmentation, and of the table of labels in a NIfTI file of
        TotalSegmentator. Voxels with numbers that no segment of the file has raise a warning, and are left out.

        Parameters
        ----------
        path : str or path-like
            The file.
        names, colors, background
            As in the constructor; they replace those of the file.
        **place
            Options of `read_volume`, such as ``spacing=``.

        Returns
        -------
        Labels

        Raises
        ------
        ValueError
            If the samples are not whole numbers, and as `read_volume` does.
        """
        data, told = files.read(path, **place)
        samples = whole_numbers(data.data, dimensions=(3, 4) if isinstance(told, list) else (3,))
        labels = cls.__new__(cls)
        labels._set(data.replace(data=samples), told, names, colors, background)
        return labels

    def _set(self, source, told, names, colors, background):
        check_integer(background, "background")
        samples = source.data.view()
        samples.flags.writeable = False  # the segments and their counts are found once
        self._layers = [samples] if samples.ndim == 3 else [samples[..., each] for each in range(samples.shape[-1])]
        self._source = source.replace(data=self._layers[0])
        self._background = int(background)
        counts = [dict(zip(*map(np.ndarray.tolist, np.unique(each, return_counts=True)))) for each in self._layers]
        if isinstance(told, list) and told:
            segments = with_voxels(told, counts, self._background)
        else:
            segments = segments_of([value for value in counts[0] if value != background], dict(told))
        self._segments = renamed(segments, names, colors)
        self._counts = [counts[each.layer][each.value] for each in self._segments]

    @property
    def data(self) -> NDArray[np.integer]:
        """The labels, [z, y, x], read-only; of a map with several layers a new array, [layer, z, y, x]."""
        return self._layers[0] if len(self._layers) == 1 else np.stack(self._layers)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of voxels, (nz, ny, nx)."""
        return self._source.shape

    @property
    def source(self) -> VolumeData:
        """The labels of the first layer, and their place."""
        return self._source

    @property
    def frame(self) -> dict[str, Any]:
        """The place in the world: spacing, origin, direction, unit and patient, as of `VolumeData`."""
        return self._source.frame

    @property
    def segments(self) -> tuple[Segment, ...]:
        """Number, name, colour, value and layer of each label that has voxels."""
        return self._segments

    @property
    def numbers(self) -> tuple[int, ...]:
        """The numbers of the labels that have voxels, without the background."""
        return tuple(each.number for each in self._segments)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of these labels."""
        return tuple(each.name for each in self._segments)

    @property
    def colors(self) -> NDArray[np.float64]:
        """(N, 3) float64 array: the colours of these labels in sRGB, from 0 to 1."""
        return np.array([each.color for each in self._segments]).reshape(-1, 3)

    def table(self) -> LabelTable:
        """Numbers, names and numbers of voxels; `measure` has volumes and areas as well.

        Returns
        -------
        LabelTable
            ``labels.table().to_frame()`` is a table of pandas.
        """
        return LabelTable(
            numbers=np.array(self.numbers, np.int64),
            names=np.array(self.names, str),
            voxel_counts=np.array(self._counts, np.int64),
        )

    def mask(self, label: Label) -> NDArray[np.bool_]:
        """The voxels of a label.

        Parameters
        ----------
        label : str or int
            Its name or its number.

        Returns
        -------
        (nz, ny, nx) bool array
        """
        segment = find(self._segments, label)
        mask: NDArray[np.bool_] = self._layers[segment.layer] == segment.value
        return mask

    def surface(
        self,
        label: Label,
        *,
        smoothing: float = SMOOTHING,
        progress: Callable[[float], object] | bool | None = None,
        **options: Any,
    ) -> Isosurface:
        r"""The smooth surface of a label: the zero level of a B-spline of degree 2.

        The centre of each voxel of the label is inside, the centres of all other voxels are outside. The enclosed
        volume is that of the voxels: the error is below 0.5%, or the one that `Isosurface.enclosed_volume` states if
        that is larger. Where two large labels meet, their surfaces are the same to about a hundredth of a voxel; small
        or thin ones may be moved by a fifth of a voxel to keep their volume. Where three meet, gaps and overlaps are
        smaller than a voxel. The surface is closed at the border of the map.

        Parameters
        ----------
        label : str or int
            Its name or its number.
        smoothing : float, voxels
            Standard deviation of the smoothing, from 0.5 to 4. A voxel's edge is the cube root of its volume: all axes
            are smoothed over the same length.
        progress : callable or True, optional
            Called with the finished fraction, and cannot cancel. True shows a bar.
        **options
            Of `Isosurface`, such as ``opacity=`` or ``clip=``. By default, the name and the colour are the label's;
            with a `material`, the name is, if the material has none.

        Returns
        -------
        Isosurface

        Raises
        ------
        ValueError
            If no label, or more than one, has this name, if no label has this number, and for a `smoothing` out of
            range.

        Notes
        -----
        The indicator of the label is smoothed, and the largest one of the others is subtracted. Then the samples are
        low-pass filtered [1]_ and their signs are restored, in turns. After each turn, Newton's method restores the
        volume near each voxel. All of these operations are odd, so a surface between two labels is the same from both
        sides. At the end, a small constant makes the volume exact: near the background, or everywhere if the label
        meets none or would move much there. It moves the surface towards other labels as well.

        References
        ----------
        .. [1] R. T. Whitaker, "Reducing aliasing artifacts in iso-surfaces of binary volumes", IEEE Symposium on
           Volume Visualization, 2000, for the constraint of the signs.
        """
        segment = find(self._segments, label)
        check_smoothing(smoothing)
        report = as_callable(progress) or (lambda fraction: None)
        layer = self._source.replace(data=self._layers[segment.layer])
        return surface_of(layer, segment, self._background, smoothing, options, report)

    def scene(
        self,
        labels: Iterable[Label] | None = None,
        *,
        smoothing: float = SMOOTHING,
        progress: Callable[[float], object] | bool | None = None,
        **options: Any,
    ) -> Scene:
        """A scene of the surfaces of all labels, or of some of them.

        ``render(labels.scene(), legend=True)`` shows their names.

        Parameters
        ----------
        labels : sequence of str or int, optional
            Names and numbers; by default all labels.
        smoothing, progress, **options
            As in `surface`.

        Returns
        -------
        Scene
        """
        return Scene(self.surfaces(labels, smoothing=smoothing, progress=progress, **options))

    def surfaces(
        self,
        labels: Iterable[Label] | None = None,
        *,
        smoothing: float = SMOOTHING,
        progress: Callable[[float], object] | bool | None = None,
        **options: Any,
    ) -> list[Isosurface]:
        """The surfaces of all labels, or of some of them.

        Parameters
        ----------
        labels, smoothing, progress, **options
            As in `scene`.

        Returns
        -------
        list of Isosurface
        """
        return [surface for _, surface in self._surfaces(labels, smoothing, progress, options)]

    def measure(
        self,
        labels: Iterable[Label] | None = None,
        *,
        smoothing: float = SMOOTHING,
        progress: Callable[[float], object] | bool | None = None,
    ) -> LabelMeasures:
        """Volume, area, number of voxels and centroid of each label.

        Parameters
        ----------
        labels, smoothing, progress
            As in `scene`.

        Returns
        -------
        LabelMeasures
            ``labels.measure().to_frame()`` is a table of pandas.
        """
        found = []
        for segment, surface in self._surfaces(labels, smoothing, progress, {}):
            found.append(measure(segment, surface, self.mask(segment.number), self._source))
        return LabelMeasures._of_rows(found)

    def compare(
        self,
        other: Labels,
        labels: Iterable[Label] | None = None,
        *,
        by: str = "number",
        smoothing: float = SMOOTHING,
        progress: Callable[[float], object] | bool | None = None,
    ) -> LabelComparison:
        """Compare the labels of two maps of the same voxels: Dice coefficients and distances of surfaces.

        Parameters
        ----------
        other : Labels
            The other map, with the same shape and place.
        labels : sequence of str or int, optional
            Labels of this map; by default all labels of both maps.
        by : {"number", "name"}
            What corresponding labels have in common.
        smoothing, progress
            As in `surface`.

        Returns
        -------
        LabelComparison
            A label that is in one map only has the Dice coefficient 0, and distances of NaN.

        Raises
        ------
        ValueError
            For maps of different shapes, places or units, no labels, names that several labels of a map have if `by` is
            "name", and as in `surface`.
        """
        if not isinstance(other, Labels):
            raise TypeError(sentence("other", "Labels", other))
        if by not in ("number", "name"):
            raise ValueError(sentence("by", '"number" or "name"', by))
        check_smoothing(smoothing)
        wanted = None if labels is None and (len(self) or len(other)) else find_all(self._segments, labels)
        return compare(self, other, wanted, by, smoothing, as_callable(progress))

    def show(self, **options: Any) -> Any:
        """Show the scene of all labels in the browser, as `Scene.show` does."""
        return self.scene().show(**options)

    def _surfaces(self, labels, smoothing, progress, options):
        """Segments and their surfaces, one after the other."""
        wanted, report = find_all(self._segments, labels), as_callable(progress)
        for place, segment in enumerate(wanted):
            part = part_of(report, place, len(wanted))
            yield segment, self.surface(segment.number, smoothing=smoothing, progress=part, **options)

    def __len__(self) -> int:
        return len(self._segments)

    def __repr__(self) -> str:
        shown = [f"{each.number} {each.name}" for each in self._segments[:8]]
        shown += ["..."] if len(self._segments) > 8 else []
        kind = "label" if len(self._segments) == 1 else "labels"
        return f"Labels(shape={self.shape}, {len(self._segments)} {kind}: {', '.join(shown)})"
