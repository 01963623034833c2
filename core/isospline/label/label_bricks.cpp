#include "isospline/label/label_bricks.h"

#include "isospline/math/box.h"
#include "isospline/util/parallel.h"

#include <glm/common.hpp>

#include <algorithm>
#include <limits>
#include <utility>

namespace isospline {

namespace {

/// The bricks that meet the voxels from `first` to `last`: calls `visit(index)`.
template <typename Visit>
void for_bricks(const glm::ivec3& bricks, const glm::ivec3& first, const glm::ivec3& last, const Visit& visit)
{
    const glm::ivec3 begin = glm::max(first, 0) / brick_size, end = glm::min(last / brick_size, bricks - 1);
    glm::ivec3 at;
    for (at.z = begin.z; at.z <= end.z; ++at.z)
        for (at.y = begin.y; at.y <= end.y; ++at.y)
            for (at.x = begin.x; at.x <= end.x; ++at.x)
                visit(place_in(bricks, at));
}

void add_sorted(std::vector<std::int32_t>& labels, std::int32_t label)
{
    const auto place = std::lower_bound(labels.begin(), labels.end(), label);
    if (place == labels.end() || *place != label)
        labels.insert(place, label);
}

} // namespace

LabelBricks::LabelBricks(const LabelMap& labels)
    : labels_(labels), bricks_(brick_shape(labels.shape)), in_brick_(place_count(bricks_))
{
    parallel_for(in_brick_.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t index = begin; index < end; ++index) {
            const auto [first, size] = brick_at(labels_.shape, at_place(bricks_, index));
            std::int32_t last = labels_.at(first);
            in_brick_[index].assign(1, last);
            for (int z = 0; z < size.z; ++z)
                for (int y = 0; y < size.y; ++y) {
                    const std::int32_t* const row =
                        labels_.values + place_in(labels_.shape, first + glm::ivec3(0, y, z));
                    for (int x = 0; x < size.x; ++x)
                        if (row[x] != last)
                            add_sorted(in_brick_[index], last = row[x]);
                }
        }
    });
}

/// Whether a brick and those beside it have one label only.
bool LabelBricks::is_surely_inside(const glm::ivec3& at, std::int32_t label) const
{
    const auto has_only = [&](const glm::ivec3& place) {
        const std::vector<std::int32_t>& found = in_brick_[place_in(bricks_, place)];
        return found.size() == 1 && found[0] == label;
    };
    if (!has_only(at))
        return false;
    for (int axis = 0; axis < 3; ++axis)
        for (const int step : {-1, 1}) {
            glm::ivec3 beside = at;
            beside[axis] += step;
            if (beside[axis] >= 0 && beside[axis] < bricks_[axis] && !has_only(beside))
                return false;
        }
    return true;
}

LabelBricks::Chosen LabelBricks::widened(const Chosen& chosen, const glm::ivec3& reach) const
{
    Chosen result(chosen.size(), 0);
    for (std::size_t index = 0; index < chosen.size(); ++index)
        if (chosen[index] != 0) {
            const Brick brick = brick_at(labels_.shape, at_place(bricks_, index));
            for_bricks(bricks_, brick.first - reach, brick.first + (brick_size - 1) + reach,
                       [&](std::size_t near) { result[near] = 1; });
        }
    return result;
}

BrickLayout LabelBricks::layout_around(std::int32_t label, const glm::ivec3& reach, const Chosen* chosen) const
{
    // The voxels of the label in each brick that have a face in common with another label.
    struct Range {
        glm::ivec3 first{std::numeric_limits<int>::max()}, last{-1};
    };
    std::vector<Range> faces(in_brick_.size());
    parallel_for(in_brick_.size(), 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t index = begin; index < end; ++index) {
            const glm::ivec3 at = at_place(bricks_, index);
            if (!std::binary_search(in_brick_[index].begin(), in_brick_[index].end(), label) ||
                is_surely_inside(at, label))
                continue;
            const auto [first, size] = brick_at(labels_.shape, at);
            const glm::ivec3 after = first + size;
            glm::ivec3 voxel;
            for (voxel.z = first.z; voxel.z < after.z; ++voxel.z)
                for (voxel.y = first.y; voxel.y < after.y; ++voxel.y)
                    for (voxel.x = first.x; voxel.x < after.x; ++voxel.x)
                        if (labels_.at(voxel) == label && has_face(voxel, label)) {
                            faces[index].first = glm::min(faces[index].first, voxel);
                            faces[index].last = glm::max(faces[index].last, voxel);
                        }
        }
    });
    Chosen is_near(in_brick_.size(), 0);
    for (const Range& range : faces)
        if (range.first.x <= range.last.x)
            for_bricks(bricks_, range.first - reach - 1, range.last + reach + 1,
                       [&](std::size_t index) { is_near[index] = 1; });

    BrickLayout layout(labels_.shape);
    const Chosen computed = chosen != nullptr ? widened(*chosen, reach) : is_near;
    const Chosen read = chosen != nullptr ? widened(computed, 2 * reach) : is_near;
    for (std::size_t index = 0; index < is_near.size(); ++index)
        if (is_near[index] != 0 && read[index] != 0)
            layout.store(index, computed[index] != 0);
    return layout;
}

bool LabelBricks::has_face(const glm::ivec3& voxel, std::int32_t label) const
{
    for (int axis = 0; axis < 3; ++axis)
        for (const int step : {-1, 1}) {
            glm::ivec3 beside = voxel;
            beside[axis] += step;
            if (beside[axis] >= 0 && beside[axis] < labels_.shape[axis] && labels_.at(beside) != label)
                return true;
        }
    return false;
}

LabelBricks::Meetings LabelBricks::meetings(const BrickLayout& layout, const glm::ivec3& reach) const
{
    std::vector<std::vector<std::int32_t>> near(layout.stored.size());
    parallel_for(near.size(), 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t number = begin; number < end; ++number) {
            const Brick brick = layout.brick(number);
            for_bricks(bricks_, brick.first - reach, brick.first + (brick_size - 1) + reach, [&](std::size_t index) {
                for (const std::int32_t label : in_brick_[index])
                    add_sorted(near[number], label);
            });
        }
    });
    Meetings meetings{Chosen(in_brick_.size(), 0), {}};
    for (std::size_t number = 0; number < near.size(); ++number)
        if (near[number].size() > 2) {
            meetings.bricks[layout.stored[number]] = 1;
            for (const std::int32_t label : near[number])
                add_sorted(meetings.labels, label);
        }
    return meetings;
}

std::vector<float> dense(const BrickField& field)
{
    const BrickLayout& layout = *field.layout;
    std::vector<float> numbers(place_count(layout.shape));
    parallel_for(layout.place.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t index = begin; index < end; ++index) {
            const auto [first, size] = brick_at(layout.shape, at_place(layout.bricks, index));
            const float* const from = field.find(index);
            for (int z = 0; z < size.z; ++z)
                for (int y = 0; y < size.y; ++y) {
                    float* const to = numbers.data() + place_in(layout.shape, first + glm::ivec3(0, y, z));
                    if (from != nullptr)
                        std::copy_n(from + brick_size * (y + brick_size * z), size.x, to);
                    else
                        std::fill_n(to, size.x, field.constants[index]);
                }
        }
    });
    return numbers;
}

double sum_of_products(const BrickField& a, const BrickField& b)
{
    double sum = 0.0;
    for (std::size_t number = 0; number < a.layout->stored.size(); ++number) {
        const glm::ivec3 size = a.layout->brick(number).size;
        const float *const of_a = a.numbers(number), *const of_b = b.numbers(number);
        for (int z = 0; z < size.z; ++z)
            for (int y = 0; y < size.y; ++y)
                for (int x = 0; x < size.x; ++x) {
                    const auto i = static_cast<std::size_t>(x + brick_size * (y + brick_size * z));
                    sum += static_cast<double>(of_a[i]) * static_cast<double>(of_b[i]);
                }
    }
    return sum;
}

} // namespace isospline
