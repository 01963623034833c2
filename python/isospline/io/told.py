"""Warnings of what files do not tell of the place of their samples."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from ..base.system import warn

_is_spaced = ContextVar("is_spaced", default=False)


@contextlib.contextmanager
def spacing_given(spacing: Any) -> Iterator[None]:
    """Leave out warnings of the spacing in files if the caller gives another one; None is none."""
    token = _is_spaced.set(spacing is not None)
    try:
        yield
    finally:
        _is_spaced.reset(token)


def warn_of_place(path: Path, told: dict[str, Any]) -> None:
    """Warn of what a reader tells, and remove it: `of_spacing` and `warning`."""
    of_spacing, warning = told.pop("of_spacing", ""), told.pop("warning", "")
    texts = [text for text in ("" if _is_spaced.get() else of_spacing, warning) if text]
    if texts:
        warn(f"{path.name}: {'; '.join(texts)}")
