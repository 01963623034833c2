"""The six ways to trace a subject, each built from scratch and timed."""

import time
from dataclasses import dataclass

import numpy as np

import isospline

#: Name, and what it is; the first one is what the others are compared with.
METHODS = {
    "hop_bracket": "voxel hopping, bracket + Brent (the paper)",
    "hop_exact": "voxel hopping, exact",
    "stride_exact": "hopping with strides over empty bricks, exact",
    "embree_bracket": "Embree, bracket + Brent",
    "embree_exact": "Embree, exact",
    "embree_triangles": "Embree, triangles of the marching-cubes mesh",
}
BASELINE = "hop_bracket"


@dataclass
class Tracer:
    """Something to cast rays at."""

    target: object  # Scene or VoxelHopper
    build_seconds: float  # from the coefficients or, for triangles, from the samples
    memory: int  # bytes, those of the shell or the mesh included, the coefficients not


def marching_cubes(subject, affine):
    """The triangle mesh of the samples, in world space; float32 as scikit-image has it."""
    from skimage import measure

    data = np.asarray(subject.data, dtype=np.float32)
    vertices, faces, _, _ = measure.marching_cubes(data, subject.level, allow_degenerate=False)
    return vertices[:, ::-1] @ affine[:3, :3].T.astype(np.float32) + affine[:3, 3].astype(np.float32), faces


def build(name, subject, volume):
    """The tracer of a method."""
    start = time.perf_counter()
    if name == "embree_triangles":
        vertices, faces = marching_cubes(subject, volume.affine)
        target = isospline.Scene([isospline.Mesh(vertices, faces)])
        inputs = vertices.nbytes + faces.nbytes
    else:
        surface = isospline.Isosurface(volume, subject.level, method=name.partition("_")[2])
        inputs = surface.shell.memory
        if name.startswith("embree"):
            target = isospline.Scene([surface])
        else:
            target = isospline.VoxelHopper(surface, strides=name.startswith("stride"))
    memory = inputs + target.memory  # a scene builds itself when first asked
    return Tracer(target, time.perf_counter() - start, memory)


def measure(tracers, rays, repetitions):
    """Seconds that each tracer takes for the rays, as lists: the methods take turns, so that whatever else the machine
    does falls on all of them. Also the hits of each."""
    hits = {name: tracer.target.cast_rays(rays) for name, tracer in tracers.items()}  # warms up as well
    seconds = {name: [] for name in tracers}
    for repetition in range(repetitions):
        names = list(tracers)
        for name in names if repetition % 2 == 0 else reversed(names):
            start = time.perf_counter()
            tracers[name].target.cast_rays(rays)
            seconds[name].append(time.perf_counter() - start)
    return seconds, hits
