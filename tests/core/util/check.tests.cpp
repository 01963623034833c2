#include "catch.h"

#include "isospline/util/check.h"

using namespace isospline;

TEST_CASE("counts end where 32 bits do", "[util]")
{
    REQUIRE_NOTHROW(check_count("faces", 0xffffffff));
    REQUIRE_THROWS_WITH(check_count("faces", std::uint64_t{1} << 32),
                        "faces: expected at most 4294967295, got 4294967296");
}
