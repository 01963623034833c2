#include "bind.h"

#include "arrays.h"
#include "clip.h"
#include "handed.h"
#include "long_call.h"
#include "look.h"
#include "masks.h"
#include "warn.h"

#include "isospline/math/affine.h"
#include "isospline/query/outline_cells.h"
#include "isospline/query/reach.h"
#include "isospline/shell/isosurface.h"
#include "isospline/trace/cap.h"
#include "isospline/util/check.h"

#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <mutex>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

constexpr const char* isosurface_doc = R"(The surface on which the model of a volume has a given value.

.. math:: f(\mathbf{x}) = f_0

Only the cells of its shell can contain a part of it [1]_. These are the cells whose coefficients, minus the level, have
both signs, except those that pruning by two-scale subdivision rules out.

Parameters
----------
volume : Volume, VolumeData or (nz, ny, nx) array
    Its degree is 1, 2 or 3. Odd degrees need at least two samples along each axis.
level : float
    The value :math:`f_0`.
mask : bool array of the volume's shape, optional
    The parts to keep. A cell is cut away if the sample in its centre is False (degree 2), or one of the samples at
    its corners (odd degrees).
largest : int, optional
    Keeps this number of connected components of the solid, those with the largest volumes, see `components`; by
    default all are kept. Components are found again whenever the level is set.
clip : HalfSpace, Box or a list or tuple of them, optional
    In the volume's world space. Only the part inside of all of them is kept. The cuts are planes.
capped : bool
    Whether the solid is closed where `clip` cuts it: the parts of the cut's plane in the solid are caps, faces that
    belong to the surface. Hits on them have the plane's normal. Their primitive ids begin at ``volume.cell_count`` and
    are in the order of the half-spaces of `clip`; a Box has six: lower x, upper x, lower y, and so on. Cuts by `mask`
    stay open.
closed : bool
    Whether the solid is closed at the border of the volume's domain, `Volume.bounds`, with caps like those of cuts.
    Their primitive ids follow those of `clip`, along the volume's own axes: lower x, upper x, lower y, and so on. The
    border is exact for oblique directions, too.
inside : {"above", "below"}
    The side of the surface that is the solid. Normals point to the other side. Points where f equals the level are
    above.
material : Material, optional
    Its look. A `PathTracer` or a `Studio` may have another material for it, and a dict of lights another look.
color : str, float, (3,) float, or a rule such as ColorByVolume, optional
    Its colour, in place of `material`; as in `Material`. By default, the light decides.
opacity : float, optional
    Its opacity from 0 to 1, in place of `material`. Path tracers draw all surfaces opaque.
name : str, optional
    What legends call it.
progress : callable, optional
    Called with the finished fraction; cancels if it returns a false value other than None.

Warns
-----
UserWarning
    If the shell is empty and there are no caps, for example because the level is out of the data's range. All rays
    then miss.

Raises
------
ValueError
    For a volume of another degree, or with too few samples; a level that is not finite; a mask of another shape; a
    `largest` below 1; an opacity out of range; and `capped` without a clip, unless `closed` is True.
TypeError
    For a mask of another type, another type of `clip`, and a color, opacity or name together with a material.
Cancelled
    If `progress` cancels.

Notes
-----
A change of `level` reuses the coefficients and visits only the bricks whose ranges of values contain the new level. Any
thread may set it; running queries continue with the level that they began with.

References
----------
.. [1] P. Thévenaz, M. Unser, "High-quality isosurface rendering with exact gradient", ICIP 2001.

Examples
--------
>>> import numpy as np
>>> import isospline
>>> z, y, x = np.mgrid[-8:9, -8:9, -8:9]
>>> volume = isospline.Volume(np.sqrt(x**2 + y**2 + z**2))
>>> sphere = isospline.Isosurface(volume, 5.0, inside="below")
>>> sphere.shell.mask.shape
(17, 17, 17)
>>> small = sphere.shell.count
>>> sphere.level = 7.0
>>> sphere.shell.count > small
True
)";

constexpr const char* shell_doc = R"(The cells that may contain a part of an isosurface at its current level.

Cell (x, y, z) is the cube between the indices (x, y, z) - 1/2 and (x, y, z) + 1/2 for even degrees, (x, y, z) and
(x, y, z) + 1 for odd ones.
)";

const EnumWords<Method> method_words{
    {"exact", Method::exact}, {"reference", Method::reference}, {"bracket", Method::bracket}};
const EnumWords<Inside> inside_words{{"above", Inside::above}, {"below", Inside::below}};

/// The shell of a surface at the level that it had when `shell` was read. It is computed when it is first used.
struct ShellView {
    std::shared_ptr<const IsosurfaceSnapshot> surface;

    const Shell& operator*() const
    {
        const Shell* shell = nullptr;
        long_call("to find a shell", py::none(), [&](const Progress& report) { shell = &surface->shell(report); });
        return *shell;
    }
    const Shell* operator->() const { return &**this; }
};

/// Whether all rays miss a surface.
bool is_nothing(const IsosurfaceSnapshot& surface, const Progress& progress)
{
    return surface.is_empty(progress) && cap_boxes(surface).boxes.empty();
}

/// Warns that all rays will miss, with the reason.
void warn_of_empty_shell(const IsosurfaceSnapshot& surface)
{
    const double lower = surface.volume().minimum(), upper = surface.volume().maximum();
    const bool out_of_range = surface.level() < lower || surface.level() > upper;
    std::ostringstream text;
    text.precision(12);
    text << "level " << surface.level() << (out_of_range ? " is out of" : " has an empty shell, within")
         << " the data's range, " << lower << " to " << upper << ": there is no surface and rays miss it";
    warn(text.str());
}

std::shared_ptr<Isosurface> build(std::shared_ptr<const Volume> volume, double level, IsosurfaceOptions options,
                                  std::shared_ptr<const BrickRanges> ranges, const py::object& progress)
{
    std::shared_ptr<Isosurface> surface;
    bool misses = false;
    long_call("to make an isosurface", progress, [&](const Progress& report) {
        surface = std::make_shared<Isosurface>(std::move(volume), level, std::move(options), std::move(ranges), report);
        misses = is_nothing(*surface->snapshot(), report);
    });
    if (misses)
        warn_of_empty_shell(*surface->snapshot());
    return surface;
}

/// The number of components to keep; 0 keeps all.
int as_largest(std::optional<int> largest)
{
    if (largest && *largest < 1)
        throw_invalid("largest", "a number of at least 1, or None", *largest);
    return largest.value_or(0);
}

std::shared_ptr<Isosurface> make_isosurface(const py::object& given, double level, const py::object& mask,
                                            std::optional<int> largest, const py::object& clip, bool capped,
                                            bool closed, const std::string& inside,
                                            const std::optional<Material>& material, const py::object& color,
                                            const py::object& opacity, const py::object& name,
                                            const py::object& progress)
{
    const auto as_volume = handed("as_volume");
    const auto volume = as_object<Volume>(as_volume(given, "volume"), "volume");
    IsosurfaceOptions options;
    if (!mask.is_none())
        options.shell.mask = as_mask(mask, "mask", volume->shape(), volume->options().axes);
    options.largest = as_largest(largest);
    options.clip = as_clip(clip);
    options.capped = capped;
    options.closed = closed;
    options.inside = as_enum(inside_words, inside, "inside");
    options.material = look_of(material, color, opacity, name);
    return build(volume, level, std::move(options), nullptr, progress);
}

/// The same surface with settings of isospline.research.
std::shared_ptr<Isosurface> for_research(const Isosurface& surface, const std::string& method, int prune_depth,
                                         bool prune_border)
{
    IsosurfaceOptions options = surface.options();
    options.method = as_enum(method_words, method, "method");
    options.shell.prune_depth = prune_depth;
    options.shell.prune_border = prune_border;
    return build(surface.shared_volume(), surface.level(), std::move(options), surface.shared_ranges(), py::none());
}

std::shared_ptr<Isosurface> with_level(const Isosurface& surface, double level, const py::object& progress)
{
    return build(surface.shared_volume(), level, surface.options(), surface.shared_ranges(), progress);
}

void set_level(Isosurface& surface, double level)
{
    std::shared_ptr<const IsosurfaceSnapshot> changed;
    bool misses = false;
    long_call("to change the level", py::none(), [&](const Progress& report) {
        surface.set_level(level, report);
        changed = surface.snapshot();
        misses = is_nothing(*changed, report);
    });
    if (misses)
        warn_of_empty_shell(*changed);
}

py::array_t<std::int32_t> shell_cells(const ShellView& shell)
{
    const std::vector<Cell>& cells = shell->cells();
    auto array = new_array<std::int32_t>({static_cast<py::ssize_t>(cells.size()), 3});
    std::int32_t* next = array.mutable_data();
    for (const Cell& cell : cells) {
        *next++ = cell.x;
        *next++ = cell.y;
        *next++ = cell.z;
    }
    return array;
}

py::array_t<std::int32_t> cells_of_outline(const Isosurface& surface, const std::array<double, 4>& eye)
{
    const auto snapshot = surface.snapshot();
    std::vector<glm::ivec3> cells;
    long_call("to find outlines", py::none(), [&](const Progress& report) {
        const glm::dmat4& to_lattice = snapshot->volume().world_to_lattice();
        cells = outline_cells(*snapshot, to_lattice * glm::dvec4(eye[0], eye[1], eye[2], eye[3]), report);
    });
    auto array = new_array<std::int32_t>({static_cast<py::ssize_t>(cells.size()), 3});
    std::int32_t* next = array.mutable_data();
    for (const glm::ivec3& cell : cells)
        for (int axis = 0; axis < 3; ++axis)
            *next++ = cell[axis];
    return array;
}

/// (P, 4): normals and offsets, in world space, of the planes on which the surface may end: <normal, x> >= offset.
py::array_t<double> end_planes(const Isosurface& surface)
{
    const auto snapshot = surface.snapshot();
    const Volume& volume = snapshot->volume();
    std::vector<HalfSpace> planes = snapshot->clip_lattice();
    for (const HalfSpace& side : half_spaces(Box{glm::dvec3(0.0), glm::dvec3(volume.cell_shape())}))
        if (std::none_of(planes.begin(), planes.end(), [&](const HalfSpace& plane) {
                return plane.normal == side.normal && std::abs(plane.offset - side.offset) < plane_margin;
            }))
            planes.push_back(side);
    auto array = new_array<double>({static_cast<py::ssize_t>(planes.size()), 4});
    double* next = array.mutable_data();
    for (const HalfSpace& plane : planes) {
        const HalfSpace in_world = pull_back(plane, volume.world_to_lattice());
        next = std::copy_n(&in_world.normal[0], 3, next);
        *next++ = in_world.offset;
    }
    return array;
}

py::array_t<bool> shell_mask(const ShellView& shell)
{
    const Volume& volume = shell.surface->volume();
    const glm::vec<3, std::size_t> shape(volume.cell_shape());
    auto array = new_grid<bool>(volume.cell_shape(), volume.options().axes);
    bool* const data = array.mutable_data();
    std::fill_n(data, array.size(), false);
    for (const Cell& cell : shell->cells())
        data[cell.x + shape.x * (cell.y + shape.y * cell.z)] = true;
    return array;
}

std::string representation(const Isosurface& surface)
{
    const auto snapshot = surface.snapshot();
    std::ostringstream text;
    text.precision(12);
    text << "Isosurface(level=" << snapshot->level() << ", inside=\"" << to_word(inside_words, surface.options().inside)
         << '"';
    if (surface.options().method != Method::exact)
        text << ", method=\"" << to_word(method_words, surface.options().method) << '"';
    if (surface.material() && !surface.material()->name.empty())
        text << ", name=\"" << surface.material()->name << '"';
    text << ')';
    return "<" + text.str() + ">";
}

void bind_shell(py::module_& module)
{
    py::class_<ShellView>(module, "Shell", shell_doc)
        .def_property_readonly(
            "count", [](const ShellView& shell) { return shell->count(); }, "Number of cells.")
        .def_property_readonly(
            "cells", &shell_cells,
            "(M, 3) int32 array: x, y, z of every cell, in the order of octets of 2 x 2 x 2 bricks of\n"
            "8 x 8 x 8 cells, then bricks, then blocks of 2 x 2 x 2 cells. A new array.")
        .def_property_readonly("mask", &shell_mask,
                               "bool array over the grid of cells, in the order of the axes of the volume's data; one\n"
                               "item fewer than samples along each axis for odd degrees. A new array.")
        .def_property_readonly(
            "memory", [](const ShellView& shell) { return shell->memory(); }, "Bytes held by the list of cells.")
        .def("__len__", [](const ShellView& shell) { return shell->count(); })
        .def("__repr__",
             [](const ShellView& shell) { return "<Shell of " + std::to_string(shell->count()) + " cells>"; });
}

} // namespace

void bind_isosurface(py::module_& module)
{
    bind_shell(module);
    py::class_<Isosurface, std::shared_ptr<Isosurface>> surface_class(module, "Isosurface", isosurface_doc);
    bind_look(surface_class);
    surface_class
        .def(py::init(&make_isosurface), py::arg("volume"), py::arg("level"), py::kw_only(),
             py::arg("mask") = py::none(), py::arg("largest") = py::none(), py::arg("clip") = py::none(),
             py::arg("capped") = false, py::arg("closed") = false, py::arg("inside") = "above",
             py::arg("material") = py::none(), py::arg("color") = py::none(), py::arg("opacity") = py::none(),
             py::arg("name") = py::none(), py::arg("progress") = py::none())
        .def("with_level", &with_level, py::arg("level"), py::kw_only(), py::arg("progress") = py::none(),
             "A surface of the same volume at another level, with the same options. Both share the volume's data.")
        .def("_end_planes", &end_planes, "(P, 4): planes on which the surface may end, <normal, x> >= offset.")
        .def("_outline_cells", &cells_of_outline, py::arg("eye"),
             "(M, 3) int32: cells that may have points with tangent rays from the eye, (x, y, z, 1), or parallel ones "
             "along\n"
             "-(x, y, z, 0).")
        .def("_for_research", &for_research, py::arg("method"), py::arg("prune_depth"), py::arg("prune_border"))
        .def_property("level", &Isosurface::level, &set_level,
                      "The value of the model on the surface, a finite number; may be set.")
        .def_property_readonly(
            "shell", [](const std::shared_ptr<Isosurface>& surface) { return ShellView{surface->snapshot()}; },
            "The cells that may contain a part of the surface at its current level.")
        .def_property_readonly(
            "bounds",
            [](const Isosurface& surface) {
                const auto snapshot = surface.snapshot();
                Box box;
                long_call("to find the bounds of a surface", py::none(), [&](const Progress& progress) {
                    box = transform_box(snapshot->volume().lattice_to_world(), bounds_lattice(*snapshot, progress));
                });
                return to_array(box);
            },
            "(2, 3) float64 array, world units: lower and upper corner of the box of the cells that may contain the "
            "surface, and of its caps; inf, -inf if there are none.")
        .def_property_readonly(
            "volume",
            [](const Isosurface& surface) { return std::const_pointer_cast<Volume>(surface.shared_volume()); },
            "The volume.")
        .def_property_readonly(
            "method", [](const Isosurface& surface) { return to_word(method_words, surface.options().method); },
            "How rays find the surface in a cell: \"exact\", \"reference\" or \"bracket\".")
        .def_property_readonly(
            "inside", [](const Isosurface& surface) { return to_word(inside_words, surface.options().inside); },
            "The side of the surface that is the solid: \"above\" or \"below\".")
        .def_property_readonly(
            "largest",
            [](const Isosurface& surface) {
                const int largest = surface.options().largest;
                return largest > 0 ? std::optional(largest) : std::nullopt;
            },
            "How many connected components of the solid are kept, those with the largest volume; None: all.")
        .def_property_readonly(
            "capped", [](const Isosurface& surface) { return surface.options().capped; },
            "Whether the solid is closed where the clip cuts it.")
        .def_property_readonly(
            "closed", [](const Isosurface& surface) { return surface.options().closed; },
            "Whether the solid is closed at the border of the volume.")
        .def_property_readonly(
            "prune_depth", [](const Isosurface& surface) { return surface.options().shell.prune_depth; },
            "Levels of subdivision that the shell was pruned with.")
        .def_property_readonly(
            "prune_border", [](const Isosurface& surface) { return surface.options().shell.prune_border; },
            "Whether cells on the border of the volume are pruned as well.")
        .def("__repr__", &representation);
}

} // namespace isospline
