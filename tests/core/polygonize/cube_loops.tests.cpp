#include "catch.h"

#include "isospline/polygonize/cube_loops.h"

#include <bit>
#include <map>
#include <set>
#include <utility>

using namespace isospline;

namespace {

/// Edges, and diagonals of split faces, whose ends are on different sides.
std::set<CubeEdge> crossed_edges(unsigned solid, unsigned split)
{
    std::set<CubeEdge> edges;
    for (int lower = 0; lower < 8; ++lower)
        for (int direction = 1; direction < 8; ++direction) {
            if ((lower & direction) != 0 || (solid >> lower & 1u) == (solid >> (lower + direction) & 1u))
                continue;
            const auto edge = cube_edge(lower, lower + direction);
            const bool is_diagonal = std::popcount(static_cast<unsigned>(direction)) == 2;
            if (std::popcount(static_cast<unsigned>(direction)) == 1 || (is_diagonal && (faces_of(edge) & split) != 0))
                edges.insert(edge);
        }
    return edges;
}

} // namespace

TEST_CASE("each crossed edge of a cube is in one loop, and loops go along faces", "[polygonize]")
{
    for (unsigned solid = 0; solid < 256; ++solid)
        for (unsigned faces = 0; faces < 64; ++faces)
            for (const unsigned split : {0u, faces, 63u}) {
                const CubeLoops loops(solid, faces & CubeLoops::ambiguous_faces(solid), split);
                std::set<CubeEdge> seen;
                bool all_on_faces = true, all_long = true;
                std::size_t count = 0;
                for (int i = 0; i < loops.count(); ++i) {
                    const auto loop = loops.loop(i);
                    all_long &= loop.size() >= 3;
                    count += loop.size();
                    for (std::size_t j = 0; j < loop.size(); ++j) {
                        seen.insert(loop[j]);
                        all_on_faces &= (faces_of(loop[j]) & faces_of(loop[(j + 1) % loop.size()])) != 0;
                    }
                }
                REQUIRE(all_on_faces);
                REQUIRE(all_long);
                REQUIRE(count == seen.size());
                REQUIRE(seen == crossed_edges(solid, split));
            }
}

TEST_CASE("cubes agree on shared faces, with opposite directions", "[polygonize]")
{
    // What is on the face of the cube below, by the corners (y, z) that edges join.
    using Step = std::pair<std::pair<int, int>, std::pair<int, int>>;
    const auto steps_on = [](const CubeLoops& loops, int face, int drop) {
        std::set<Step> steps;
        for (int i = 0; i < loops.count(); ++i) {
            const auto loop = loops.loop(i);
            for (std::size_t j = 0; j < loop.size(); ++j) {
                const CubeEdge a = loop[j], b = loop[(j + 1) % loop.size()];
                if ((faces_of(a) & faces_of(b) & 1u << face) != 0)
                    steps.insert(
                        {{lower_corner(a) - drop, edge_direction(a)}, {lower_corner(b) - drop, edge_direction(b)}});
            }
        }
        return steps;
    };
    for (int axis = 0; axis < 3; ++axis)
        for (unsigned signs = 0; signs < 16; ++signs)
            for (unsigned others = 0; others < 256; ++others) {
                const int bit = 1 << axis;
                unsigned below = 0, above = 0;
                for (int corner = 0, on_face = 0, off_face = 0; corner < 8; ++corner) {
                    if ((corner & bit) != 0) {
                        below |= (signs >> on_face & 1u) << corner;
                        above |= (signs >> on_face & 1u) << (corner - bit);
                        ++on_face;
                    } else {
                        below |= (others >> off_face & 1u) << corner;
                        above |= (others >> (4 + off_face) & 1u) << (corner + bit);
                        ++off_face;
                    }
                }
                for (const bool joined : {false, true})
                    for (const bool split : {false, true}) {
                        const unsigned upper_face = 1u << (axis + 3), lower_face = 1u << axis;
                        const CubeLoops of_below(below, joined ? upper_face & CubeLoops::ambiguous_faces(below) : 0u,
                                                 split ? upper_face : 0u);
                        const CubeLoops of_above(above, joined ? lower_face & CubeLoops::ambiguous_faces(above) : 0u,
                                                 split ? lower_face : 0u);
                        std::set<Step> reversed;
                        for (const auto& [from, to] : steps_on(of_above, axis, 0))
                            reversed.insert({to, from});
                        REQUIRE(steps_on(of_below, axis + 3, bit) == reversed);
                    }
            }
}
