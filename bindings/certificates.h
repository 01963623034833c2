// Converts certificates of rays to NumPy arrays.
#pragma once

#include "arrays.h"
#include "long_call.h"
#include "rays.h"

#include "isospline/scene/scene.h"
#include "isospline/scene/scene_certifier.h"
#include "isospline/trace/certified_ray.h"

#include <pybind11/numpy.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace isospline {

/// The arrays that a ray query adds with `certify`.
class CertificateArrays {
public:
    explicit CertificateArrays(const Shape& shape)
        : statuses_(shape), t_bounds_(with_last(shape, 2)), level_bounds_(shape), normal_axes_(with_last(shape, 3)),
          normal_angles_(shape),
          model_distances_(shape), to_{statuses_.mutable_data(),      t_bounds_.mutable_data(),
                                       level_bounds_.mutable_data(),  normal_axes_.mutable_data(),
                                       normal_angles_.mutable_data(), model_distances_.mutable_data()}
    {
    }

    /// May be called without the GIL.
    void set(std::size_t at, const RayCertificate& certificate)
    {
        to_.statuses[at] = static_cast<std::uint8_t>(certificate.status);
        to_.t_bounds[2 * at] = certificate.t_lower;
        to_.t_bounds[2 * at + 1] = certificate.t_upper;
        to_.level_bounds[at] = certificate.level_bound;
        for (int axis = 0; axis < 3; ++axis)
            to_.normal_axes[3 * at + static_cast<std::size_t>(axis)] = certificate.normal[axis];
        to_.normal_angles[at] = certificate.normal_angle;
        to_.model_distances[at] = certificate.model_distance;
    }

    pybind11::dict added_to(pybind11::dict result) const
    {
        result["statuses"] = statuses_;
        result["t_bounds"] = t_bounds_;
        result["level_bounds"] = level_bounds_;
        result["normal_axes"] = normal_axes_;
        result["normal_angles"] = normal_angles_;
        result["model_distances"] = model_distances_;
        return result;
    }

private:
    struct Numbers {
        std::uint8_t* statuses;
        double *t_bounds, *level_bounds, *normal_axes, *normal_angles, *model_distances;
    };

    static Shape with_last(Shape shape, int count)
    {
        shape.push_back(count);
        return shape;
    }

    pybind11::array_t<std::uint8_t> statuses_;
    pybind11::array_t<double> t_bounds_, level_bounds_, normal_axes_, normal_angles_, model_distances_;
    Numbers to_; ///< of the arrays, for threads without the GIL
};

/// The code of an answer that may not be proven: 0 for no, 1 for yes, 2 for undecided.
inline std::uint8_t code_of(std::optional<bool> proven)
{
    return proven ? static_cast<std::uint8_t>(*proven) : static_cast<std::uint8_t>(RayStatus::undecided);
}

/// The codes of answers about rays, certify(certifier, ray), for the objects that they see.
template <typename Certify>
pybind11::array certified_codes(Scene& scene, const GivenRays& given, bool SeenBy::*sees,
                                const pybind11::object& progress, const Certify& certify)
{
    pybind11::array_t<std::uint8_t> result(given.rows.leading_shape());
    std::uint8_t* const codes = result.mutable_data();
    long_call("to certify " + std::to_string(given.count()) + " rays", progress, [&](const Progress& report) {
        const auto snapshot = scene.snapshot(part_of(report, 0.0, 0.05));
        const SceneCertifier certifier(*snapshot, sees);
        given.for_each_chunk(part_of(report, 0.05, 1.0), [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const Ray ray = given.ray(i);
                check_ray(ray, i);
                codes[given.order(i)] = code_of(certify(certifier, ray));
            }
        });
    });
    return result;
}

} // namespace isospline
