"""A picture against the rays that it needs, both called from C++."""

from suite import native, peers
from suite.clock import spread
from suite.goal import at_most
from suite.tables import markdown_table, with_spread

TITLE = "render() against its rays"
ABOUT = """`render` of the whole view with Phong against `cast_rays` of the same rays in coherent chunks, both from
C++ on one thread (bench/cpp/render.bench.cpp)."""
SETTINGS = ("size", "repetitions")
GOALS = [("render() with Phong against cast_rays of the same rays, C++", "at most 1.25 times")]
WAYS = {"render": "render/phong_whole", "rays": "packets/spline_whole"}


def measure(settings):
    peers.require_vtk()
    for subject in settings.subjects():
        found = native.measure(subject, settings, WAYS.values())
        yield {
            "subject": subject.name,
            "pixels": list(settings.size),
            "seconds": {way: spread(found[name]["seconds"]) for way, name in WAYS.items()},
        }


def ratio(result):
    return result["seconds"]["render"]["median"] / result["seconds"]["rays"]["median"]


def goals(results):
    return [at_most(GOALS[0][0], 1.25, {result["subject"]: ratio(result) for result in results}, "times")]


def table(results):
    rows = [
        (result["subject"], *(with_spread(result["seconds"][way], 1e3) for way in WAYS), ratio(result))
        for result in results
    ]
    return markdown_table(("volume", *(f"{way}, ms" for way in WAYS), "ratio"), rows)
