"""The names of all outputs of cast_rays."""

ALL_OUTPUTS = (
    "t_hit",
    "geometry_ids",
    "primitive_ids",
    "primitive_normals",
    "positions",
    "primitive_uvs",
    "gradient_magnitudes",
)
