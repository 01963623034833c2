"""Bounds on the largest distance of the points of a surface from another one."""

from .parts import largest_distance, largest_distance_of_mesh

__all__ = ["largest_distance", "largest_distance_of_mesh"]
