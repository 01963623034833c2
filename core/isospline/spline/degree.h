// Turns a degree that is known at run time into a compile-time constant.
#pragma once

#include <type_traits>

namespace isospline {

/// Calls function(std::integral_constant<int, degree>()) and returns its result. The degree is `Least` to `Most`; the
/// defaults are the degrees of surfaces.
template <int Least = 1, int Most = 3, typename Function>
decltype(auto) dispatch_degree(int degree, const Function& function)
{
    if constexpr (Least < Most)
        if (degree != Least)
            return dispatch_degree<Least + 1, Most>(degree, function);
    return function(std::integral_constant<int, Least>());
}

} // namespace isospline
