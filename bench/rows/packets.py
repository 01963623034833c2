"""Packets of primary rays, called from C++: the isosurface, Embree's own triangles and the paper's hopping."""

from suite import judge, native, peers
from suite.clock import rates
from suite.goal import at_least
from suite.tables import markdown_table, with_spread

TITLE = "Packets against Embree's triangles and hopping"
ABOUT = """The primary rays of *Primary rays*, from C++ (bench/cpp, Google Benchmark), on one thread, in chunks of 4096
that share one array of hits. The isosurface's index is settled. *Triangles* are the marching-cubes mesh of the same
level (VTK's FlyingEdges3D) in an Embree scene of its own: `RTC_GEOMETRY_TYPE_TRIANGLE`, robust, coherent packets of the
machine's width; Embree intersects them in single precision. Both take double precision rays one after the other, and
return t, a unit normal and ids. The triangle's normal is computed from Embree's Ng for all lanes at once; the
isosurface's is exact. The isosurface's hits have more fields, all in double precision. *Hopping* is the paper's method,
with bracket + Brent. The numbers of rays that hit must be about the same."""
SETTINGS = ("size", "repetitions")
GOALS = [
    ("packets against Embree's own triangle packets, C++", "at least 0.7 times"),
    ("packets against the paper's hopping, C++, median", "at least 10 times"),
]
VIEWS = ("whole", "close")
WAYS = {"spline": "packets/spline", "triangles": "packets/triangles", "hopping": "hopping/spline"}


def measure(settings):
    peers.require_vtk()
    for subject in settings.subjects():
        names = [f"{name}_{view}" for view in VIEWS for name in WAYS.values()]
        found = native.measure(subject, settings, names)
        for view in VIEWS:
            of_view = {way: found[f"{name}_{view}"] for way, name in WAYS.items()}
            yield {"subject": subject.name, "view": view} | rates_and_hits(of_view, subject)


def rates_and_hits(found, subject):
    """Check that all methods measured in C++ hit about as many rays as the isosurface."""
    count = int(found["spline"]["rays"])
    hit = {way: result["hit"] for way, result in found.items()}
    judge.check_covered(hit, "spline", subject.data)
    return {
        "rays": count,
        "hit": hit["spline"],
        "mray_per_second": {way: rates(count, result["seconds"]) for way, result in found.items()},
    }


def ratio(result, other):
    rate = result["mray_per_second"]
    return rate["spline"]["median"] / rate[other]["median"]


def ratios(results, other):
    return {f"{result['subject']}, {result['view']}": ratio(result, other) for result in results}


def goals(results):
    return [
        at_least(GOALS[0][0], 0.7, ratios(results, "triangles")),
        at_least(GOALS[1][0], 10, ratios(results, "hopping"), of_median=True),
    ]


def table(results):
    rows = [
        (
            result["subject"],
            result["view"],
            f"{result['hit']:.1%}",
            *(with_spread(result["mray_per_second"][way]) for way in WAYS),
            ratio(result, "triangles"),
            ratio(result, "hopping"),
        )
        for result in results
    ]
    header = ("volume", "view", "hit", *(f"{way}, Mray/s" for way in WAYS), "of triangles", "of hopping")
    return markdown_table(header, rows)
