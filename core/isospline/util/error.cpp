#include "isospline/util/error.h"

#include <cstdio>
#include <cstdlib>

namespace isospline::detail {

void assertion_failed(const char* expression, const std::string& operands, const char* file, int line)
{
    std::fprintf(stderr, "%s:%d: assertion failed: %s, with %s\n", file, line, expression, operands.c_str());
    std::abort();
}

} // namespace isospline::detail
