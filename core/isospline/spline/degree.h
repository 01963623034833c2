// From a degree that is known at run time to one that is a constant.
#pragma once

#include <type_traits>

namespace isospline {

/// Calls function(std::integral_constant<int, degree>()) and returns what that does; the degree is one from `Least` to
/// `Most`, by default one that surfaces have.
template <int Least = 1, int Most = 3, typename Function>
decltype(auto) dispatch_degree(int degree, const Function& function)
{
    if constexpr (Least < Most)
        if (degree != Least)
            return dispatch_degree<Least + 1, Most>(degree, function);
    return function(std::integral_constant<int, Least>());
}

} // namespace isospline
