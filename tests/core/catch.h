// Catch2 2 (Debian 12) and 3 (Debian 13) behind one include.
#pragma once

#if ISOSPLINE_CATCH2_VERSION_MAJOR >= 3
#include <catch2/catch_all.hpp>
using Catch::Approx;
using Catch::Matchers::ContainsSubstring;
#else
#include <catch2/catch.hpp>

#include <string>

inline auto ContainsSubstring(const std::string& part)
{
    return Catch::Matchers::Contains(part);
}
#endif
