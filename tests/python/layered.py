"""Pictures with the layers that most tests look at."""

import isospline

LAYERS = ("depth", "position", "normal", "albedo", "gradient_magnitude", "geometry_ids", "primitive_ids")


def render(scene, camera, *, layers=(), **options):
    """As isospline.render, with these layers, the variance of what is path traced, and others where named."""
    traced = ("variance",) if options.get("integrator") is not None else ()
    return isospline.render(scene, camera, layers=(*LAYERS, *traced, *layers), **options)
