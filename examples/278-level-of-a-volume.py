"""Inverse measuring: the level at which a part has the volume that was found by weighing it, by Newton's method."""

import numpy as np

import isospline
from isospline import volumes
from isospline.derivatives import measure_vjp


def main(samples: int = 48, size: object = None, folder: str = "out", steps: int = 4) -> float:
    # A ring, in cm, at an uncertain level. It weighs 5.4 g and is of steel, 7.85 g/cm^3.
    major, minor, weighed = 0.6, 0.25, 5.4 / 7.85
    field = volumes.torus(major, minor)
    surface = isospline.Isosurface(field.volume(samples), field.level)

    for step in range(steps):
        measures, vjp = measure_vjp(surface)
        off = measures["enclosed_volume"] - weighed
        print(f"step {step}: level {surface.level:.9f}, volume off by {abs(off / weighed):.1e}")
        surface = surface.with_level(surface.level - off / vjp(enclosed_volume=1.0, samples=False)["level"])
    exact = minor**2 - weighed / (2 * np.pi**2 * major)
    print(f"level {surface.level:.9f}, of the torus {exact:.9f}")

    measures, vjp = measure_vjp(surface)
    by_volume, by_area = vjp(enclosed_volume=1.0), vjp(area=1.0)
    largest = np.unravel_index(np.abs(by_volume["samples"]).argmax(), surface.volume.shape)
    place = tuple(map(int, largest))
    for name, by in (("enclosed_volume", by_volume), ("area", by_area)):
        print(
            f"{name} {measures[name]:.6f}: {by['level']:.4f} by the level, {by['samples'][place]:.6f} by sample {place}"
        )
    return float(abs(measures["enclosed_volume"] / weighed - 1))


if __name__ == "__main__":
    main()
