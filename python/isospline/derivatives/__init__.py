"""Derivatives, in closed form, with NumPy alone: of hits, pictures, measures and distances.

Each function gives what a call finds, and the function that takes gradients by it to gradients by levels, samples,
placements, rays and cameras: a vector-Jacobian product, as in `jax.vjp`.
"""

from .hits import cast_vjp
from .measures import distance_vjp, measure_vjp
from .pictures import picture_vjp

__all__ = ["cast_vjp", "distance_vjp", "measure_vjp", "picture_vjp"]
