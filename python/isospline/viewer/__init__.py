"""A viewer in the browser: ``isospline.view("head.nii.gz")``.

Some modules can be used without a page: `schedule` has the frame scheduler and the adaptive resolution, `session` reads
and writes sessions, `script` writes the Python code of a picture, and `measure` measures a point of a surface.
"""

from .show import view
from .viewer import Viewer

__all__ = ["Viewer", "view"]
