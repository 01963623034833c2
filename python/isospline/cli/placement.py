"""Meshes of the command line, and their positions: ``FILE``, ``FILE@x,y,z`` or ``FILE@MATRIX``."""

from __future__ import annotations

import contextlib
import os

import numpy as np

import isospline


def read_placed(text):
    """The path of a mesh, the mesh and its 4 x 4 matrix."""
    path, at, place = text.rpartition("@")
    if not at or os.path.exists(text):
        return text, isospline.read_mesh(text), np.eye(4)
    matrix = _moved(place)
    if matrix is None:
        matrix = _read_matrix(place)
    return path, isospline.read_mesh(path), matrix


def _moved(place):
    """The matrix of a translation; None if the text is not three numbers."""
    parts = place.split(",")
    with contextlib.suppress(ValueError):
        numbers = [float(part) for part in parts]
        if len(numbers) == 3 and np.isfinite(numbers).all():
            matrix = np.eye(4)
            matrix[:3, 3] = numbers
            return matrix
    if len(parts) > 1 and not os.path.exists(place):
        raise ValueError(f"--mesh: expected FILE@x,y,z or FILE@MATRIX, got {place!r} after the @")
    return None


def _read_matrix(path):
    """Four rows of four numbers, from a text file or a file of NumPy."""
    try:
        if path.lower().endswith(".npy"):
            matrix = np.load(path, allow_pickle=False)
        else:
            with open(path, encoding="utf-8") as file:
                matrix = np.array([line.replace(",", " ").split() for line in file if line.strip()], dtype=float)
        matrix = np.asarray(matrix, dtype=float)
    except OSError:
        raise
    except (ValueError, TypeError, EOFError) as error:
        raise ValueError(f"{path}: cannot be read as a matrix: {error}") from None
    if matrix.shape != (4, 4):
        raise ValueError(f"{path}: expected four rows of four numbers, got shape {matrix.shape}")
    if not np.isfinite(matrix).all() or matrix[3].tolist() != [0, 0, 0, 1]:
        raise ValueError(f"{path}: expected finite numbers and the last row 0 0 0 1, got {matrix.tolist()}")
    return matrix
