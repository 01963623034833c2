"""The edge of Embree's boxes: from a box for each cell of the shell, the literal design, to one for 16^3 cells."""

from suite import native, peers
from suite.clock import rates, spread
from suite.tables import markdown_table, with_spread

TITLE = "Edge of Embree's boxes"
ABOUT = """The same scene with boxes of 1, 2, 4, 8 and 16 cells along each axis (`research.scene`), from C++. Measured
are a change of the level up to the first ray with all cores, packets of primary rays of the whole view and the single
rays of *Incoherent rays* on one thread, and the memory of the scene without the surface after these packets. With an
edge of 1, Embree's tree reaches down to the cells that straddle the level, and only the slab is tested inside a box:
the literal design. All edges give the same hits. The default is 16: a level change costs as much as building its boxes,
and rays lose nothing."""
SETTINGS = ("size", "incoherent_rays", "repetitions")
GOALS = []
EDGES = (1, 2, 4, 8, 16)
WHAT = ("first_ray", "packets", "ambient")


def measure(settings):
    peers.require_vtk()
    for subject in settings.subjects():
        found = native.measure(subject, settings, [f"box_edge/{what}/{edge}" for what in WHAT for edge in EDGES])
        for edge in EDGES:
            first_ray, packets, ambient = (found[f"box_edge/{what}/{edge}"] for what in WHAT)
            yield {
                "subject": subject.name,
                "edge": edge,
                "seconds": spread(first_ray["seconds"]),
                "memory": packets["memory"],
                "mray_per_second": {
                    name: rates(int(result["rays"]), result["seconds"])
                    for name, result in (("packets", packets), ("ambient", ambient))
                },
            }


def goals(_):
    return []


def table(results):
    rows = [
        (
            result["subject"],
            result["edge"],
            with_spread(result["seconds"], 1e3),
            *(with_spread(result["mray_per_second"][what]) for what in ("packets", "ambient")),
            result["memory"] / 1e6,
        )
        for result in results
    ]
    header = ("volume", "edge, cells", "first ray, ms", "packets, Mray/s", "incoherent, Mray/s", "scene, MB")
    return markdown_table(header, rows)
