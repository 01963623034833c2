// The tolerance at which a mesh has a number of faces.
#pragma once

#include <cstddef>
#include <optional>

namespace isospline {

/// Searches the smallest tolerance at which a mesh has at most a number of faces, with few meshes.
///
/// The number of faces is roughly a power of the tolerance: steps are those of the secant in logarithms. Between a
/// tolerance that gives too many faces and one that does not, every third step is a bisection. The search ends if at
/// least `enough` of the faces are used, if a tolerance that is 5% smaller gives too many, or at `finest`.
class ToleranceSearch {
public:
    static constexpr double enough = 0.85;

    /// 0 < finest <= first <= coarsest.
    ToleranceSearch(std::size_t faces, double first, double finest, double coarsest);

    /// The tolerance of the next mesh; none when the search has ended.
    std::optional<double> next() const { return next_; }
    /// The number of faces of the mesh with the tolerance `next()`. Returns whether they are few enough.
    bool add(std::size_t count);

private:
    struct Trial {
        double tolerance, count; ///< logarithms
    };

    double extrapolated(const Trial& trial) const;
    double interpolated();
    std::optional<double> after(const Trial& trial);

    double faces_, finest_, coarsest_; ///< logarithms
    std::optional<double> next_;
    std::optional<Trial> last_, many_, few_; ///< many_: too many faces, the largest tolerance; few_: the smallest
    double slope_ = -1.0;                    ///< of the logarithm of the number of faces
    int interpolations_ = 0;
};

} // namespace isospline
