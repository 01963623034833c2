// Integrals over the solid and the surface in one cell.
#pragma once

#include "isospline/cell/coefficients.h"
#include "isospline/math/half_space.h"
#include "isospline/measure/gauss_legendre.h"

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace isospline {

/// The quantities to integrate.
enum class Quantity { volume, area, mean_curvature, gaussian_curvature };
inline constexpr std::size_t quantity_count = 4;

/// Its place in arrays by quantity.
constexpr std::size_t index_of(Quantity quantity)
{
    return static_cast<std::size_t>(quantity);
}

/// A number and an estimate of its error.
struct Measurement {
    double value;
    double error;
};

/// Integrals, by quantity, and estimates of their errors.
struct Integrals {
    std::array<double, quantity_count> value{}, error{};
    std::array<double, quantity_count> unresolved{}; ///< the part of the error that a higher order leaves

    void add(const Integrals& other)
    {
        for (std::size_t i = 0; i < quantity_count; ++i) {
            value[i] += other.value[i];
            error[i] += other.error[i];
            unresolved[i] += other.unresolved[i];
        }
    }
};

/// Is called with nodes of the fine rule: local coordinates of the cell, and a weight.
using NodeVisitor = std::function<void(const glm::dvec3& local, double weight)>;

struct QuadratureOptions {
    int order = 4;          ///< nodes of Gauss-Legendre rules, 2 to 10
    bool surface = true;    ///< integrate over the surface: the area
    bool curvature = false; ///< the curvatures, too; needs degree 2 or 3
    glm::dmat3 lattice_to_world{1.0};
    bool error = true; ///< estimate errors
};

/// Integrates over cells, in world units. One thread at a time.
///
/// R. I. Saye, "High-order quadrature methods for implicitly defined surfaces and volumes in hyperrectangles", SIAM
/// Journal on Scientific Computing 37(2), 2015. If the Bernstein coefficients of a derivative of f have one sign, the
/// surface is a graph over a face of the cell. The integral is then one over that face, of a function that is smooth
/// except at the zeros of other polynomials: f on two faces, and f on the planes of half-spaces. If these are graphs
/// too, integrals over intervals between roots remain, which are computed by Gauss-Legendre rules. Cells where this
/// does not hold are halved.
class CellQuadrature {
public:
    explicit CellQuadrature(int degree, const QuadratureOptions& options);
    ~CellQuadrature();
    CellQuadrature(CellQuadrature&&) noexcept;

    /// Integrates over the part of a cell that is in the solid (see Solid), within the half-spaces, which are in
    /// lattice space. `visit_surface` gets the nodes on the surface: weights are areas.
    Integrals integrate(const CellCoefficients& cell, double sign, std::span<const HalfSpace> half_spaces,
                        const NodeVisitor& visit_surface = {});
    /// The area of one half-space's plane in the solid and in all other half-spaces. `visit_edge` gets the nodes on the
    /// curve where the surface meets the plane: weights are lengths divided by the length of the gradient of f on the
    /// plane, in world units.
    Integrals integrate_cap(const CellCoefficients& cell, double sign, std::span<const HalfSpace> half_spaces,
                            std::size_t cap, const NodeVisitor& visit_edge = {});

private:
    struct Method;
    template <int Degree>
    struct MethodOfDegree;

    std::unique_ptr<Method> method_;
};

} // namespace isospline
