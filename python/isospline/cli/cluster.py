"""Rendering on many processes or machines from the command line."""

from __future__ import annotations

import contextlib
from typing import Any

from .. import PathTracer, distributed
from ..distributed.cluster import dask_distributed
from .given import flag, given
from .light_options import LIMITS
from .limits import DEFAULT_SAMPLES
from .types import count


def add_cluster_options(group):
    """The options for a cluster."""
    group.add_argument("--workers", type=count, metavar="N", help="render with N processes of this machine")
    group.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="render with the workers of a Dask scheduler, such as tcp://10.0.0.1:8786; they open a store at the same "
        "path; other volumes are sent to them",
    )


def wants_cluster(arguments):
    """Whether pictures come from a cluster; checks for options that are not allowed with one."""
    if arguments.workers is None and arguments.scheduler is None:
        return False
    check_place(arguments)
    name = "--workers" if arguments.scheduler is None else "--scheduler"
    for option in given(arguments, (*LIMITS, "threads")):
        raise ValueError(f"{flag(option)} cannot be combined with {name}")
    return True


def check_place(arguments):
    """Check that there is one place for the work."""
    if arguments.workers is not None and arguments.scheduler is not None:
        raise ValueError("--workers cannot be combined with --scheduler")


def cluster_images(scene, cameras, options, arguments, progress):
    """The image of each camera; options are those of `render`."""
    if isinstance(options["light"], PathTracer) and arguments.samples is None:
        options = {**options, "samples": DEFAULT_SAMPLES}
    with _place(arguments) as place:
        if len(cameras) == 1:
            yield distributed.render(scene, cameras[0], progress=progress, **place, **options)
            return
        images: Any = distributed.render_batch(scene, [{"camera": camera} for camera in cameras], **place, **options)
        with contextlib.closing(images):
            for number, image in enumerate(images):
                progress((number + 1) / len(cameras))
                yield image


@contextlib.contextmanager
def _place(arguments):
    """Where to render, as arguments of `distributed.render`."""
    with client_of(arguments.scheduler) as client:
        yield {"workers": arguments.workers} if client is None else {"client": client}


@contextlib.contextmanager
def client_of(scheduler):
    """The client of the cluster with a scheduler at this address, or None without an address."""
    if scheduler is None:
        yield None
        return
    Client = dask_distributed().Client
    client = Client.__new__(Client)  # in two steps: a client that could not connect must be closed, too
    with contextlib.closing(client):
        try:
            client.__init__(scheduler, timeout=10)
        except (OSError, ValueError, TimeoutError, MemoryError) as error:  # the last where something else answers
            raise ValueError(f"--scheduler: expected the address of a Dask scheduler, got {scheduler}") from error
        yield client
