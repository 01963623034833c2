"""Inverse rendering: the pose of a bone from its outlines in two views, as in biplane X-ray, by quasi-Newton steps."""

import numpy as np

import isospline
from isospline.derivatives import picture_vjp


def bone(samples: int) -> isospline.Isosurface:
    # A soft union of balls, 59 mm long: a bent shaft with unequal ends.
    z, y, x = np.meshgrid(*[np.linspace(-36, 36, samples)] * 3, indexing="ij")
    balls = [(9.0, 9, -20, 8), (8, -8, -22, 7), (-2, 2, -21, 8), (14, -3, 21, 9), (3, 9, 18, 6), (0, -4, 24, 6)]
    balls += [(t * t / 50, 0, t, 5) for t in range(-20, 21, 4)]
    union = sum(np.exp((r * r - (x - a) ** 2 - (y - b) ** 2 - (z - c) ** 2) / 30) for a, b, c, r in balls)
    volume = isospline.Volume(np.log(union + 1e-9), spacing=(72 / (samples - 1),) * 3, origin=(-36,) * 3)
    return isospline.Isosurface(volume, 0.0)


def motion(six: np.ndarray) -> np.ndarray:
    # Rodrigues' formula for a rotation vector, with a translation.
    angle, cross, matrix = np.linalg.norm(six[:3]), np.cross(np.eye(3), six[:3]), np.eye(4)
    matrix[:3, :3] += np.sinc(angle / np.pi) * cross + np.sinc(angle / (2 * np.pi)) ** 2 / 2 * (cross @ cross)
    matrix[:3, 3] = six[3:]
    return matrix


def main(samples: int = 48, size: tuple[int, int] = (48, 48), folder: str = "out", steps: int = 20) -> float:
    surface, true = bone(samples), motion(np.array([0.3, -0.2, 0.4, 2, -1, 3]))
    points = np.insert(surface.sample_points(1000).points, 3, 1, axis=1)
    cameras = [isospline.PerspectiveCamera(eye, (0, 0, 0), field_of_view=5) for eye in ((1e3, 0, 0), (0, 1e3, 0))]
    masks = [picture_vjp(isospline.Scene([(surface, true)]), each, size, samples_per_pixel=64)[0] for each in cameras]
    # A wide blur of the errors, so that the outlines find each other from afar.
    across, down = (np.linalg.matrix_power((2 * np.eye(n) + np.eye(n, k=1) + np.eye(n, k=-1)) / 4, 8) for n in size)
    # The search begins 5 degrees and 5 mm off. Its numbers are mm: those of rotations, at a distance of 20.
    pose = motion(np.array([np.radians(5), np.radians(-5), np.radians(5), 5, -5, -5]) / np.sqrt(3)) @ true
    units, change, before, inverse, error = np.repeat([1 / 20, 1], 3), np.zeros(6), np.zeros(6), np.eye(6), np.inf
    for step in range(steps):
        gradient, scene = np.zeros(6), isospline.Scene([(surface, pose)])
        for camera, mask in zip(cameras, masks):
            picture, vjp = picture_vjp(scene, camera, size, samples_per_pixel=16, seed=step + 1)
            by_matrix = vjp(down @ (picture - mask) @ across, samples=False)["transforms"][0][:3]
            gradient += units * np.append(np.cross(pose[:3].T, by_matrix.T).sum(axis=0), by_matrix[:, 3])
        # The method of Broyden, Fletcher, Goldfarb and Shanno, in steps of at most 3 mm, later less.
        if (gain := change @ (bend := gradient - before)) > 0:
            inverse = np.eye(6) * gain / (bend @ bend) if step == 1 else inverse
            side = np.eye(6) - np.outer(bend, change) / gain
            inverse = side.T @ inverse @ side + np.outer(change, change) / gain
        change, before = -inverse @ gradient, gradient
        change *= min(1.0, 3 * (1 - step / steps) ** 2 / float(np.linalg.norm(change)))
        pose = motion(units * change) @ pose
        error = float(np.sqrt(np.mean(np.sum((points @ (pose - true).T) ** 2, axis=1))))
        if step % 4 == 3:
            angle = np.degrees(np.arccos(min(1, (np.trace(pose[:3, :3].T @ true[:3, :3]) - 1) / 2)))
            print(f"step {step + 1}: {angle:.2f} degrees off, {error:.3f} mm in the mean of the surface")
    return error


if __name__ == "__main__":
    main()
