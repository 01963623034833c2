"""Volumes and meshes of other libraries, as methods of `Volume`, `Mesh` and `Isosurface`. Each has its own module.

A library is only imported when a method that needs it is called.
"""
