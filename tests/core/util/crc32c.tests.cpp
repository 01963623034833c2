#include "isospline/util/crc32c.h"

#include "catch.h"

#include <cstring>
#include <string>
#include <vector>

using namespace isospline;

// RFC 3720, appendix B.4.
TEST_CASE("checksums are those of the standard's examples", "[util]")
{
    std::vector<unsigned char> bytes(32, 0);
    REQUIRE(crc32c(bytes.data(), bytes.size()) == 0x8a9136aa);
    bytes.assign(32, 0xff);
    REQUIRE(crc32c(bytes.data(), bytes.size()) == 0x62a8ab43);
    for (unsigned char i = 0; i < 32; ++i)
        bytes[i] = i;
    REQUIRE(crc32c(bytes.data(), bytes.size()) == 0x46dd794e);
    const std::string digits = "123456789";
    REQUIRE(crc32c(digits.data(), digits.size()) == 0xe3069283);
    REQUIRE(crc32c(digits.data(), 0) == 0);
}
