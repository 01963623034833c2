"""The names of all that cast_rays can return."""

ALL_OUTPUTS = (
    "t_hit", "geometry_ids", "primitive_ids", "primitive_normals", "positions", "primitive_uvs", "gradient_magnitudes",
)  # fmt: skip
