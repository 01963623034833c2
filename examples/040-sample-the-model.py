"""The model between the samples: values, gradients and Hessians, compared with the formula of the samples."""

import numpy as np

import isospline
from isospline import volumes


def main(samples: int = 64, size: object = None, folder: str = "out") -> dict[tuple[int, int], float]:
    field = volumes.waves(frequency=10)
    data = field.values(samples)
    # Away from the border, where the formula differs from the boundary rule.
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (1000, 3))

    exact = {0: field.value(points), 1: field.gradient(points), 2: field.hessian(points)}
    errors: dict[tuple[int, int], float] = {}
    for degree in range(1, 6):
        volume = isospline.Volume(data, **field.grid(samples), degree=degree)
        for derivative in range(min(degree, 3)):
            error = np.abs(volume.sample(points, derivative=derivative) - exact[derivative]).max()
            errors[degree, derivative] = error / np.abs(exact[derivative]).max()
            print(f"degree {degree}, derivative {derivative}: relative error {errors[degree, derivative]:.1e}")
    return errors


if __name__ == "__main__":
    main()
