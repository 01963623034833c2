// Errors: bad input is std::invalid_argument, a broken invariant is an assertion that prints its operands.
#pragma once

#include <sstream>
#include <stdexcept>
#include <string>

namespace isospline {

/// An error for bad input, worded the same way everywhere: `level: expected a finite number, got nan`.
template <typename Got>
[[noreturn]] void throw_invalid(const char* parameter, const std::string& expected, const Got& got)
{
    std::ostringstream message;
    message << parameter << ": expected " << expected << ", got " << got;
    throw std::invalid_argument(message.str());
}

namespace detail {
[[noreturn]] void assertion_failed(const char* expression, const std::string& operands, const char* file, int line);
}

} // namespace isospline

/// Checks an invariant `a op b` in builds without NDEBUG; prints both operands and aborts if it does not hold.
#ifdef NDEBUG
#define ISOSPLINE_ASSERT(a, op, b) static_cast<void>(0)
#else
#define ISOSPLINE_ASSERT(a, op, b)                                                                                     \
    do {                                                                                                               \
        if (!((a)op(b))) {                                                                                             \
            std::ostringstream operands_;                                                                              \
            operands_ << (a) << " and " << (b);                                                                        \
            ::isospline::detail::assertion_failed(#a " " #op " " #b, operands_.str(), __FILE__, __LINE__);             \
        }                                                                                                              \
    } while (false)
#endif
