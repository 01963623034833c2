"""Primary rays: eight ways to trace the same pixels, and how many of them each gets wrong."""

import itertools
from dataclasses import dataclass

import numpy as np
from suite import judge, peers, polygons
from suite.clock import rates, take_turns, timed
from suite.goal import none_of
from suite.oracle import Oracle
from suite.tables import markdown_table, with_spread
from suite.views import CAMERAS, in_tiles

import isospline

TITLE = "Primary rays"
ABOUT = """Rays of perspective images, in the order of tiles of 4 x 4 pixels, which suits packets; all methods get the
same list, from Python. The whole view shows all of the object. The close view looks straight at its surface, from so
near that every ray hits. All rays are compared with the float64 oracle on the coefficients that isospline stores.
*Lost* rays have a crossing and no hit. *Wrong* rays have a hit and no crossing, or a hit that is more than 1e-3 voxel
away from the crossing. *Differ* compares with single exact rays. The mesh is another surface, a fraction of a voxel
away, so its hits count as wrong; its triangles are intersected exactly, in double precision. *Build* is the time from
the coefficients (triangles: from the samples, by VTK's FlyingEdges3D) to the first ray. *Memory* is that of the shell
or the mesh and of its acceleration structure, as the API reports it (see Memory). Rates include the call from Python;
*call* is the cost of a ray that misses the scene's box, with all outputs. Rates without the call are under the next
heading."""
SETTINGS = ("size", "repetitions", "threads")
GOALS = [("lost or wrong pixels of exact methods, of all by the oracle", "0")]

#: Names and descriptions.
METHODS = {
    "hop_bracket": "voxel hopping, bracket + Brent (the paper)",
    "hop_exact": "voxel hopping, exact",
    "stride_exact": "hopping with strides over empty bricks, exact",
    "embree_bracket": "Embree, single rays, bracket + Brent",
    "embree_exact": "Embree, single rays, exact",
    "packets_exact": "Embree, packets, exact",
    "triangles": "single rays, marching-cubes mesh",
    "triangle_packets": "packets, marching-cubes mesh",
}
EXACT = ("hop_exact", "stride_exact", "embree_exact", "packets_exact")


@dataclass
class Target:
    """An object that rays are cast at."""

    tracer: object  # Scene or VoxelHopper
    options: dict  # of cast_rays
    build_seconds: float
    memory: int  # bytes, with the shell or the mesh, without the coefficients

    def cast(self, rays):
        return self.tracer.cast_rays(rays, **self.options)


def build(name, subject, volume):
    """The target of a method, built from scratch."""

    def make():
        if name.startswith("triangle"):
            scene, _, memory = polygons.mesh_scene(subject, volume.affine)
            return scene, memory + scene.memory  # a scene builds itself when it is first used
        surface = isospline.research.isosurface(volume, subject.level, method=name.partition("_")[2])
        if name.startswith(("embree", "packets")):
            tracer = isospline.Scene([surface])
        else:
            tracer = isospline.research.VoxelHopper(surface, strides=name.startswith("stride"))
        return tracer, surface.shell.memory + tracer.memory

    seconds, (tracer, memory) = timed(make)
    options = {"coherent": "packets" in name} if isinstance(tracer, isospline.Scene) else {}
    return Target(tracer, options, seconds, memory)


def measure(settings):
    peers.require_vtk()
    isospline.set_thread_count(settings.threads)
    for subject in settings.subjects():
        volume = isospline.Volume(subject.data, **subject.grid)
        targets = {name: build(name, subject, volume) for name in METHODS}
        oracle = Oracle(subject.data, subject.level, volume.affine, coefficients=volume.coefficients)
        for view, make_camera in CAMERAS.items():
            camera = make_camera(targets["embree_exact"].tracer, settings.size)
            rays = in_tiles(camera.rays(settings.size))
            yield {"subject": subject.name, "view": view, "samples": list(reversed(subject.data.shape))} | compare(
                targets, rays, oracle, settings
            )


def compare(targets, rays, oracle, settings):
    seconds, hits = take_turns(
        {name: lambda t=target: t.cast(rays) for name, target in targets.items()}, settings.repetitions
    )
    t_hit = {name: hit["t_hit"] for name, hit in hits.items()}
    voxels_per_t = oracle.voxels_per_t(rays)
    t_true = oracle.first_crossings(rays)

    methods = {}
    for name, target in targets.items():
        truth = judge.differences(t_hit[name], t_true, voxels_per_t)
        against = judge.differences(t_hit[name], t_hit["embree_exact"], voxels_per_t)
        methods[name] = {
            "mray_per_second": rates(len(rays), seconds[name]),
            "build_seconds": target.build_seconds,
            "memory": target.memory,
            "oracle": truth,
            "differ": None if name.startswith("triangle") else against["lost"] + against["wrong"],
        }
    away = rays * [1, 1, 1, -1, -1, -1]
    call = min(timed(lambda: targets["packets_exact"].cast(away))[0] for _ in range(3))
    return {
        "rays": len(rays),
        "hit": float(np.isfinite(t_hit["embree_exact"]).mean()),
        "mean_hop_length": targets["hop_exact"].tracer.statistics["mean_hop_length"],
        "cells": targets["hop_exact"].tracer.surface.shell.count,
        "call_ns": call / len(rays) * 1e9,
        "methods": methods,
    }


def label(result):
    return f"{result['subject']}, {result['view']}"


def rate(result, name):
    return result["methods"][name]["mray_per_second"]["median"]


def goals(results):
    mistakes = {
        f"{label(result)}, {name}": sum(result["methods"][name]["oracle"][kind] for kind in ("lost", "wrong"))
        for result, name in itertools.product(results, EXACT)
    }
    return [none_of(GOALS[0][0], mistakes, sum(result["rays"] for result in results) * len(EXACT))]


def table(results):
    parts = []
    for result in results:
        parts.append(
            f"**{label(result)}**: {' x '.join(map(str, result['samples']))} samples, {result['cells']} cells; "
            f"{result['rays']} rays, {result['hit']:.1%} hit; call {result['call_ns']:.0f} ns a ray; "
            f"mean hop {result['mean_hop_length']:.3f} voxel\n"
        )
        rows = [
            (
                what,
                with_spread(method["mray_per_second"]),
                rate(result, name) / rate(result, "hop_bracket"),
                method["oracle"]["lost"],
                method["oracle"]["wrong"],
                method["differ"],
                method["build_seconds"],
                method["memory"] / 1e6,
            )
            for name, what in METHODS.items()
            if (method := result["methods"][name])
        ]
        header = ("method", "Mray/s", "ratio", "lost", "wrong", "differ", "build s", "MB")
        parts.append(markdown_table(header, rows) + "\n")
    return "\n".join(parts).rstrip()
