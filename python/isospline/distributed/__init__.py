"""Rendering on many processes or machines, with Dask. Pictures are the same as on one, bit for bit."""

from .rendering import render, render_batch

__all__ = ["render", "render_batch"]
