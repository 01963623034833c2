// Tests that `make test` runs with few cases, and `make test-long` with many.
#pragma once

#include <cstdlib>

namespace isospline {

/// Whether ISOSPLINE_LONG_TESTS is set.
inline bool are_tests_long()
{
    return std::getenv("ISOSPLINE_LONG_TESTS") != nullptr;
}

} // namespace isospline
