// The checksum CRC-32C (Castagnoli) of Zarr's codec crc32c (RFC 3720, appendix B.4).
#pragma once

#include <cstddef>
#include <cstdint>

namespace isospline {

std::uint32_t crc32c(const void* data, std::size_t size);

} // namespace isospline
