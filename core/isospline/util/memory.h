// The machine's memory.
#pragma once

#include <cstddef>

namespace isospline {

/// Bytes that may be allocated now without swapping, as the operating system estimates them; the largest number where
/// it does not say.
std::size_t available_memory();

/// Asks the operating system for huge pages under a large array that is yet to be written: fewer page faults while it
/// is filled, fewer misses of the address cache while it is read at random. Does nothing where there is no such thing.
void prefer_huge_pages(void* data, std::size_t size);

} // namespace isospline
