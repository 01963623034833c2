"""Incoherent rays: the directions of ambient occlusion, as single rays, against triangles."""

import numpy as np

import isospline
from suite import peers, polygons
from suite.clock import rates, take_turns
from suite.goal import at_least
from suite.tables import markdown_table
from suite.views import from_the_surface, in_tiles, whole_camera

TITLE = "Incoherent rays"
ABOUT = """From where the primary rays of the whole view hit, a hundredth of a voxel in front of the surface, in
directions of density cos / pi about the normal: one ray after the other (`coherent=False`). The mesh has rays of its
own, from its own hits, with the same random numbers; its triangles are decided as under *Primary rays*."""
GOALS = [("incoherent single rays against single-ray triangles", "at least 0.6 times")]


def measure(settings):
    peers.require_vtk()
    isospline.set_thread_count(settings.threads)
    for subject in settings.subjects():
        volume = isospline.Volume(subject.data, **subject.grid)
        scenes = {
            "isosurface": isospline.Scene([isospline.Isosurface(volume, subject.level)]),
            "triangles": polygons.mesh_scene(subject, volume.affine)[0],
        }
        primary = in_tiles(whole_camera(scenes["isosurface"], settings.size).rays(settings.size))
        calls, hit = {}, {}
        for name, scene in scenes.items():
            hits = scene.cast_rays(primary, coherent=True)
            rays = from_the_surface(primary, hits, settings.incoherent_rays, np.random.default_rng(0),
                                    0.01 * volume.spacing.min())  # fmt: skip
            calls[name, "cast_rays"] = lambda s=scene, r=rays: s.cast_rays(r, coherent=False)
            calls[name, "test_occlusions"] = lambda s=scene, r=rays: s.test_occlusions(r)
        seconds, answers = take_turns(calls, settings.repetitions)
        for name in scenes:
            occluded = answers[name, "test_occlusions"]
            hits = np.isfinite(answers[name, "cast_rays"]["t_hit"])
            assert np.array_equal(occluded, hits), f"hits and occlusions of {name} differ"
            hit[name] = float(occluded.mean())
        yield {
            "subject": subject.name, "rays": settings.incoherent_rays, "occluded": hit,
            "mray_per_second": {
                query: {name: rates(settings.incoherent_rays, seconds[name, query]) for name in scenes}
                for query in ("cast_rays", "test_occlusions")
            },
        }  # fmt: skip


def ratio(result, query):
    both = result["mray_per_second"][query]
    return both["isosurface"]["median"] / both["triangles"]["median"]


def goals(results):
    values = {
        f"{result['subject']}, {query}": ratio(result, query)
        for result in results for query in result["mray_per_second"]
    }  # fmt: skip
    return [at_least(GOALS[0][0], 0.6, values)]


def table(results):
    rows = [
        (result["subject"], query, both["isosurface"]["median"], both["triangles"]["median"], ratio(result, query),
         f"{result['occluded']['isosurface']:.1%}, {result['occluded']['triangles']:.1%}")
        for result in results for query, both in result["mray_per_second"].items()
    ]  # fmt: skip
    return markdown_table(("volume", "query", "isosurface, Mray/s", "triangles, Mray/s", "ratio", "occluded"), rows)
