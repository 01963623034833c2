#include "isospline/util/crc32c.h"

#include <array>
#include <bit>
#include <cstring>

namespace isospline {

namespace {

static_assert(std::endian::native == std::endian::little);

using Table = std::array<std::uint32_t, 256>;

/// Table i advances a byte that i more bytes follow.
constexpr std::array<Table, 8> make_tables()
{
    constexpr std::uint32_t reflected_polynomial = 0x82f63b78;
    std::array<Table, 8> tables{};
    for (std::uint32_t byte = 0; byte < 256; ++byte) {
        std::uint32_t rest = byte;
        for (int bit = 0; bit < 8; ++bit)
            rest = rest >> 1 ^ ((rest & 1u) != 0 ? reflected_polynomial : 0u);
        tables[0][byte] = rest;
    }
    for (std::size_t i = 1; i < tables.size(); ++i)
        for (std::size_t byte = 0; byte < 256; ++byte)
            tables[i][byte] = tables[i - 1][byte] >> 8 ^ tables[0][tables[i - 1][byte] & 0xffu];
    return tables;
}

constexpr std::array<Table, 8> tables = make_tables();

} // namespace

std::uint32_t crc32c(const void* data, std::size_t size)
{
    const auto* bytes = static_cast<const unsigned char*>(data);
    std::uint32_t rest = ~std::uint32_t{0};
    for (; size >= 8; size -= 8, bytes += 8) {
        std::uint64_t word;
        std::memcpy(&word, bytes, sizeof word);
        word ^= rest;
        rest = 0;
        for (std::size_t i = 0; i < 8; ++i)
            rest ^= tables[7 - i][word >> 8 * i & 0xffu];
    }
    for (; size > 0; --size, ++bytes)
        rest = rest >> 8 ^ tables[0][(rest ^ *bytes) & 0xffu];
    return ~rest;
}

} // namespace isospline
