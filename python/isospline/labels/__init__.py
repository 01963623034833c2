"""Label maps: segmentations, in which each voxel has the number of a segment, and smooth surfaces of them."""

from .labels import Labels

__all__ = ["Labels"]
