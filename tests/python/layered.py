"""Pictures with the layers that most tests check."""

import isospline

LAYERS = ("depth", "position", "normal", "albedo", "gradient_magnitude", "geometry_ids", "primitive_ids")


def render(scene, camera, *, layers=(), **options):
    """Call isospline.render in Phong's light, unless there is another, with these layers and other named ones.

    A path traced picture has the variance, too.
    """
    options.setdefault("light", "phong")
    traced = ("variance",) if isinstance(options.get("light"), isospline.PathTracer) else ()
    return isospline.render(scene, camera, layers=(*LAYERS, *traced, *layers), **options)
