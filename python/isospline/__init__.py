"""Isosurfaces of B-spline volume models, ray traced exactly in Embree."""
