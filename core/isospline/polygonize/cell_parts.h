// Sets of small parts of cells, and those that are near to others.
#pragma once

#include "isospline/brick/brick.h"
#include "isospline/polygonize/mesh_part.h"
#include "isospline/query/lattice_metric.h"

#include <glm/vec3.hpp>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace isospline {

/// Parts along an edge of a cell, and of a brick: a row of a brick's parts is a word.
inline constexpr int parts_per_cell = 4, parts_per_brick = parts_per_cell * brick_size;

/// A set of parts of the cells of a grid: each cell is divided into 4 x 4 x 4 equal ones. Threads may add parts at the
/// same time. Positions of parts are indices in the grid of all parts.
class CellParts {
public:
    explicit CellParts(const glm::ivec3& cell_shape);
    ~CellParts();
    CellParts(CellParts&&) = default;
    CellParts& operator=(CellParts&&) = delete;

    /// Parts along x, y, z.
    const glm::ivec3& shape() const { return shape_; }
    /// Adds parts of a row: bit i stands for the part at first + (i, 0, 0). Those beyond the grid are left out.
    void add(glm::ivec3 first, std::uint64_t bits);
    bool contains(const glm::ivec3& part) const;
    /// Whether it has all parts of a row, up to the one at `last_x`.
    bool contains_row(glm::ivec3 first, int last_x) const;
    /// Adds parts of a cell: bit x + 4 y + 16 z.
    void add_of_cell(const glm::ivec3& cell, std::uint64_t bits);
    /// The parts of a cell that it has.
    std::uint64_t of_cell(const glm::ivec3& cell) const;

    std::size_t brick_count() const { return bricks_.size(); }
    /// The first part of a brick.
    glm::ivec3 first_of(std::size_t brick) const;
    /// Calls `visit(y, z, bits)` for each row of a brick with parts that it has; y and z count from the first part.
    template <typename Visit>
    void for_each_row(std::size_t brick, const Visit& visit) const
    {
        const Rows* const rows = bricks_[brick].load(std::memory_order_acquire);
        for (std::size_t i = 0; rows != nullptr && i < rows->size(); ++i)
            if (const std::uint32_t bits = (*rows)[i].load(std::memory_order_relaxed); bits != 0)
                visit(static_cast<int>(i) % parts_per_brick, static_cast<int>(i) / parts_per_brick, bits);
    }

private:
    using Rows = std::array<std::atomic<std::uint32_t>, std::size_t{parts_per_brick} * parts_per_brick>;

    std::size_t brick_of(const glm::ivec3& part) const;
    static std::size_t row_of(const glm::ivec3& part)
    {
        return static_cast<std::size_t>(part.y % parts_per_brick + parts_per_brick * (part.z % parts_per_brick));
    }
    void add_to_row(const glm::ivec3& part, std::uint32_t bits);
    std::uint32_t row(const glm::ivec3& part) const;

    glm::ivec3 shape_, bricks_along_;
    std::vector<std::atomic<Rows*>> bricks_; ///< null without parts
};

/// The rows of parts that triangles meet.
class RowsOfTriangle {
public:
    explicit RowsOfTriangle(const glm::ivec3& shape) : shape_(shape) {}

    /// Calls `visit(first, last_x)` for rows of parts until it returns false. The triangle is within them, and each
    /// part has a point of it, but for rounding. Returns whether it never did.
    template <typename Visit>
    bool operator()(const Corners& corners, const Visit& visit)
    {
        begin(corners);
        for (int z = first_z_; z <= last_z_; ++z) {
            enter(z);
            for (std::size_t i = 0; i < ranges_.size(); ++i)
                if (ranges_[i].least <= ranges_[i].most &&
                    !visit({index(ranges_[i].least, shape_.x), first_y_ + static_cast<int>(i), z},
                           index(ranges_[i].most, shape_.x)))
                    return false;
        }
        return true;
    }

private:
    struct Range {
        double least, most;
    };

    static int index(double at, int count);
    void begin(const Corners& corners);
    void enter(int z);

    glm::ivec3 shape_;
    Corners corners_; ///< in parts
    int first_z_ = 0, last_z_ = 0, first_y_ = 0;
    std::vector<Range> ranges_; ///< of x, by y
};

/// Which parts are near to a part, or to an edge of one.
class PartReach {
public:
    /// Parts have all their points within a distance, in world units, of all points of a part, or of a part's lower
    /// edge along an axis. There are none if the next part along one of the axes is not near: it would not be worth it.
    PartReach(const LatticeMetric& metric, double distance, std::optional<int> edge_axis = std::nullopt);

    /// The parts at the offsets (first, y, z) to (last, y, z).
    struct Row {
        int first, last, y, z;
    };
    const std::vector<Row>& rows() const { return rows_; } ///< equal ranges are together
    /// The largest distance, at most that which was given; 0 if there are none.
    double distance() const { return distance_; }

private:
    std::vector<Row> rows_;
    double distance_ = 0.0;
};

/// Collects the parts near to some of a brick.
class SpreadParts {
public:
    SpreadParts() : rows_(edge * edge, 0) {}

    /// Adds what is near to parts of a row: bit i stands for the part at (i, y, z), counted from the brick's first, up
    /// to its upper side.
    void add(const PartReach& reach, int y, int z, std::uint64_t bits);
    /// Hands over what was collected, for a brick with this first part.
    void move_to(CellParts& parts, const glm::ivec3& first);

    /// The largest offset.
    static constexpr int largest_reach = 15;

private:
    static constexpr std::size_t edge = parts_per_brick + 1 + 2 * largest_reach;

    std::vector<std::uint64_t> rows_; ///< from the part at -largest_reach on
};

} // namespace isospline
