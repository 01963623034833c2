"""Incoherent rays: the directions of ambient occlusion, as single rays, against triangles."""

from suite import native, peers
from suite.goal import at_least
from suite.tables import markdown_table, with_spread

from .packets import rates_and_hits, ratio

TITLE = "Incoherent rays"
ABOUT = """Rays start where the primary rays of the whole view hit, a hundredth of a voxel in front of the surface, in
directions of density cos / pi about the normal. They are cast from C++ on one thread, in chunks of 4096, against
Embree's own triangles, as in the row of packets. Embree traces one ray after the other; the isosurface's settled index
has sixteen under way. The rays of the mesh start at its own hits, with the same random numbers."""
SETTINGS = ("size", "incoherent_rays", "repetitions")
GOALS = [("incoherent single rays against Embree's own triangles, C++", "at least 0.6 times")]
QUERIES = {"cast_rays": "single_rays", "test_occlusions": "occlusions"}
WAYS = ("spline", "triangles")


def measure(settings):
    peers.require_vtk()
    for subject in settings.subjects():
        names = {query: {way: f"{name}/{way}_ambient" for way in WAYS} for query, name in QUERIES.items()}
        found = native.measure(subject, settings, [name for ways in names.values() for name in ways.values()])
        for query, ways in names.items():
            of_query = {way: found[name] for way, name in ways.items()}
            yield {"subject": subject.name, "query": query} | rates_and_hits(of_query, subject)


def goals(results):
    return [
        at_least(
            GOALS[0][0],
            0.6,
            {f"{result['subject']}, {result['query']}": ratio(result, "triangles") for result in results},
        )
    ]


def table(results):
    rows = [
        (
            result["subject"],
            result["query"],
            f"{result['hit']:.1%}",
            *(with_spread(result["mray_per_second"][way]) for way in WAYS),
            ratio(result, "triangles"),
        )
        for result in results
    ]
    return markdown_table(("volume", "query", "occluded", *(f"{way}, Mray/s" for way in WAYS), "ratio"), rows)
