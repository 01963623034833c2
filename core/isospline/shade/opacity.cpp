#include "isospline/shade/opacity.h"

#include "isospline/math/power-inl.h"

#include <algorithm>
#include <cmath>

namespace isospline {

double opacity_at(double opacity, double silhouette_opacity, double silhouette_exponent, double n_v)
{
    // Rounding may take a product of unit vectors past 1.
    const double part = scalar::power(std::max(1.0 - std::abs(n_v), 0.0), silhouette_exponent);
    return opacity + (silhouette_opacity - opacity) * part;
}

} // namespace isospline
