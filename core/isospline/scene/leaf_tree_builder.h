// Builds the tree of a settled index with Embree's builder.
#pragma once

#include "isospline/math/box.h"
#include "isospline/scene/device.h"
#include "isospline/trace/leaf_tree.h"
#include "isospline/util/progress.h"

#include <cstddef>
#include <functional>

namespace isospline {

/// The tree of `count` leaves, at least one; `box(i)` is that of leaf i. Throws Cancelled if `progress` returns false,
/// and std::bad_alloc if memory runs out.
LeafTree build_leaf_tree(const Device& device, std::size_t count, const std::function<Box(unsigned int)>& box,
                         const Progress& progress = {});

} // namespace isospline
