// The functions that bind one concept each.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h> // in all sources, so that all convert arguments alike

namespace isospline {

void bind_volume(pybind11::module_& module);
void bind_prefilter(pybind11::module_& module);
void bind_cells(pybind11::module_& module);
void bind_color_rules(pybind11::module_& module);
void bind_values(pybind11::module_& module);
void bind_isosurface(pybind11::module_& module);
void bind_measure(pybind11::module_& module);
void bind_extent(pybind11::module_& module);
void bind_scene_points(pybind11::module_& module);
void bind_surface_points(pybind11::module_& module);
void bind_point_queries(pybind11::module_& module);
void bind_mesh(pybind11::module_& module);
void bind_surface_mesh(pybind11::module_& module);
void bind_scene(pybind11::module_& module);
void bind_crossings(pybind11::module_& module);
void bind_scene_index(pybind11::module_& module);
void bind_scene_objects(pybind11::module_& module);
void bind_secondary_rays(pybind11::module_& module);
void bind_hopper(pybind11::module_& module);
void bind_camera(pybind11::module_& module);
void bind_environment(pybind11::module_& module);
void bind_image(pybind11::module_& module);
void bind_labels(pybind11::module_& module);
void bind_interleaved(pybind11::module_& module);
void bind_render(pybind11::module_& module);
void bind_path_tracer(pybind11::module_& module);
void bind_store(pybind11::module_& module);
void bind_state(pybind11::module_& module);

} // namespace isospline
