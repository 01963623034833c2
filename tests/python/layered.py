"""Pictures with the layers that most tests check."""

import isospline

LAYERS = ("depth", "position", "normal", "albedo", "gradient_magnitude", "geometry_ids", "primitive_ids")


def render(scene, camera, *, layers=(), **options):
    """Call isospline.render with these layers, the variance if the picture is path traced, and other named layers."""
    traced = ("variance",) if isinstance(options.get("light"), isospline.PathTracer) else ()
    return isospline.render(scene, camera, layers=(*LAYERS, *traced, *layers), **options)
