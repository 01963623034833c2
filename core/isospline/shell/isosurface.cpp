#include "isospline/shell/isosurface.h"

#include "isospline/util/check.h"
#include "isospline/util/fork.h"

#include <glm/common.hpp>

#include <mutex>
#include <string>
#include <utility>

namespace isospline {

namespace {

void check_volume(const std::shared_ptr<const Volume>& volume)
{
    if (!volume)
        throw_invalid("volume", "a volume", "none");
    if (volume->degree() < 1 || volume->degree() > 3)
        throw_invalid("volume", "a degree of 1, 2 or 3", volume->degree());
    const glm::ivec3 cells = volume->cell_shape();
    const auto text = to_text(glm::dvec3(volume->shape())) + " samples";
    if (cells.x < 1 || cells.y < 1 || cells.z < 1)
        throw_invalid("volume", "at least two samples along each axis for an odd degree", text);
    if (cells.x > 65535 || cells.y > 65535 || cells.z > 65535)
        throw_invalid("volume", "at most 65535 cells along each axis", text);
}

void check_level(double level)
{
    if (!is_finite(level))
        throw_invalid("level", "a finite number", level);
}

void check_mask(const Mask& mask, const Volume& volume)
{
    const glm::vec<3, std::size_t> shape(volume.shape());
    const std::size_t samples = shape.x * shape.y * shape.z;
    if (!mask.empty() && mask.size() != samples)
        throw_invalid("mask", "one byte for each of " + std::to_string(samples) + " samples", mask.size());
}

void check_clip(const std::vector<HalfSpace>& clip)
{
    for (const HalfSpace& half_space : clip) {
        check_direction("clip", half_space.normal);
        if (!is_finite(half_space.offset))
            throw_invalid("clip", "a finite offset", half_space.offset);
    }
}

} // namespace

IsosurfaceSnapshot::IsosurfaceSnapshot(const IsosurfaceSnapshot& other, double level, const Progress& progress)
    : volume_(other.volume_), bounds_(other.bounds_), options_(other.options_), clip_lattice_(other.clip_lattice_),
      level_(level), threshold_(level - volume_->offset()),
      shell_(*volume_, *bounds_, threshold_, options_->shell, clip_lattice_, progress)
{
}

Isosurface::Isosurface(std::shared_ptr<const Volume> volume, double level, IsosurfaceOptions options,
                       std::shared_ptr<const ValueBounds> bounds, const Progress& progress)
{
    check_volume(volume);
    check_mask(options.shell.mask, *volume);
    check_clip(options.clip);
    check_level(level);
    IsosurfaceSnapshot common;
    for (const HalfSpace& half_space : options.clip)
        common.clip_lattice_.push_back(pull_back(half_space, volume->lattice_to_world()));
    common.bounds_ = bounds ? std::move(bounds) : std::make_shared<const ValueBounds>(*volume);
    common.options_ = std::make_shared<const IsosurfaceOptions>(std::move(options));
    common.volume_ = std::move(volume);
    snapshot_.reset(new IsosurfaceSnapshot(common, level, progress));
}

Isosurface::Isosurface(const Isosurface& other) : snapshot_(other.snapshot())
{
}

std::shared_ptr<const IsosurfaceSnapshot> Isosurface::snapshot() const
{
    const std::lock_guard lock(moment_mutex(this));
    return snapshot_;
}

void Isosurface::set_level(double level, const Progress& progress)
{
    check_level(level);
    std::shared_ptr<const IsosurfaceSnapshot> changed(new IsosurfaceSnapshot(*snapshot(), level, progress));
    const std::lock_guard lock(moment_mutex(this));
    snapshot_.swap(changed); // so that the one before goes after the lock
}

} // namespace isospline
