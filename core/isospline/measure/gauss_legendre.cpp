#include "isospline/measure/gauss_legendre.h"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace isospline {

std::vector<QuadratureNode> gauss_legendre(int count)
{
    std::vector<QuadratureNode> nodes(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        // The roots of the Legendre polynomial on [-1, 1] by Newton's method, from Tricomi's estimate.
        double x = std::cos(std::numbers::pi * (i + 0.75) / (count + 0.5)), slope = 1.0;
        for (int iteration = 0; iteration < 16; ++iteration) {
            double before = 1.0, value = x;
            for (int k = 2; k <= count; ++k) {
                const double next = ((2 * k - 1) * x * value - (k - 1) * before) / k;
                before = value;
                value = next;
            }
            slope = count * (x * value - before) / (x * x - 1.0);
            const double step = value / slope;
            x -= step;
            if (std::abs(step) < 1e-16)
                break;
        }
        nodes[static_cast<std::size_t>(i)] = {0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * slope * slope)};
    }
    return nodes;
}

} // namespace isospline
