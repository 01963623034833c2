#include "isospline/spline/line_filter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

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

/// Gauss-Jordan elimination with row pivots.
Matrix inverse(Matrix matrix)
{
    Matrix result = power({}, 0);
    for (std::size_t column = 0; column < largest_order; ++column) {
        std::size_t pivot = column;
        for (std::size_t row = column + 1; row < largest_order; ++row)
            if (std::abs(matrix[row][column]) > std::abs(matrix[pivot][column]))
                pivot = row;
        std::swap(matrix[column], matrix[pivot]);
        std::swap(result[column], result[pivot]);
        const double scale = 1.0 / matrix[column][column];
        for (std::size_t j = 0; j < largest_order; ++j) {
            matrix[column][j] *= scale;
            result[column][j] *= scale;
        }
        for (std::size_t row = 0; row < largest_order; ++row) {
            const double factor = matrix[row][column];
            if (row == column || factor == 0.0)
                continue;
            for (std::size_t j = 0; j < largest_order; ++j) {
                matrix[row][j] -= factor * matrix[column][j];
                result[row][j] -= factor * result[column][j];
            }
        }
    }
    return result;
}

} // namespace

template <typename Real>
LineFilter<Real>::LineFilter(const RecursiveFilter& filter, int line_size, Boundary boundary)
    : size(line_size), order(static_cast<int>(filter.feedback.size())),
      reach(filter.numerator.empty() ? 0 : static_cast<int>(filter.numerator.size()) - 1)
{
    for (std::size_t k = 0; k < filter.feedback.size(); ++k)
        feedback[k] = static_cast<Real>(filter.feedback[k]);
    for (std::size_t k = 0; k < filter.numerator.size(); ++k)
        numerator[k] = static_cast<Real>(filter.numerator[k]);

    // Several poles of one modulus fall off later than one: twice the horizon covers that.
    const double forgotten = sizeof(Real) == sizeof(float) ? 1e-9 : 1e-17;
    const long long period = size == 1 ? 1 : boundary == Boundary::periodic ? size : 2LL * size - 2;
    double horizon = filter.largest_pole > 0.0 ? std::ceil(std::log(forgotten) / std::log(filter.largest_pole)) : 1.0;
    if (order > 1)
        horizon *= 2.0;
    whole_period = !(horizon < static_cast<double>(period));
    extension = whole_period ? static_cast<int>(period) : static_cast<int>(horizon);

    if (whole_period) {
        Matrix step{};
        for (std::size_t k = 0; k < filter.feedback.size(); ++k) {
            step[0][k] = filter.feedback[k];
            if (k > 0)
                step[k][k - 1] = 1.0;
        }
        Matrix difference = power({}, 0);
        const Matrix over_period = power(step, period);
        for (std::size_t i = 0; i < largest_order; ++i)
            for (std::size_t j = 0; j < largest_order; ++j)
                difference[i][j] -= over_period[i][j];
        const Matrix solution = inverse(difference);
        for (std::size_t i = 0; i < largest_order; ++i)
            for (std::size_t j = 0; j < largest_order; ++j)
                to_periodic[i][j] = static_cast<Real>(solution[i][j]);
    }

    const int margin = extension + reach;
    for (int i = 1; i <= margin; ++i)
        continuation_.push_back(inside_index(-i, size, boundary));
    for (int i = 0; i < margin; ++i)
        continuation_.push_back(inside_index(static_cast<long long>(size) + i, size, boundary));
    before = continuation_.data();
    after = before + margin;
}

template struct LineFilter<float>;
template struct LineFilter<double>;

} // namespace isospline::detail
