"""The command `isospline verify`: whether a certificate of a ray proves what it states."""

from __future__ import annotations

from ..certificates import check, model_options, read_certificate, write_coefficients
from .store import opened


def add_verify(commands, verify, add_input):
    """The command and its options."""
    command = commands.add_parser(
        "verify", help="check the certificate of a ray: what it crosses first, proven without rounding"
    )
    command.set_defaults(run=verify)
    command.add_argument("certificate", metavar="CERTIFICATE", help="the certificate, .json")
    add_input(command)
    command.add_argument(
        "--coefficients",
        metavar="OUT",
        help="also write the stored coefficients, with which certificates/checker.py checks the certificate alone",
    )


def run(arguments, read):
    """Print what is proven."""
    certificate = read_certificate(arguments.certificate)
    volume = opened(arguments, read).to_volume(**model_options(certificate))
    if arguments.coefficients:
        write_coefficients(volume, arguments.coefficients)
    check(certificate, volume)
    print(_proven(certificate))


def _proven(certificate):
    """What a certificate proves, in a sentence."""
    level, ray = certificate["model"]["level"], certificate["ray"]
    limits = f"from t = {ray['t_near']:g}" + ("" if ray["t_far"] is None else f" to {ray['t_far']:g}")
    pieces = len(certificate["cover"])
    if certificate["statement"] == "miss":
        return f"proven: the ray does not meet f = {level:g} {limits} ({pieces} pieces)"
    found = certificate[certificate["statement"]]
    where = f"between t = {found['from']!r} and {found['to']!r}"
    if certificate["statement"] == "hit":
        return f"proven: the ray first meets f = {level:g} {where}, {limits} ({pieces} pieces before it)"
    return (
        f"proven: the ray does not meet f = {level:g} before it is at most {found['bound']:g} from it {where}, {limits}"
    )
