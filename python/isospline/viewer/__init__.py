"""A viewer in the browser: ``isospline.view("head.nii.gz")``.

What is not about pages is of use without one: `schedule` has the frame scheduler and the adaptive resolution,
`session` the file of a session, `script` the Python of a picture, `measure` what a click tells.
"""

from .show import view
from .viewer import Viewer

__all__ = ["Viewer", "view"]
