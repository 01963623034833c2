// The prefilter of a block of a volume, for isospline.store.
#include "bind.h"

#include "arrays.h"
#include "long_call.h"
#include "samples.h"

#include "isospline/spline/prefilter.h"

#include <pybind11/pybind11.h>

#include <string>

namespace py = pybind11;

namespace isospline {

namespace {

RecursiveFilter filter_of(int degree, const std::string& filter, double smoothing)
{
    return design_filter(degree, as_enum(filter_words, filter, "filter"), smoothing);
}

py::array prefilter_block(const py::array& samples, double offset, int degree, const std::string& boundary,
                          const std::string& filter, double smoothing)
{
    const SampleView view = sample_view(samples, Axes::zyx);
    const RecursiveFilter recursive = filter_of(degree, filter, smoothing);
    const Boundary rule = as_enum(boundary_words, boundary, "boundary");
    auto result = new_grid<float>(view.shape, Axes::zyx);
    const std::ptrdiff_t row = view.shape.x;
    const CoefficientArray array{result.mutable_data(), view.shape, 0, row, row * view.shape.y};
    long_call("to filter a block of a volume", py::none(),
              [&](const Progress& progress) { compute_coefficients(view, offset, recursive, rule, array, progress); });
    return result;
}

} // namespace

void bind_prefilter(py::module_& module)
{
    module.def("_prefilter_block", &prefilter_block, py::arg("samples"), py::arg("offset"), py::arg("degree"),
               py::arg("boundary"), py::arg("filter"), py::arg("smoothing"));
    module.def(
        "_prefilter_reach",
        [](int degree, const std::string& filter, double smoothing) {
            return filter_reach(filter_of(degree, filter, smoothing));
        },
        py::arg("degree"), py::arg("filter"), py::arg("smoothing"));
}

} // namespace isospline
