#include "bind.h"

#include "arrays.h"
#include "clip.h"
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

std::shared_ptr<Isosurface> make_isosurface(const std::shared_ptr<Volume>& volume, double level, const py::object& mask,
                                            std::optional<int> largest, const py::object& clip, bool capped,
                                            bool closed, const std::string& inside,
                                            const std::optional<Material>& material, const py::object& color,
                                            const py::object& opacity, const py::object& name,
                                            const py::object& progress)
{
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

/// Cells that may have points with tangent rays from the eye, (x, y, z, 1), or parallel ones along -(x, y, z, 0).
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

std::string describe(const Isosurface& surface)
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
    py::class_<ShellView>(module, "Shell")
        .def_property_readonly("count", [](const ShellView& shell) { return shell->count(); })
        .def_property_readonly("cells", &shell_cells)
        .def_property_readonly("mask", &shell_mask)
        .def_property_readonly("memory", [](const ShellView& shell) { return shell->memory(); })
        .def("__len__", [](const ShellView& shell) { return shell->count(); })
        .def("__repr__",
             [](const ShellView& shell) { return "<Shell of " + std::to_string(shell->count()) + " cells>"; });
}

} // namespace

void bind_isosurface(py::module_& module)
{
    bind_shell(module);
    py::class_<Isosurface, std::shared_ptr<Isosurface>> surface_class(module, "Isosurface");
    surface_class.def(py::init(&make_isosurface))
        .def_property_readonly("material", [](const Isosurface& self) { return material_in_python(self.material()); })
        .def("with_level", &with_level)
        .def("_end_planes", &end_planes)
        .def("_outline_cells", &cells_of_outline, py::arg("eye"))
        .def("_for_research", &for_research, py::arg("method"), py::arg("prune_depth"), py::arg("prune_border"))
        .def_property("level", &Isosurface::level, &set_level)
        .def_property_readonly(
            "shell", [](const std::shared_ptr<Isosurface>& surface) { return ShellView{surface->snapshot()}; })
        .def_property_readonly(
            "bounds",
            [](const Isosurface& surface) {
                const auto snapshot = surface.snapshot();
                Box box;
                long_call("to find the bounds of a surface", py::none(), [&](const Progress& progress) {
                    box = transform_box(snapshot->volume().lattice_to_world(), bounds_lattice(*snapshot, progress));
                });
                return to_array(box);
            })
        .def_property_readonly(
            "volume",
            [](const Isosurface& surface) { return std::const_pointer_cast<Volume>(surface.shared_volume()); })
        .def_property_readonly(
            "method", [](const Isosurface& surface) { return to_word(method_words, surface.options().method); })
        .def_property_readonly(
            "inside", [](const Isosurface& surface) { return to_word(inside_words, surface.options().inside); })
        .def_property_readonly("largest",
                               [](const Isosurface& surface) {
                                   const int largest = surface.options().largest;
                                   return largest > 0 ? std::optional(largest) : std::nullopt;
                               })
        .def_property_readonly("capped", [](const Isosurface& surface) { return surface.options().capped; })
        .def_property_readonly("closed", [](const Isosurface& surface) { return surface.options().closed; })
        .def_property_readonly("prune_depth",
                               [](const Isosurface& surface) { return surface.options().shell.prune_depth; })
        .def_property_readonly("prune_border",
                               [](const Isosurface& surface) { return surface.options().shell.prune_border; })
        .def("__repr__", [](const Isosurface& surface) { return describe(surface); });
}

} // namespace isospline
