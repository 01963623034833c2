#include "isospline/shade/environment_light.h"

#include "isospline/math/frame.h"
#include "isospline/util/check.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace isospline {

namespace {

double luminance(const glm::vec3& color)
{
    return glm::dot(glm::dvec3(color), glm::dvec3(0.2126, 0.7152, 0.0722));
}

/// The first running sum above u times the last one, and the position between it and the sum before.
std::pair<std::size_t, double> draw(const double* sums, std::size_t count, double u)
{
    const double wanted = u * sums[count - 1];
    // Rounding may reach the last sum itself. Items without a part of the sum are never drawn.
    auto at = static_cast<std::size_t>(std::upper_bound(sums, sums + count, wanted) - sums);
    at = std::min(at, count - 1);
    while (at > 0 && sums[at] == sums[at - 1])
        --at;
    const double before = at > 0 ? sums[at - 1] : 0.0;
    return {at, std::clamp((wanted - before) / (sums[at] - before), 0.0, 1.0)};
}

} // namespace

EnvironmentMap::EnvironmentMap(glm::ivec2 size, std::vector<glm::vec3> pixels) : size_(size), pixels_(std::move(pixels))
{
    if (size.x < 1 || size.y < 1 ||
        pixels_.size() != static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y))
        throw_invalid("image", "at least one pixel, and as many as width times height", pixels_.size());
    for (std::size_t i = 0; i < pixels_.size(); ++i)
        check_not_negative("image", glm::dvec3(pixels_[i]));

    const auto width = static_cast<std::size_t>(size.x), height = static_cast<std::size_t>(size.y);
    row_sums_.resize(height);
    column_sums_.resize(pixels_.size());
    double total = 0.0;
    for (std::size_t row = 0; row < height; ++row) {
        double sum = 0.0;
        for (std::size_t column = 0; column < width; ++column)
            column_sums_[row * width + column] = sum += luminance(pixels_[row * width + column]);
        const double upper = std::cos(pi * static_cast<double>(row) / static_cast<double>(height));
        const double lower = std::cos(pi * static_cast<double>(row + 1) / static_cast<double>(height));
        row_sums_[row] = total += sum * (upper - lower) * 2.0 * pi / static_cast<double>(width);
    }
}

std::size_t EnvironmentMap::pixel_of(const glm::dvec3& direction) const
{
    const double polar = std::acos(std::clamp(direction.z, -1.0, 1.0)) / pi;
    const double azimuth = 0.5 - std::atan2(direction.y, direction.x) / (2.0 * pi);
    const auto cell = [](double part, int count) {
        return static_cast<std::size_t>(std::clamp(static_cast<int>(part * count), 0, count - 1));
    };
    return cell(polar, size_.y) * static_cast<std::size_t>(size_.x) + cell(azimuth, size_.x);
}

double EnvironmentMap::density(const glm::dvec3& direction) const
{
    const double total = row_sums_.back();
    return total > 0.0 ? luminance(pixels_[pixel_of(direction)]) / total : 0.0;
}

std::optional<LightSample> EnvironmentMap::sample(const glm::dvec2& u) const
{
    const double total = row_sums_.back();
    if (!(total > 0.0))
        return std::nullopt;
    const auto width = static_cast<std::size_t>(size_.x), height = static_cast<std::size_t>(size_.y);
    const auto [row, v] = draw(row_sums_.data(), height, u.y);
    const auto [column, h] = draw(column_sums_.data() + row * width, width, u.x);

    const double upper = std::cos(pi * static_cast<double>(row) / static_cast<double>(height));
    const double lower = std::cos(pi * static_cast<double>(row + 1) / static_cast<double>(height));
    const double z = upper + v * (lower - upper);
    const double azimuth = 2.0 * pi * (0.5 - (static_cast<double>(column) + h) / static_cast<double>(width));
    const double radius = std::sqrt(std::max(1.0 - z * z, 0.0));
    const glm::vec3& pixel = pixels_[row * width + column];
    const double density = luminance(pixel) / total;
    return LightSample{{radius * std::cos(azimuth), radius * std::sin(azimuth), z},
                       std::numeric_limits<double>::infinity(),
                       glm::dvec3(pixel) / density,
                       density};
}

void validate(const EnvironmentLight& light)
{
    check_not_negative("radiance", light.radiance);
    const glm::dmat3 product = glm::transpose(light.rotation) * light.rotation;
    double error = std::abs(glm::determinant(light.rotation) - 1.0);
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row)
            error = std::max(error, std::abs(product[column][row] - (row == column ? 1.0 : 0.0)));
    if (!(error < 1e-6))
        throw_invalid("rotation", "a rotation matrix", "one that is off by " + std::to_string(error));
}

Emission emission(const EnvironmentLight& light, const glm::dvec3& direction)
{
    Emission result{std::numeric_limits<double>::infinity(), light.radiance, 0.0};
    if (light.map) {
        const glm::dvec3 local = glm::transpose(light.rotation) * direction;
        result.radiance *= light.map->radiance(local);
        result.density = light.map->density(local);
    }
    return result;
}

std::optional<LightSample> sample(const EnvironmentLight& light, const glm::dvec2& u)
{
    if (!light.map)
        return std::nullopt;
    std::optional<LightSample> drawn = light.map->sample(u);
    if (drawn) {
        drawn->direction = light.rotation * drawn->direction;
        drawn->weight *= light.radiance;
    }
    return drawn;
}

} // namespace isospline
