// Volumes whose coefficients stay in a store; isospline/store/volume.py opens them.
#include "arrays.h"
#include "bind.h"
#include "results.h"
#include "volume_state.h"

#include "isospline/spline/volume.h"
#include "isospline/store/sharded_array.h"

#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cstddef>
#include <exception>
#include <filesystem>
#include <memory>
#include <utility>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

/// `shard` and `chunk` are in the order x, y, z.
std::shared_ptr<Volume> open_sharded_volume(const std::filesystem::path& folder, const py::dict& state,
                                            const py::object& shard, const py::object& chunk,
                                            const py::array_t<float, py::array::c_style>& ranges,
                                            std::size_t memory_limit)
{
    const VolumeSummary summary = summary_in(state);
    ShardedArrayLayout layout{folder, summary.shape, glm::ivec3(as_vector(shard, "shard")),
                              glm::ivec3(as_vector(chunk, "chunk"))};
    std::vector<float> numbers(ranges.data(), ranges.data() + ranges.size());
    auto array = std::make_shared<const ShardedArray>(std::move(layout), std::move(numbers), memory_limit);
    return std::make_shared<Volume>(options_in(state), summary, std::move(array));
}

py::object paging_of(const Volume& volume)
{
    const auto* const array = dynamic_cast<const ShardedArray*>(volume.source());
    if (array == nullptr)
        return py::none();
    py::dict paging;
    paging["folder"] = array->layout().folder.string();
    paging["memory_limit"] = array->memory_limit();
    paging["memory"] = array->memory() + array->budget()->held();
    paging["bytes_read"] = array->bytes_read();
    paging["chunks_read"] = array->chunks_read();
    paging["bricks_made"] = array->budget()->made();
    paging["bricks_dropped"] = array->budget()->dropped();
    return as_result("Paging", paging);
}

void translate_store_error(std::exception_ptr raised)
{
    try {
        std::rethrow_exception(std::move(raised));
    } catch (const StoreError& error) {
        const py::object type = py::reinterpret_borrow<py::object>(PyExc_OSError);
        const py::object value = type(error.code().value(), error.text(), error.path1().string());
        PyErr_SetObject(reinterpret_cast<PyObject*>(Py_TYPE(value.ptr())), value.ptr());
    }
}

} // namespace

void bind_store(py::module_& module)
{
    py::register_local_exception_translator(translate_store_error);
    module.def("open_sharded_volume", &open_sharded_volume, py::arg("folder"), py::arg("state"), py::arg("shard"),
               py::arg("chunk"), py::arg("ranges"), py::arg("memory_limit"));
    py::class_<Volume, std::shared_ptr<Volume>>(module.attr("Volume"))
        .def_property_readonly("paging", &paging_of,
                               "None for a volume in memory. For a volume opened from a store, a `Paging`: the folder\n"
                               "of its array, memory_limit and memory in bytes, and counts since it was opened:\n"
                               "bytes_read, chunks_read, bricks_made and bricks_dropped.");
}

} // namespace isospline
