"""Certificates: proofs of what rays meet, as data that a small program checks; it needs nothing of isospline."""

from __future__ import annotations

import json
import operator
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..base.handed import known
from . import checker
from .checker import CertificateError
from .prover import Prover, describe_volume

if TYPE_CHECKING:
    from os import PathLike

    from ..scene import Volume

__all__ = ["CertificateError", "check", "write_coefficients"]


def certificate(self, ray, t_near, t_far, geometry_id):
    """See `Scene.certificate`."""
    numbers = _core._as_array(ray, "ray").astype(float)
    if numbers.shape != (6,) or not np.isfinite(numbers).all() or not numbers[3:].any():
        raise ValueError(f"ray: expected six finite numbers, with a direction that is not zero, got {_shown(numbers)}")
    try:
        t_near, t_far = float(t_near), float(t_far)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"t_near: expected numbers for t_near and t_far, got {t_near!r} and {t_far!r}") from None
    if not (isfinite(t_near) and t_near <= t_far):
        raise ValueError(f"t_near: expected a finite number that is at most t_far, got {t_near} and {t_far}")
    surface, transform = _one_isosurface(self, geometry_id)
    alone = known("Scene")([(surface, transform)])
    found = alone.cast_rays(numbers, certify=True, t_near=t_near, t_far=t_far)  # rejects other surfaces too
    prover = Prover(surface, transform, numbers.tolist(), (t_near, t_far), found.t_bounds.tolist())
    return prover.certificate()


def check(certificate: dict[str, Any], volume: Volume) -> None:
    """Check a certificate against a volume: with rational numbers, without rounding.

    Parameters
    ----------
    certificate : dict
        A certificate, as `Scene.certificate` returns it or `json.load` reads it.
    volume : Volume
        The volume of the isosurface.

    Raises
    ------
    CertificateError
        If the certificate does not prove its statement, or if it is about another volume.
    """
    _check_volume(volume)
    try:
        for name, value in describe_volume(volume).items():
            if certificate["model"][name] != value:
                raise CertificateError(f"the {name} is not that of the volume")
        checker.check(certificate, memoryview(volume._stored_coefficients.reshape(-1).data))
    except CertificateError as error:
        raise CertificateError(f"certificate: expected one that proves its statement, but {error}") from None
    except (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError) as error:
        raise CertificateError(f"certificate: expected one of version 1, got a damaged one ({error!r})") from None


def _check_volume(volume):
    if not isinstance(volume, _core.Volume):
        raise TypeError(f"volume: expected a Volume, got {type(volume).__name__}")


def write_coefficients(volume: Volume, path: str | PathLike[str]) -> None:
    """Write the stored coefficients of a volume, for `checker` alone: float32, little-endian, x fastest, no header.

    ``python checker.py certificate.json coefficients.f32`` needs neither isospline nor NumPy.

    Parameters
    ----------
    volume : Volume
    path : path
        The file to write.
    """
    _check_volume(volume)
    output = _core.OutputFile(path)
    try:
        volume._stored_coefficients.astype("<f4").tofile(output.temporary)
        output.commit()
    finally:
        output.discard()


def read_certificate(path):
    """The certificate in a JSON file."""
    with open(path, encoding="utf-8") as file:
        try:
            return json.load(file)
        except (RecursionError, ValueError) as error:
            raise CertificateError(f"{path}: expected a certificate in JSON, got {error}") from None


def model_options(certificate):
    """The options of `Volume` for the model of a certificate."""
    try:
        return {name: certificate["model"][name] for name in ("degree", "boundary", "filter", "smoothing")}
    except (LookupError, TypeError) as error:
        raise CertificateError(f"certificate: expected one of version 1, got a damaged one ({error!r})") from None


def _one_isosurface(scene, geometry_id):
    """The isosurface of an id, or the only visible one, and its place."""
    if geometry_id is not None:
        if not hasattr(geometry_id, "__index__"):
            raise TypeError(f"geometry_id: expected an int, got {geometry_id!r}")
        geometry_id = operator.index(geometry_id)
        if geometry_id not in scene:
            raise ValueError(f"geometry_id: expected an id of the scene, got {geometry_id}")
    chosen = [
        (item, transform)
        for id, item, transform, visibility in scene._placed_objects()
        if (id == geometry_id if geometry_id is not None else visibility.visible)
    ]
    if len(chosen) != 1:
        raise ValueError(f"geometry_id: expected the id of an isosurface, because {len(chosen)} objects are visible")
    if not isinstance(chosen[0][0], _core.Isosurface):
        raise ValueError("geometry_id: expected the id of an isosurface, got that of a mesh")
    return chosen[0]


def _shown(numbers):
    return f"an array of shape {numbers.shape}" if numbers.shape != (6,) else str(numbers.tolist())
