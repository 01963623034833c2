// Volumes whose coefficients stay in a store; isospline/store/volume.py opens them.
#include "arrays.h"
#include "bind.h"
#include "results.h"
#include "volume_state.h"

#include "isospline/spline/volume.h"
#include "isospline/store/sharded_array.h"

#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <exception>
#include <filesystem>
#include <iterator>
#include <memory>
#include <system_error>
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

/// Whether a store lacks something or has changed; otherwise the system could not read it.
bool is_damage(const std::error_code& code)
{
    const int damages[] = {EIO, EINVAL, ENOENT, ENOTDIR, EISDIR, ELOOP};
    return std::find(std::begin(damages), std::end(damages), code.value()) != std::end(damages);
}

void translate_store_error(std::exception_ptr raised)
{
    try {
        std::rethrow_exception(std::move(raised));
    } catch (const StoreError& error) {
        const auto damaged = py::module_::import("isospline._core").attr("DamagedStore");
        const py::object type =
            is_damage(error.code()) ? py::object(damaged) : py::reinterpret_borrow<py::object>(PyExc_OSError);
        const py::object value = type(error.code().value(), error.text(), error.path1().string());
        PyErr_SetObject(reinterpret_cast<PyObject*>(Py_TYPE(value.ptr())), value.ptr());
    }
}

} // namespace

void bind_store(py::module_& module)
{
    // The reader of a damaged file raises a ValueError. Chunks are read in later calls, where an OSError is expected.
    const py::tuple bases = py::make_tuple(py::handle(PyExc_OSError), py::handle(PyExc_ValueError));
    module.attr("DamagedStore") = py::reinterpret_steal<py::object>(PyErr_NewExceptionWithDoc(
        "isospline._core.DamagedStore", "A chunk of a store is missing, truncated or fails its checksum.", bases.ptr(),
        nullptr));
    py::register_local_exception_translator(translate_store_error);
    module.def("open_sharded_volume", &open_sharded_volume, py::arg("folder"), py::arg("state"), py::arg("shard"),
               py::arg("chunk"), py::arg("ranges"), py::arg("memory_limit"));
    py::class_<Volume, std::shared_ptr<Volume>>(module.attr("Volume")).def_property_readonly("paging", &paging_of);
}

} // namespace isospline
