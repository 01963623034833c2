#include "isospline/render/path_tracer.h"

#include "isospline/util/error.h"

namespace isospline {

void validate(const PathTracer& path_tracer)
{
    validate(path_tracer.material);
    for (const auto& [geometry_id, material] : path_tracer.material_of_geometry)
        validate(material);
    int environments = 0;
    for (const Emitter& light : path_tracer.lights) {
        environments += std::holds_alternative<EnvironmentLight>(light);
        std::visit([](const auto& source) { validate(source); }, light);
    }
    if (environments > 1)
        throw_invalid("lights", "one environment at most", environments);
    if (path_tracer.max_bounces < 0)
        throw_invalid("max_bounces", "a number of at least 0", path_tracer.max_bounces);
}

} // namespace isospline
