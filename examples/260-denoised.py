"""A path traced picture before and after denoising, compared with one of many samples.

Intel's Open Image Denoise removes noise from the linear colour, before tone mapping: ``pip install
isospline[denoise]``. Without it, the middle stays empty. Light is tone mapped, so that no highlight is clipped, and
then composited over the background.
"""

from pathlib import Path

from matplotlib.figure import Figure

import isospline
from isospline import volumes


def main(samples: int = 96, size: tuple[int, int] = (360, 300), folder: str = "out") -> None:
    field = volumes.heart()
    volume = field.volume(samples)
    scene = isospline.Scene([isospline.Isosurface(volume, field.level)])
    scene.add(isospline.ground_for(scene))
    camera = isospline.PerspectiveCamera(eye=(1.5, -6, 2.5), target=(0, 0, -0.1), field_of_view=26)
    integrator = isospline.PathTracer(
        materials={
            0: isospline.Material((0.9, 0.62, 0.25), metallic=1, roughness=0.25),
            1: isospline.Material((0.55, 0.57, 0.6), roughness=0.5),
        },
        lights=[isospline.SphereLight((-3, -4, 5), 0.8, radiance=14), isospline.EnvironmentLight((0.5, 0.6, 0.75))],
    )

    renderer = isospline.ProgressiveRenderer(scene, camera, size=size, light=integrator)
    panels = {"8 samples a pixel": renderer.run(8)}
    try:
        panels["8 samples, denoised"] = renderer.image.denoise()
    except ImportError as error:
        print(error)
    panels["128 samples"] = renderer.run(128)

    figure = Figure(figsize=(13, 3.9), layout="constrained")
    for axes, (title, image) in zip(figure.subplots(1, len(panels)), panels.items()):
        axes.imshow(image.tone_map("neutral").over("white"))
        axes.set_title(title)
        axes.set_axis_off()
    Path(folder).mkdir(exist_ok=True)
    figure.savefig(Path(folder) / "260-denoised.png")


if __name__ == "__main__":
    main()
