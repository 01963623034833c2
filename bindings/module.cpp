// The Python module isospline._core: one bind_ function a concept.
#include "bind.h"
#include "call_threads.h"

#include "isospline/util/progress.h"

PYBIND11_MODULE(_core, module)
{
    module.doc() = "Isosurfaces of B-spline volume models, ray traced exactly in Embree.";
    module.attr("__version__") = ISOSPLINE_VERSION;
    pybind11::register_exception<isospline::Cancelled>(module, "Cancelled", PyExc_RuntimeError).doc() =
        "Raised by an operation whose progress callable returned a false value other than None.";
    Py_AtExit(isospline::end_operations);
    isospline::bind_volume(module);
    isospline::bind_prefilter(module);
    isospline::bind_cells(module);
    isospline::bind_color(module);
    isospline::bind_material(module);
    isospline::bind_clip(module);
    isospline::bind_isosurface(module);
    isospline::bind_measure(module);
    isospline::bind_point_queries(module);
    isospline::bind_mesh(module);
    isospline::bind_surface_mesh(module);
    isospline::bind_scene(module);
    isospline::bind_crossings(module);
    isospline::bind_scene_index(module);
    isospline::bind_scene_objects(module);
    isospline::bind_extent(module);
    isospline::bind_scene_points(module);
    isospline::bind_surface_points(module);
    isospline::bind_secondary_rays(module);
    isospline::bind_hopper(module);
    isospline::bind_camera(module);
    isospline::bind_shading(module);
    isospline::bind_area_lights(module);
    isospline::bind_render(module);
    isospline::bind_path_tracer(module);
    isospline::bind_store(module);
    isospline::bind_state(module);
}
