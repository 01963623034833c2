// Exact sums and products of doubles: J. R. Shewchuk, "Adaptive precision floating-point arithmetic and fast robust
// geometric predicates", Discrete & Computational Geometry 18(3), 1997.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace isospline {

/// An exact number: a sum of doubles that do not overlap, in ascending order of magnitude. Its sums and products are
/// exact unless they overflow, or a product of doubles has digits below the least double, 2^-1074.
class Expansion {
public:
    Expansion() = default;
    explicit Expansion(double value) { add(value); }
    Expansion(const Expansion& other) { *this = other; }

    // Copies only the terms in use.
    Expansion& operator=(const Expansion& other)
    {
        std::copy_n(other.terms_.begin(), other.size_, terms_.begin());
        size_ = other.size_;
        return *this;
    }

    static Expansion difference(double a, double b)
    {
        Expansion result(a);
        result.add(-b);
        return result;
    }

    Expansion& operator+=(const Expansion& other)
    {
        for (int i = 0; i < other.size_; ++i)
            add(other.terms_[i]);
        compress();
        return *this;
    }

    Expansion& operator-=(const Expansion& other)
    {
        for (int i = 0; i < other.size_; ++i)
            add(-other.terms_[i]);
        compress();
        return *this;
    }

    friend Expansion operator+(Expansion a, const Expansion& b) { return a += b; }
    friend Expansion operator-(Expansion a, const Expansion& b) { return a -= b; }

    friend Expansion operator*(const Expansion& a, const Expansion& b)
    {
        Expansion result;
        for (int j = 0; j < b.size_; ++j) {
            for (int i = 0; i < a.size_; ++i) {
                const double product = a.terms_[i] * b.terms_[j];
                result.add(std::fma(a.terms_[i], b.terms_[j], -product));
                result.add(product);
            }
            result.compress();
        }
        return result;
    }

    /// The sign: 1, 0 or -1.
    int sign() const { return size_ == 0 ? 0 : (terms_[size_ - 1] > 0.0 ? 1 : -1); }

    /// The number, rounded to within some units in the last place.
    double rounded() const
    {
        double sum = 0.0;
        for (int i = 0; i < size_; ++i)
            sum += terms_[i];
        return sum;
    }

private:
    // Terms of a compressed expansion are at least 53 bits apart, and doubles have bits from 2^-1074 to 2^1023: there
    // are at most 40. At most twice as many are added before it is compressed again.
    static constexpr std::size_t capacity = 3 * 42;

    // Grow-Expansion, Shewchuk's figure 6, without terms that are zero.
    void add(double value)
    {
        int kept = 0;
        for (int i = 0; i < size_; ++i) {
            const double term = terms_[i], sum = value + term;
            const double term_in_sum = sum - value;
            const double rest = (value - (sum - term_in_sum)) + (term - term_in_sum);
            if (rest != 0.0)
                terms_[kept++] = rest;
            value = sum;
        }
        if (value != 0.0)
            terms_[kept++] = value;
        size_ = kept;
    }

    // Compress, figure 15: to the fewest terms.
    void compress()
    {
        if (size_ < 2)
            return;
        int bottom = size_ - 1;
        double sum = terms_[bottom];
        for (int i = size_ - 2; i >= 0; --i) {
            const double next = sum + terms_[i], rest = terms_[i] - (next - sum);
            sum = next;
            if (rest != 0.0) {
                terms_[bottom--] = sum;
                sum = rest;
            }
        }
        int kept = 0;
        for (int i = bottom + 1; i < size_; ++i) {
            const double next = terms_[i] + sum, rest = sum - (next - terms_[i]);
            sum = next;
            if (rest != 0.0)
                terms_[kept++] = rest;
        }
        terms_[kept++] = sum;
        size_ = kept;
    }

    std::array<double, capacity> terms_;
    int size_ = 0;
};

} // namespace isospline
