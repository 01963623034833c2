"""Mappings whose items are also attributes, and tables of them: what results of queries are made of."""

from __future__ import annotations

import csv
import io
import os
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import NDArray

from .parameters import check_path
from .signatures import explained_methods
from .system import whole_file
from .values import same

if TYPE_CHECKING:
    from typing_extensions import Self


class Item(property):
    """A property that is the item of a result; `parts` are the names of the numbers of a row, if there are several.

    A list has these numbers several times, as the array tells.
    """

    parts: tuple[str, ...] | None
    is_list: bool
    is_column: bool


def item(
    name: str,
    doc: str,
    parts: tuple[str, ...] | None = None,
    is_list: bool = False,
    is_column: bool = True,
    option: str | None = None,
) -> Any:
    def get(self: dict[str, Any]) -> Any:
        try:
            return self[name]
        except KeyError:
            held = ", ".join(self) or "nothing"
            wanted = option or f'outputs=("{name}",)'
            raise AttributeError(f"{name}: expected {wanted} for it, got a result with {held}") from None

    made = Item(get)
    made.__doc__ = doc  # given to the constructor, it would be hidden by that of the class
    made.parts, made.is_list, made.is_column = parts, is_list, is_column
    return made


class Result(dict[str, Any]):
    """A mapping whose items are also attributes. Results are equal if their items are, with NaN equal to NaN."""

    def __eq__(self, other: object) -> bool:
        return same(dict(self), dict(other)) if isinstance(other, dict) else NotImplemented

    def __ne__(self, other: object) -> bool:
        return not same(dict(self), dict(other)) if isinstance(other, dict) else NotImplemented

    __hash__ = None

    def __repr__(self) -> str:
        """Names, shapes and types of arrays, without their numbers; other items as they are."""
        return f"{type(self).__name__}({', '.join(f'{name}{_text(item)}' for name, item in self.items())})"

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self]


def _text(item: Any) -> str:
    return f": {item.dtype}{list(item.shape)}" if isinstance(item, np.ndarray) else f"={item!r}"


@explained_methods
class Table(Result):
    """A result whose arrays have one row for each ray, point or component."""

    if TYPE_CHECKING:

        def __getitem__(self, name: str) -> NDArray[Any]: ...

    @classmethod
    def _of_rows(cls, rows: list[dict[str, Any]]) -> Self:
        """The table of rows: dicts of the items of one ray, point or component."""
        return cls({name: np.array([row[name] for row in rows]) for name in rows[0]})

    def to_frame(self) -> Any:
        """Convert to a table of pandas: one row for each ray, point or component, with a column for each number.

        Returns
        -------
        pandas.DataFrame
            Vectors have columns such as ``positions_x``, matrices ``dnormal_dorigin_x_y``, that of the normal's x and
            the origin's y, and lists ``coefficient_weights_0``. Rays of several axes are in C order.

        Raises
        ------
        ImportError
            If pandas is not installed: ``pip install pandas``.
        """
        try:
            import pandas  # type: ignore[import-untyped, unused-ignore]
        except ModuleNotFoundError:
            raise ModuleNotFoundError("to_frame needs the package pandas: pip install pandas", name="pandas") from None
        return pandas.DataFrame(self._columns())

    @overload
    def to_csv(self, path: None = None) -> str: ...
    @overload
    def to_csv(self, path: str | os.PathLike[str]) -> None: ...
    def to_csv(self, path: str | os.PathLike[str] | None = None) -> str | None:
        """Write the table to a file of comma-separated values, completely or not at all.

        Parameters
        ----------
        path : str or path-like, optional
            The file, in UTF-8; without it, the text is returned.

        Returns
        -------
        str or None
            A line of names and one for each ray, point or component, as in `to_frame`. Numbers are written so that they
            are read as the same numbers, in the units of the results.

        Raises
        ------
        OSError
            If the file cannot be written.

        Examples
        --------
        >>> import isospline
        >>> field = isospline.volumes.torus()
        >>> surface = isospline.Isosurface(field.volume(16), field.level)
        >>> surface.sample_points(5, seed=0).to_csv().splitlines()[0]
        'points_x,points_y,points_z,primitive_ids,primitive_normals_x,primitive_normals_y,primitive_normals_z'
        """
        text = io.StringIO(newline="")
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self._columns())
        writer.writerows(self._rows())
        if path is None:
            return text.getvalue()
        check_path(path)
        with whole_file(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
            file.write(text.getvalue())
        return None

    def _columns(self) -> dict[str, NDArray[Any]]:
        """The columns of the table, by their names."""
        columns: dict[str, NDArray[Any]] = {}
        for name, array in self.items():
            item = getattr(type(self), name)
            if not item.is_column:
                continue
            names = [name]
            if item.is_list:
                names = [f"{name}_{place}" for place in range(array.shape[-2 if item.parts else -1])]
            if item.parts:
                names = [f"{each}_{part}" for each in names for part in item.parts]
            if names:  # a list is empty without isosurfaces
                columns |= zip(names, np.reshape(array, (-1, len(names))).T)
        return columns

    def _rows(self) -> list[tuple[Any, ...]]:
        """The rows of the table, as Python's numbers and text, in the order of the columns."""
        return list(zip(*(column.tolist() for column in self._columns().values())))
