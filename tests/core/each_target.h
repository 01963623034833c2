// Runs a check on every SIMD target that the machine has, for tests.
#pragma once

#include "catch.h"

#include <hwy/highway.h>

#include <cstdint>

namespace isospline {

/// Calls `check` once for each SIMD target, with everything that is above the target switched off; the baseline cannot
/// be.
template <typename Check>
void for_each_target(const Check& check)
{
    const std::int64_t all = hwy::SupportedTargets() & HWY_TARGETS;
    for (std::int64_t rest = all; rest != 0; rest &= rest - 1) {
        const std::int64_t target = rest & -rest;
        hwy::SetSupportedTargetsForTest(target | HWY_STATIC_TARGET);
        hwy::GetChosenTarget().DeInit();
        INFO(hwy::TargetName(target));
        check();
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().DeInit();
}

} // namespace isospline
