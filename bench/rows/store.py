"""Pictures of volumes that stay on disk. This row runs only when it is named, because it needs 45 GB of disk."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from suite.clock import spread
from suite.goal import at_most
from suite.subjects import Subject
from suite.tables import markdown_table, with_spread
from suite.tiled_store import EDGE, make_tile_store, write_tiled_store

import isospline

TITLE = "Out of core"
ABOUT = """A store of 256^3 samples of a CT volume, repeated up to 8 times along each axis: 2048^3 samples, 34 GB of
coefficients. The pictures have 1024 x 1024 pixels, Phong's model and the finest level of detail. They show the whole
volume, or a part 64 samples wide. Each is rendered from Python with all cores, in a separate process, with a limit of
2.5 GB. *Cold*: the files are not in the system's cache. *Warm*: directly afterwards in the same process with a new
surface; bricks are made again, and chunks come from memory or from the system's cache. *Peak* is the largest memory of
the process."""
SETTINGS = ("store_tiles", "size", "repetitions")
GOALS = [("2048^3: memory of the process, whole view and close view", "at most 4 GB")]

#: Limit in bytes for chunks and bricks, without Embree's index and pictures.
LIMIT = 2_500_000_000


def measure(settings):
    for subject in settings.subjects():
        if subject.name == "engine" or settings.volumes == "none":
            break
    with tempfile.TemporaryDirectory(prefix="isospline-store-", dir=os.environ.get("ISOSPLINE_STORES")) as folder:
        tile = Path(folder) / "tile.zarr"
        make_tile_store(subject.data, tile)
        for count in settings.store_tiles:
            path = Path(folder) / f"{count}.zarr"
            write_tiled_store(tile, path, count)
            for view in ("whole", "close"):
                runs = [in_a_process(path, subject, view, settings) for _ in range(min(2, settings.repetitions))]
                yield {
                    "subject": subject.name,
                    "samples": count * EDGE,
                    "view": view,
                    "seconds": {key: spread([run[key]["seconds"] for run in runs]) for key in ("cold", "warm")},
                    "open_seconds": spread([run["open_seconds"] for run in runs]),
                    **{key: runs[-1]["cold"][key] for key in ("bytes_read", "bricks_made", "bricks_dropped")},
                    "hit": runs[-1]["hit"],
                    "peak": max(run["peak"] for run in runs),
                }
            remove(path)


def in_a_process(path, subject: Subject, view, settings):
    arguments = [str(path), repr(subject.level), view, *map(str, settings.size)]
    code = "import sys; sys.path.insert(0, sys.argv.pop(1)); from rows import store; store.main(sys.argv[1:])"
    command = [sys.executable, "-c", code, str(Path(__file__).parents[1]), *arguments]
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, encoding="utf-8").stdout)


def main(arguments):
    """Print the measurements of one process."""
    import time

    from .prefilter import memory_of_process

    path, level, view, *size = arguments
    size = tuple(map(int, size))
    forget(path)
    start = time.perf_counter()
    volume = isospline.open_volume(path, memory_limit=LIMIT)
    isospline.Isosurface(volume, float(level))
    found = {"open_seconds": time.perf_counter() - start}
    camera = camera_of(volume, view)
    for name in ("cold", "warm"):
        before = volume.paging
        start = time.perf_counter()
        surface = isospline.Isosurface(volume, float(level))
        image = isospline.render(isospline.Scene([surface]), camera, size=size, light="phong")
        after = volume.paging
        found[name] = {"seconds": time.perf_counter() - start}
        found[name] |= {
            key: after[key] - before[key] for key in ("bytes_read", "chunks_read", "bricks_made", "bricks_dropped")
        }
        del surface
    found["hit"] = float((image.color[..., 3] > 0).mean())
    found["peak"] = memory_of_process("VmHWM")
    print(json.dumps(found))


def camera_of(volume, view):
    """An oblique view of the whole from outside, or of 64 samples in front of the middle of a face."""
    lower, upper = volume.bounds
    middle, extent = (lower + upper) / 2, upper - lower
    if view == "whole":
        return isospline.PerspectiveCamera(middle + extent * (0.9, -1.6, 0.7), middle, field_of_view=40)
    target = middle - (0, extent[1] / 2, 0)
    return isospline.PerspectiveCamera(target + (20.0, -90.0, 30.0), target, field_of_view=40)


def forget(path):
    """Ask the system to drop the files of a store from its cache."""
    os.sync()
    for file in Path(path).rglob("*"):
        if file.is_file():
            number = os.open(file, os.O_RDONLY)
            os.posix_fadvise(number, 0, 0, os.POSIX_FADV_DONTNEED)
            os.close(number)


def remove(path):
    import shutil

    shutil.rmtree(path)


def goals(results):
    largest = max(result["samples"] for result in results)
    peaks = {result["view"]: result["peak"] / 1e9 for result in results if result["samples"] == largest}
    return [at_most(GOALS[0][0], 4, {f"{view}, {largest}^3": peak for view, peak in peaks.items()}, "GB")]


def table(results):
    rows = [
        (
            f"{result['samples']}^3",
            result["view"],
            with_spread(result["open_seconds"]),
            with_spread(result["seconds"]["cold"]),
            with_spread(result["seconds"]["warm"]),
            result["bytes_read"] / 1e6,
            result["bricks_made"],
            result["bricks_dropped"],
            result["peak"] / 1e9,
        )
        for result in results
    ]
    header = (
        "samples",
        "view",
        "open, s",
        "cold, s",
        "warm, s",
        "read, MB",
        "bricks made",
        "bricks dropped",
        "peak, GB",
    )
    return markdown_table(header, rows)
