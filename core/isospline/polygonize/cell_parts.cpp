#include "isospline/polygonize/cell_parts.h"

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <tuple>
#include <utility>

namespace isospline {

namespace {

/// Triangles are grown by this, in parts: more than their rounding.
constexpr double triangle_margin = 1e-7;
/// Distances are this much smaller, relatively, to make room for it.
constexpr double of_margin = 0x1p-20;

} // namespace

CellParts::CellParts(const glm::ivec3& cell_shape)
    : shape_(parts_per_cell * cell_shape), bricks_along_(brick_shape(cell_shape)),
      bricks_(static_cast<std::size_t>(bricks_along_.x) * static_cast<std::size_t>(bricks_along_.y) *
              static_cast<std::size_t>(bricks_along_.z))
{
}

CellParts::~CellParts()
{
    for (const std::atomic<Rows*>& rows : bricks_)
        delete rows.load();
}

std::size_t CellParts::brick_of(const glm::ivec3& part) const
{
    const glm::vec<3, std::size_t> at(part / parts_per_brick), along(bricks_along_);
    return at.x + along.x * (at.y + along.y * at.z);
}

glm::ivec3 CellParts::first_of(std::size_t brick) const
{
    const glm::vec<3, std::size_t> along(bricks_along_);
    return parts_per_brick * glm::ivec3(brick % along.x, brick / along.x % along.y, brick / (along.x * along.y));
}

void CellParts::add_to_row(const glm::ivec3& part, std::uint32_t bits)
{
    std::atomic<Rows*>& brick = bricks_[brick_of(part)];
    Rows* rows = brick.load(std::memory_order_acquire);
    if (rows == nullptr) {
        auto made = std::make_unique<Rows>();
        if (brick.compare_exchange_strong(rows, made.get(), std::memory_order_acq_rel))
            rows = made.release();
    }
    (*rows)[row_of(part)].fetch_or(bits, std::memory_order_relaxed);
}

std::uint32_t CellParts::row(const glm::ivec3& part) const
{
    const Rows* const rows = bricks_[brick_of(part)].load(std::memory_order_acquire);
    return rows != nullptr ? (*rows)[row_of(part)].load(std::memory_order_relaxed) : 0;
}

void CellParts::add(glm::ivec3 first, std::uint64_t bits)
{
    constexpr int word = std::numeric_limits<std::uint64_t>::digits;
    if (first.y < 0 || first.z < 0 || first.y >= shape_.y || first.z >= shape_.z || first.x >= shape_.x)
        return;
    if (first.x < 0) {
        bits = first.x > -word ? bits >> -first.x : 0;
        first.x = 0;
    }
    if (const int left = shape_.x - first.x; left < word)
        bits &= (std::uint64_t{1} << left) - 1u;
    while (bits != 0) {
        const int offset = first.x % parts_per_brick;
        if (const auto of_row = static_cast<std::uint32_t>(bits << offset); of_row != 0)
            add_to_row(first, of_row);
        bits >>= parts_per_brick - offset;
        first.x += parts_per_brick - offset;
    }
}

bool CellParts::contains(const glm::ivec3& part) const
{
    return (row(part) >> part.x % parts_per_brick & 1u) != 0;
}

bool CellParts::contains_row(glm::ivec3 first, int last_x) const
{
    while (first.x <= last_x) {
        const int offset = first.x % parts_per_brick, count = std::min(last_x - first.x + 1, parts_per_brick - offset);
        const std::uint64_t wanted = ((std::uint64_t{1} << count) - 1u) << offset;
        if ((row(first) & wanted) != wanted)
            return false;
        first.x += count;
    }
    return true;
}

void CellParts::add_of_cell(const glm::ivec3& cell, std::uint64_t bits)
{
    constexpr std::uint64_t of_row = (1u << parts_per_cell) - 1u;
    const glm::ivec3 first = parts_per_cell * cell;
    for (int z = 0; z < parts_per_cell; ++z)
        for (int y = 0; y < parts_per_cell; ++y, bits >>= parts_per_cell)
            if (const std::uint64_t parts = bits & of_row; parts != 0)
                add_to_row(first + glm::ivec3(0, y, z), static_cast<std::uint32_t>(parts << first.x % parts_per_brick));
}

std::uint64_t CellParts::of_cell(const glm::ivec3& cell) const
{
    constexpr std::uint64_t of_row = (1u << parts_per_cell) - 1u;
    const glm::ivec3 first = parts_per_cell * cell;
    std::uint64_t bits = 0;
    for (int z = 0; z < parts_per_cell; ++z)
        for (int y = 0; y < parts_per_cell; ++y)
            bits |= (row(first + glm::ivec3(0, y, z)) >> first.x % parts_per_brick & of_row)
                    << parts_per_cell * (y + parts_per_cell * z);
    return bits;
}

int RowsOfTriangle::index(double at, int count)
{
    return std::clamp(static_cast<int>(std::floor(at)), 0, count - 1);
}

void RowsOfTriangle::begin(const Corners& corners)
{
    Box box;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        corners_[i] = static_cast<double>(parts_per_cell) * corners[i];
        box.extend(corners_[i]);
    }
    first_z_ = index(box.lower.z - triangle_margin, shape_.z);
    last_z_ = index(box.upper.z + triangle_margin, shape_.z);
}

/// Finds the ranges for the rows in a layer.
void RowsOfTriangle::enter(int z)
{
    // What two planes across z leave of the triangle has at most five corners. The first and the last layers reach out
    // of the grid.
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const double lower = z > 0 ? z - triangle_margin : -infinity,
                 upper = z + 1 < shape_.z ? z + 1 + triangle_margin : infinity;
    std::array<glm::dvec2, 9> polygon;
    std::size_t count = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        const glm::dvec3 &from = corners_[i], &to = corners_[(i + 1) % 3];
        if (lower <= from.z && from.z <= upper)
            polygon[count++] = glm::dvec2(from);
        const bool is_up = from.z <= to.z;
        for (const double plane : {is_up ? lower : upper, is_up ? upper : lower})
            if ((from.z < plane) != (to.z < plane) && from.z != plane && to.z != plane)
                polygon[count++] = glm::dvec2(glm::mix(from, to, (plane - from.z) / (to.z - from.z)));
    }
    ranges_.clear();
    if (count == 0)
        return;
    const auto [least, most] =
        std::minmax_element(polygon.begin(), polygon.begin() + static_cast<std::ptrdiff_t>(count),
                            [](const glm::dvec2& a, const glm::dvec2& b) { return a.y < b.y; });
    first_y_ = index(least->y - triangle_margin, shape_.y);
    ranges_.assign(static_cast<std::size_t>(index(most->y + triangle_margin, shape_.y) - first_y_) + 1,
                   {infinity, -infinity});
    for (std::size_t i = 0; i < count; ++i) {
        glm::dvec2 from = polygon[i], to = polygon[i + 1 < count ? i + 1 : 0];
        if (from.y > to.y)
            std::swap(from, to);
        const int first = index(from.y - triangle_margin, shape_.y), last = index(to.y + triangle_margin, shape_.y);
        const auto x_at = [&](double y, double if_flat) {
            return to.y > from.y ? glm::mix(from.x, to.x, std::clamp((y - from.y) / (to.y - from.y), 0.0, 1.0))
                                 : if_flat;
        };
        for (int y = first; y <= last; ++y) {
            const double at_begin = y == first ? from.x : x_at(y - triangle_margin, from.x);
            const double at_end = y == last ? to.x : x_at(y + 1 + triangle_margin, to.x);
            Range& range = ranges_[static_cast<std::size_t>(y - first_y_)];
            range.least = std::min({range.least, at_begin - triangle_margin, at_end - triangle_margin});
            range.most = std::max({range.most, at_begin + triangle_margin, at_end + triangle_margin});
        }
    }
}

PartReach::PartReach(const LatticeMetric& metric, double distance, std::optional<int> edge_axis)
{
    const double limit = (1.0 - of_margin) * distance;
    // The largest distance of the points of a part at an offset from those of a part, or of its edge.
    const auto farthest = [&](const glm::ivec3& offset) {
        double most = 0.0;
        for (int corner = 0; corner < 8; ++corner) {
            glm::dvec3 difference(offset);
            for (int axis = 0; axis < 3; ++axis)
                difference[axis] += (corner >> axis & 1) != 0 ? 1.0 : edge_axis.value_or(axis) == axis ? -1.0 : 0.0;
            most = std::max(most, metric.length(difference / static_cast<double>(parts_per_cell)));
        }
        return most;
    };
    constexpr int most = SpreadParts::largest_reach;
    for (int z = -most; z <= most; ++z)
        for (int y = -most; y <= most; ++y) {
            Row row{most + 1, -most - 1, y, z};
            for (int x = -most; x < most; ++x)
                if (const double of_offset = farthest({x, y, z}); of_offset <= limit) {
                    row.first = std::min(row.first, x);
                    row.last = x;
                    distance_ = std::max(distance_, of_offset / (1.0 - of_margin));
                }
            if (row.first <= row.last)
                rows_.push_back(row);
        }
    const auto is_near = [&](const glm::ivec3& offset) { return farthest(offset) <= limit; };
    if (!is_near({1, 0, 0}) || !is_near({0, 1, 0}) || !is_near({0, 0, 1})) {
        rows_.clear();
        distance_ = 0.0;
    }
    std::stable_sort(rows_.begin(), rows_.end(),
                     [](const Row& a, const Row& b) { return std::tie(a.first, a.last) < std::tie(b.first, b.last); });
}

void SpreadParts::add(const PartReach& reach, int y, int z, std::uint64_t bits)
{
    const PartReach::Row* before = nullptr;
    std::uint64_t spread = 0;
    for (const PartReach::Row& row : reach.rows()) {
        if (before == nullptr || row.first != before->first || row.last != before->last) {
            spread = bits << (largest_reach + row.first);
            for (int count = 1, all = row.last - row.first + 1; count < all;) {
                const int step = std::min(count, all - count);
                spread |= spread << step;
                count += step;
            }
        }
        before = &row;
        rows_[static_cast<std::size_t>(y + row.y + largest_reach) +
              edge * static_cast<std::size_t>(z + row.z + largest_reach)] |= spread;
    }
}

void SpreadParts::move_to(CellParts& parts, const glm::ivec3& first)
{
    for (std::size_t i = 0; i < rows_.size(); ++i)
        if (const std::uint64_t bits = std::exchange(rows_[i], 0); bits != 0)
            parts.add(first + glm::ivec3(0, i % edge, i / edge) - largest_reach, bits);
}

} // namespace isospline
