"""Renders the pictures of docs/python.md and docs/gallery.md from the examples: docs/images/NAME.png.

make_pictures.py [NAME...]: all of them, or those that are named.
"""

import runpy
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).parents[1]

#: Each picture is a row of the pictures of an example, of the given size.
ROWS = {
    "cameras": ("120-cameras", (440, 248), ["120-lens", "120-panorama"]),
    "colors": (
        "130-colors",
        (200, 190),
        ["130-volume", "130-curvature", "130-ridges", "130-normal", "130-depth", "130-vertices"],
    ),
    "layers": ("140-layers", (240, 220), ["140-depth", "140-normal", "140-albedo", "140-gradient", "140-curvature"]),
    "transparency": ("150-transparency", (480, 360), ["150-transparency"]),
    "capped-cuts": ("155-capped-cuts", (480, 360), ["155-capped-cuts"]),
    "instances": ("165-instances-and-masks", (640, 360), ["165-instances-and-masks"]),
    "mirror": ("170-secondary-rays", (480, 360), ["170-secondary-rays"]),
    "thickness": ("175-thickness", (480, 400), ["175-thickness"]),
    "distance": ("180-closest-points", (400, 400), ["180-closest-points"]),
    "implant": ("185-implant", (640, 440), ["185-implant"]),
    "turntable": ("190-turntable", (160, 150), ["190-turntable"]),
}

for name in sys.argv[1:] or ROWS:
    example, size, parts = ROWS[name]
    with tempfile.TemporaryDirectory() as folder:
        runpy.run_path(str(ROOT / "examples" / f"{example}.py"))["main"](size=size, folder=folder)
        tiles = [Image.open(Path(folder) / f"{part}.png").convert("RGB") for part in parts]
    height = max(tile.height for tile in tiles)
    row = Image.new("RGB", (sum(tile.width for tile in tiles), height), "white")
    left = 0
    for tile in tiles:
        row.paste(tile, (left, (height - tile.height) // 2))
        left += tile.width
    row.save(ROOT / "docs" / "images" / f"{name}.png", optimize=True)
