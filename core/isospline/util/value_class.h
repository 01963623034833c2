// The names of a struct of values and of its parameters, for bindings to other languages.
#pragma once

namespace isospline {

/// A member of a struct, and the name of the parameter that sets it.
template <typename Struct, typename Member>
struct Parameter {
    const char* name;
    Member Struct::*member;
};

template <typename Struct, typename Member>
Parameter(const char*, Member Struct::*) -> Parameter<Struct, Member>;

/// The class of values that a struct is in other languages. Its specializations stand beside the structs. They have the
/// `name` of the class and `parameters`, a tuple.
template <typename Struct>
struct ValueClass;

} // namespace isospline
