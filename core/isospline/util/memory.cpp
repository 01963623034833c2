#include "isospline/util/memory.h"

#include <cstdint>
#include <fstream>
#include <limits>
#include <string>

#include <sys/mman.h>
#include <unistd.h>

namespace isospline {

std::size_t available_memory()
{
    std::ifstream file("/proc/meminfo");
    std::string key, unit;
    std::size_t kilobytes = 0;
    while (file >> key >> kilobytes && std::getline(file, unit))
        if (key == "MemAvailable:")
            return kilobytes * 1024;
    return std::numeric_limits<std::size_t>::max();
}

void prefer_huge_pages(void* data, std::size_t size)
{
    // Only whole pages inside of the array: the memory around it may belong to others.
    const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
    const auto address = reinterpret_cast<std::uintptr_t>(data);
    const auto begin = (address + page - 1) / page * page, end = (address + size) / page * page;
    if (begin < end)
        madvise(static_cast<char*>(data) + (begin - address), end - begin, MADV_HUGEPAGE);
}

} // namespace isospline
