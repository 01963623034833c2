// Cells that rays of a packet meet, collected so that the cells of several rays are solved side by side.
#pragma once

#include "isospline/cell/coefficients.h"
#include "isospline/cell/lattice_ray_packet.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>

namespace isospline {

/// Cells in which rays of a packet may cross the surface, at most one for each lane. Of a single cell, which may have
/// many rays, the coefficients stay where they are. Those of several cells are copied, lane by lane.
struct CandidateCells {
    static constexpr int capacity = LatticeRayPacket::capacity;

    glm::ivec3 lower_of(int lane) const
    {
        return are_copied ? glm::ivec3(lower[0][lane], lower[1][lane], lower[2][lane]) : lower_of_only;
    }

    LaneMask lanes = 0; ///< that have a cell
    bool are_copied = false;
    CoefficientView only; ///< the cell, if they are not copied
    glm::ivec3 lower_of_only;
    alignas(64) std::int32_t lower[3][capacity];  ///< the corner of the cell
    alignas(64) float coefficients[64][capacity]; ///< i + (n + 1) (j + (n + 1) k)
};

/// The cell of one lane.
template <int Degree>
class CellOfLane : public CellCoefficients {
public:
    CellOfLane(const CandidateCells& cells, double surface_threshold, int lane)
        : CellCoefficients({}, surface_threshold, cells.lower_of(lane))
    {
        for (std::size_t i = 0; i < count; ++i)
            own_[i] = cells.coefficients[i][lane];
        static_cast<CoefficientView&>(*this) = {own_.data(), Degree + 1, (Degree + 1) * (Degree + 1)};
    }
    CellOfLane(const CellOfLane&) = delete;
    CellOfLane& operator=(const CellOfLane&) = delete;

private:
    static constexpr std::size_t count = (Degree + 1) * (Degree + 1) * (Degree + 1);

    std::array<float, count + 3> own_{}; // four floats may be read from the beginning of every row
};

} // namespace isospline
