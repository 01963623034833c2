"""Pictures from Dask clusters on this machine, and a model of larger ones from their costs."""

import pickle
import tempfile
from pathlib import Path

import numpy as np
from suite import subjects
from suite.clock import spread, take_turns, timed
from suite.goal import at_least
from suite.peers import Skipped
from suite.simulation import Network, Work, efficiency, enlarged, makespan
from suite.tables import markdown_table, with_spread
from suite.views import whole_camera

import isospline

TITLE = "Many machines"
ABOUT = """The heart of `isospline.volumes` in stores, whole view with Phong, 16 rays per pixel, from Python.
Measured are `isospline.distributed.render` on clusters of one and two worker processes with one thread each, warm and
with the cluster running, by tiles and by 8 parts of the volume; *efficiency* is half the time of one worker over that
of two. The pictures are compared with that of `isospline.render`, bit for bit. Costs of single tiles are measured in
one process with one thread: *cold* reads chunks and makes bricks, for *warm* they exist. The tables of larger clusters
are modelled; docs/distributed.md explains the model."""
SETTINGS = ("size", "growth_sizes", "repetitions")
GOALS = [("efficiency of 2 workers, by tiles, warm", "at least 0.8 times")]

LIMIT = 2_000_000_000
TILE = 128
SMALLEST, LARGEST = 64, 512  # samples along each axis of a store
PARTS = 8
SAMPLES = 16  # rays of a pixel, so that a tile is work for some tens of milliseconds
EMPTY_TASKS = 500

#: The modelled clusters, and volumes with the side of their picture.
WORKERS = (1, 2, 10, 100, 1000)
MODELLED = ((2048, 2048), (16384, 8192))


def measure(settings):
    try:
        import distributed
        import zarr  # noqa: F401
    except ImportError as error:
        raise Skipped(f"{error.name} is not installed") from None
    from isospline.distributed import cluster as clusters

    with tempfile.TemporaryDirectory() as folder:
        sizes = [size for size in settings.growth_sizes if SMALLEST <= size <= LARGEST]
        for size in sizes:
            (subject,) = subjects.procedural(("heart",), (size,))
            store = Path(folder) / f"{size}.zarr"
            isospline.convert(subject.data, store, **subject.grid)
            yield costs(subject, size, store, settings) | clusters_on(
                subject, store, settings, clusters, distributed, by_parts=size == sizes[-1]
            )


def clusters_on(subject, store, settings, clusters, distributed, by_parts):
    """Times of pictures from one and two workers."""
    from isospline.distributed import tasks

    scene = tasks.open_scene(str(store), subject.level, LIMIT)
    camera = whole_camera(scene, settings.size)
    expected = isospline.render(scene, camera, size=settings.size, samples=SAMPLES, light="phong")
    ways = ("tiles", "parts") if by_parts else ("tiles",)
    seconds, overhead = {}, None
    for workers in (1, 2):
        with clusters.local_cluster(workers, LIMIT) as cluster, distributed.Client(cluster) as client:
            client.run(isospline.set_thread_count, 1)
            if workers == 1:
                client.gather(client.map(abs, range(EMPTY_TASKS), pure=False))
                overhead = timed(lambda: client.gather(client.map(abs, range(EMPTY_TASKS), pure=False)))[0]
            calls = {
                f"{by} {workers}": lambda by=by: isospline.distributed.render(
                    scene,
                    camera,
                    client=client,
                    size=settings.size,
                    samples=SAMPLES,
                    light="phong",
                    tile_size=(TILE, TILE),
                    by=by,
                    parts=PARTS if by == "parts" else None,
                )
                for by in ways
            }
            found, pictures = take_turns(calls, settings.repetitions)
            assert all(picture == expected for picture in pictures.values())
            seconds |= {name: spread(times) for name, times in found.items()}
    return {"seconds": seconds, "overhead_seconds": overhead / EMPTY_TASKS}


def costs(subject, size, store, settings):
    """Seconds, bytes read and bytes of the image for every tile, in this process."""
    from isospline.distributed import tasks
    from isospline.distributed.windows import split

    isospline.set_thread_count(1)
    open_seconds, scene = timed(lambda: tasks.open_scene(str(store), subject.level, LIMIT))
    camera = whole_camera(scene, settings.size)
    volume = scene.object(scene.ids[0]).volume
    picture = (scene, {"size": settings.size, "samples": SAMPLES})
    windows = split((0, 0, *settings.size), (TILE, TILE))
    found = {"cold": [], "warm": [], "read": [], "result": []}
    for temperature in ("cold", "warm"):
        for window in windows:
            before = volume.paging["bytes_read"]
            seconds, image = timed(lambda window=window: tasks.render_window(picture, camera, window, None))
            found[temperature].append(seconds)
            if temperature == "cold":
                found["read"].append(volume.paging["bytes_read"] - before)
                found["result"].append(len(pickle.dumps(image, protocol=5)))
    isospline.set_thread_count(0)
    return {
        "subject": subject.name,
        "size": size,
        "pixels": list(settings.size),
        "open_seconds": open_seconds,
        "tiles": found,
    }


def efficiency_of_two(result, by="tiles"):
    return result["seconds"][f"{by} 1"]["median"] / (2 * result["seconds"][f"{by} 2"]["median"])


def goals(results):
    return [at_least(GOALS[0][0], 0.8, {result["subject"]: efficiency_of_two(result) for result in results})]


def modelled(results, size, side):
    """The work of a picture with this number of pixels along each side, from measured costs."""
    results = sorted(results, key=lambda result: result["size"])
    base = results[-1]
    columns = -(-base["pixels"][0] // TILE)
    times = max(side // base["pixels"][0], 1)
    # Warm: a ray costs a + b log2(samples along an axis). Opening: a + b samples.
    rays = grown(results, np.log2, [sum(result["tiles"]["warm"]) for result in results], size)
    opening = grown(results, lambda side: side**3.0, [result["open_seconds"] for result in results], size)
    # Cold: what is read grows with the area of the surface in chunks. A tile of an enlarged picture sees its share.
    warm, cold, read = (np.array(base["tiles"][name]) for name in ("warm", "cold", "read"))
    making = max(cold.sum() - warm.sum(), 0.0) / max(read.sum(), 1)
    area = (size / base["size"]) ** 2
    tile_read = enlarged(read * area / times**2, columns, times)
    return Work(
        seconds=enlarged(warm * rays, columns, times) + making * tile_read,
        read=tile_read,
        result=enlarged(np.array(base["tiles"]["result"], float), columns, times),
        start_seconds=base["open_seconds"] * opening,
        start_read=size**3 / 64,
        overhead=base["overhead_seconds"],
    )


def grown(results, of_size, values, size):
    """The value of a line through all values at a larger size, divided by the last value; at least 1."""
    if len(results) < 2:
        return 1.0
    at = np.array([of_size(np.float64(result["size"])) for result in results])
    slope, constant = np.polyfit(at / at[-1], values, 1)
    return max((constant + slope * of_size(np.float64(size)) / at[-1]) / (constant + slope), 1.0)


def table(results):
    rows = []
    for result in results:
        tiles = result["tiles"]
        rows.append(
            (
                result["subject"],
                f"{result['open_seconds']:.3g}",
                f"{sum(tiles['cold']):.3g}",
                f"{sum(tiles['warm']):.3g}",
                f"{sum(tiles['read']) / 1e6:.3g}",
                f"{1e3 * result['overhead_seconds']:.3g}",
                with_spread(result["seconds"]["tiles 1"]),
                with_spread(result["seconds"]["tiles 2"]),
                f"{efficiency_of_two(result):.2f}",
                f"{efficiency_of_two(result, 'parts'):.2f}" if "parts 1" in result["seconds"] else "-",
            )
        )
    header = (
        "volume",
        "open, s",
        "tiles cold, s",
        "tiles warm, s",
        "read, MB",
        "Dask, ms a task",
        "1 worker, s",
        "2 workers, s",
        "efficiency",
        "by parts",
    )
    return markdown_table(header, rows) + "\n\nModelled:\n\n" + model_table(results)


def model_table(results):
    network = Network()
    rows = []
    for size, side in MODELLED:
        work = modelled(results, size, side)
        for workers in WORKERS:
            rows.append(
                (
                    f"{size}^3",
                    f"{side} x {side}",
                    workers,
                    f"{makespan(work, workers, network):.4g}",
                    f"{efficiency(work, workers, network):.2f}",
                )
            )
    return markdown_table(("volume", "pixels", "workers", "seconds", "efficiency"), rows)
