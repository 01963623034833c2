"""The names of all outputs of cast_rays."""

ALL_OUTPUTS = (
    "t_hit",
    "geometry_ids",
    "primitive_ids",
    "primitive_normals",
    "positions",
    "primitive_uvs",
    "gradient_magnitudes",
    "dt_dlevel",
    "dt_dorigin",
    "dt_ddirection",
    "grazing",
    "dnormal_dlevel",
    "dnormal_dorigin",
    "dnormal_ddirection",
    "coefficient_indices",
    "coefficient_weights",
    "coefficient_gradients",
)
