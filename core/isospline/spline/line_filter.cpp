#include "isospline/spline/line_filter.h"

#include "isospline/math/linear_system.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace isospline::detail {

int inside_index(long long i, int size, Boundary boundary)
{
    if (size == 1)
        return 0;
    const long long period = boundary == Boundary::periodic ? size : 2LL * size - 2;
    const long long within = ((i % period) + period) % period;
    return static_cast<int>(within < size ? within : period - within);
}

namespace {

using Matrix = std::array<std::array<double, largest_order>, largest_order>;

Matrix operator*(const Matrix& a, const Matrix& b)
{
    Matrix product{};
    for (std::size_t i = 0; i < largest_order; ++i)
        for (std::size_t k = 0; k < largest_order; ++k)
            for (std::size_t j = 0; j < largest_order; ++j)
                product[i][j] += a[i][k] * b[k][j];
    return product;
}

Matrix power(Matrix base, long long exponent)
{
    Matrix result{};
    for (std::size_t i = 0; i < largest_order; ++i)
        result[i][i] = 1.0;
    for (; exponent > 0; exponent /= 2) {
        if (exponent % 2 == 1)
            result = result * base;
        base = base * base;
    }
    return result;
}

} // namespace

LineFilter::LineFilter(const RecursiveFilter& filter, int line_size, Boundary boundary)
    : size(line_size), order(static_cast<int>(filter.feedback.size())),
      reach(filter.numerator.empty() ? 0 : static_cast<int>(filter.numerator.size()) - 1)
{
    for (std::size_t k = 0; k < filter.feedback.size(); ++k)
        feedback[k] = filter.feedback[k];
    for (std::size_t k = 0; k < filter.numerator.size(); ++k)
        numerator[k] = filter.numerator[k];

    const double forgotten = 1e-17;
    const long long period = size == 1 ? 1 : boundary == Boundary::periodic ? size : 2LL * size - 2;
    const double horizon = std::max(filter_horizon(filter, forgotten), 1.0);
    whole_period = !(horizon < static_cast<double>(period));
    extension = whole_period ? static_cast<int>(period) : static_cast<int>(horizon);

    if (whole_period) {
        Matrix step{};
        for (std::size_t k = 0; k < filter.feedback.size(); ++k) {
            step[0][k] = filter.feedback[k];
            if (k > 0)
                step[k][k - 1] = 1.0;
        }
        // The inverse of 1 - A^period.
        LinearSystem<largest_order, largest_order> system{};
        const Matrix over_period = power(step, period);
        for (std::size_t i = 0; i < largest_order; ++i) {
            for (std::size_t j = 0; j < largest_order; ++j)
                system[i][j] = (i == j ? 1.0 : 0.0) - over_period[i][j];
            system[i][largest_order + i] = 1.0;
        }
        solve(system, largest_order, 0.0);
        for (std::size_t i = 0; i < largest_order; ++i)
            for (std::size_t j = 0; j < largest_order; ++j)
                to_periodic[i][j] = system[i][largest_order + j];
    }

    const int margin = extension + reach;
    for (int i = 1; i <= margin; ++i)
        continuation_.push_back(inside_index(-i, size, boundary));
    for (int i = 0; i < margin; ++i)
        continuation_.push_back(inside_index(static_cast<long long>(size) + i, size, boundary));
    before = continuation_.data();
    after = before + margin;
}

} // namespace isospline::detail
