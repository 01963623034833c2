"""The command `isospline convert`: a store of a volume of any size."""

from __future__ import annotations

import time

import isospline

from .cluster import check_place, client_of
from .given import MODEL, keywords
from .types import memory


def add_convert(commands, convert, add_reading, add_spline, numbers):
    """The command and its options."""
    command = commands.add_parser("convert", help="write a store of a volume that is larger than memory")
    command.set_defaults(run=convert)
    command.add_argument(
        "file", metavar="IN", help="a volume, a folder of slices, Zarr or N5, or a dataset of HDF5, FILE.h5:/DATASET"
    )
    command.add_argument("output", metavar="OUT", help="the store to write, such as OUT.zarr")
    command.add_argument("-q", "--quiet", action="store_true", help="show no progress")
    add_reading(command)
    group = command.add_argument_group("place")
    group.add_argument("--origin", type=numbers(3), metavar="X,Y,Z", help="instead of the file's")
    group.add_argument(
        "--direction", type=numbers(9), metavar="ROWS", help="3 x 3 numbers, instead of the file's; columns are axes"
    )
    group.add_argument("--axes", choices=("zyx", "xyz"), default="zyx", help="of an array in .npy, Zarr or HDF5")
    add_spline(command.add_argument_group("model"), range(6))
    group = command.add_argument_group("work")
    group.add_argument(
        "--no-image", dest="image", action="store_false", help="leave out the samples, which other programs show"
    )
    group.add_argument(
        "--chunk", type=int, default=32, metavar="N", help="coefficients along the edges of a chunk (default 32)"
    )
    group.add_argument(
        "--shard",
        type=int,
        metavar="N",
        help="most coefficients along the edges of a file of chunks; by default 8 chunks, if memory suffices",
    )
    group.add_argument(
        "--memory-limit",
        type=memory,
        default="2GB",
        metavar="SIZE",
        help="most memory of the process, or of each worker of --scheduler (default 2GB)",
    )
    group.add_argument(
        "--workers",
        type=int,
        metavar="N",
        help="most blocks at a time; by default one for each processor, if memory suffices",
    )
    group.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster that computes the blocks, tcp://...")
    group.add_argument("--overwrite", action="store_true", help="replace an existing store")


def run(arguments, reading, progress, say):
    """Write the store."""
    begin = time.perf_counter()
    check_place(arguments)
    names = ("axes", "origin", "chunk", "shard", "image", "memory_limit", "workers", "overwrite")
    options = {**keywords(arguments, MODEL), **{name: getattr(arguments, name) for name in names}}
    direction = arguments.direction and [arguments.direction[row : row + 3] for row in (0, 3, 6)]
    try:
        with client_of(arguments.scheduler) as client:
            path = isospline.convert(
                arguments.file,
                arguments.output,
                **options,
                **reading,
                direction=direction,
                client=client,
                progress=progress,
            )
    except KeyboardInterrupt:
        say(f"{arguments.output} is incomplete; run the same command again to continue")
        raise
    scales = isospline.store.read_metadata(path).scales
    shapes = ", ".join(" x ".join(map(str, scale.shape[::-1])) for scale in scales)
    print(f"{arguments.output}: scales of {shapes} coefficients, {time.perf_counter() - begin:.1f} s")
