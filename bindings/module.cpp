// The Python module isospline._core: one bind_ function a concept.
#include "bind.h"
#include "call_threads.h"

#include "isospline/util/progress.h"

#include <cstddef>
#include <exception>
#include <string>
#include <string_view>

namespace {

namespace py = pybind11;

constexpr const char* not_initialized =
    "expected an object made by its class or by a whole pickle, got one that was not initialized";

/// What pybind11 does not guard. Objects without a C++ object, from `Volume.__new__(Volume)` or a pickle without a
/// state, would get memory that no constructor has seen; they raise TypeError when they are used. Pickles of protocols
/// 0 and 1, and of objects without a state, would make an object of pybind11's base class, which ends the process.
void guard_classes(const py::module_& module)
{
    py::register_local_exception_translator([](std::exception_ptr error) { // NOLINT: the signature is given
        try {
            std::rethrow_exception(error);
        } catch (const py::cast_error& cause) { // of holders
            if (std::string_view(cause.what()).find("non-held to held") == std::string_view::npos)
                throw;
            PyErr_SetString(PyExc_TypeError, not_initialized);
        }
    });
    const py::object make = py::module_::import("copyreg").attr("__newobj__");
    for (const auto& [name, value] : module.attr("__dict__").cast<py::dict>()) {
        if (!PyType_Check(value.ptr()))
            continue;
        auto* const type = py::detail::get_type_info(reinterpret_cast<PyTypeObject*>(value.ptr()));
        if (type == nullptr)
            continue;
        type->operator_new = [](std::size_t) -> void* { throw py::type_error(not_initialized); };
        const bool has_state = value.attr("__dict__").contains("__getstate__");
        const auto reduce = [make, has_state](const py::object& self) {
            const py::object own = py::type::of(self);
            if (!has_state)
                throw py::type_error(own.attr("__name__").cast<std::string>() + ": cannot be pickled or copied");
            return py::make_tuple(make, py::make_tuple(own), self.attr("__getstate__")());
        };
        py::setattr(value, "__reduce__", py::cpp_function(reduce, py::name("__reduce__"), py::is_method(value)));
    }
}

} // namespace

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
    isospline::bind_values(module);
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
    isospline::bind_environment(module);
    isospline::bind_color_rules(module);
    isospline::bind_image(module);
    isospline::bind_render(module);
    isospline::bind_interleaved(module);
    isospline::bind_labels(module);
    isospline::bind_path_tracer(module);
    isospline::bind_store(module);
    isospline::bind_state(module);
    guard_classes(module);
}
