"""Writes one of the package's own volumes to a file: make_volume.py NAME SIZE FILE.npy"""

import sys

import numpy as np

from isospline import volumes

name, size, path = sys.argv[1:]
np.save(path, getattr(volumes, name)().samples(int(size)))
