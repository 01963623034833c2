"""Edges, components and volumes of triangle meshes, as arrays."""

from __future__ import annotations

import numpy as np


def open_edges(faces):
    """How many edges do not have exactly two faces with opposite directions along it; 0 for a watertight mesh.

    Parameters
    ----------
    faces : (F, 3) integer array

    Returns
    -------
    int
    """
    begin = faces.astype(np.int64).ravel()
    end = np.roll(faces, -1, axis=1).astype(np.int64).ravel()
    size = int(faces.max(initial=0)) + 1
    edges, directions = np.unique(np.minimum(begin, end) * size + np.maximum(begin, end), return_inverse=True)
    forward = np.bincount(directions, begin < end, minlength=len(edges))
    backward = np.bincount(directions, begin > end, minlength=len(edges))
    return int(np.sum((forward != 1) | (backward != 1)))


def components_of(faces, vertex_count):
    """The number of the connected component of each face, and how many there are.

    Components are numbered from 0, by their first vertices. Faces are connected by common vertices.

    Parameters
    ----------
    faces : (F, 3) integer array
    vertex_count : int

    Returns
    -------
    (F,) int64 array
    int
    """
    begin, end = np.concatenate([faces[:, :2], faces[:, 1:]]).astype(np.int64).T
    roots = roots_of(begin, end, vertex_count)
    found, labels = np.unique(roots[faces[:, 0]], return_inverse=True)
    return labels.reshape(-1), len(found)


def roots_of(begin, end, count):
    """The smallest of the points that edges connect with each of `count` points; edges begin and end at these."""
    roots = np.arange(count)
    # Each round hooks the roots of edges onto lower ones, and then makes all trees flat.
    while len(begin) > 0:
        higher, lower = np.maximum(begin, end), np.minimum(begin, end)
        np.minimum.at(roots, higher, lower)
        while not np.array_equal(flat := roots[roots], roots):
            roots = flat
        begin, end = roots[begin], roots[end]
        begin, end = begin[begin != end], end[begin != end]
    return roots


def signed_volumes(vertices, faces, labels, count):
    """The volume that each component encloses: negative if its faces are clockwise as seen from outside.

    .. math:: V = \\frac{1}{6} \\sum_i \\det(\\mathbf{a}_i, \\mathbf{b}_i, \\mathbf{c}_i)

    Parameters
    ----------
    vertices : (V, 3) float64 array
    faces, labels : (F, 3) and (F,) integer arrays
    count : int
        How many components there are.

    Returns
    -------
    (count,) float64 array
    """
    first, second, third = (vertices - vertices.mean(axis=0))[faces].transpose(1, 0, 2)
    return np.bincount(labels, np.einsum("ij,ij->i", first, np.cross(second, third)) / 6, minlength=count)


def equal_rows(rows):
    """The first one of each group of equal rows, and the group of each row. Faster than `np.unique` of rows."""
    groups = np.zeros(len(rows), np.int64)
    for column in rows.T:
        values, places = np.unique(column + 0.0, return_inverse=True)  # -0.0 + 0.0 is 0.0
        _, groups = np.unique(groups * len(values) + places, return_inverse=True)
    return np.unique(groups, return_index=True)[1], groups
