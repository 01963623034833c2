// The machine's memory.
#pragma once

#include <cstddef>

namespace isospline {

/// The operating system's estimate of the bytes that can be allocated without swapping; the largest number if it has no
/// estimate.
std::size_t available_memory();

/// Asks the operating system for huge pages for a large array that has not been written yet: this saves page faults
/// while it is filled, and TLB misses while it is read at random. Does nothing if the system has no huge pages.
void prefer_huge_pages(void* data, std::size_t size);

} // namespace isospline
