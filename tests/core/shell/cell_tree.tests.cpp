#include "catch.h"
#include "volumes.h"

#include "isospline/shell/cell_tree.h"
#include "isospline/shell/isosurface.h"

#include <glm/vector_relational.hpp>

#include <vector>

using namespace isospline;

namespace {

/// Counts how often each row is in a leaf; true where all boxes hold what is below them.
bool visit(const Shell& shell, std::uint32_t index, const Box& parent, std::vector<int>& visits)
{
    const CellTree::Node& node = shell.tree().nodes()[index];
    const Box box = node.box();
    bool fits = glm::all(glm::greaterThanEqual(box.lower, parent.lower)) &&
                glm::all(glm::lessThanEqual(box.upper, parent.upper));
    if (node.count == 0)
        return visit(shell, index + 1, box, visits) && visit(shell, node.first, box, visits) && fits;
    for (std::uint32_t row = node.first; row < node.first + node.count; ++row) {
        const Cell& cell = shell.cells()[row];
        const glm::dvec3 lower(cell.x, cell.y, cell.z);
        fits = fits && glm::all(glm::greaterThanEqual(lower, box.lower)) &&
               glm::all(glm::lessThanEqual(lower + 1.0, box.upper));
        ++visits[row];
    }
    return fits;
}

} // namespace

TEST_CASE("The tree of a shell has each cell once, in boxes in boxes", "[shell]")
{
    for (const glm::ivec3 shape : {glm::ivec3(2, 2, 2), glm::ivec3(31, 18, 23), glm::ivec3(9, 2, 40)}) {
        const auto snapshot = Isosurface(noise_volume(shape), 0.1).snapshot();
        const Shell& shell = snapshot->shell();
        std::vector<int> visits(shell.count(), 0);
        REQUIRE(!visits.empty());
        CHECK(visit(shell, 0, shell.tree().nodes()[0].box(), visits));
        CHECK(visits == std::vector<int>(visits.size(), 1));
    }
}

TEST_CASE("A shell without cells has a tree without nodes, and copies of a shell have its tree in common", "[shell]")
{
    const auto surface = Isosurface(noise_volume({5, 5, 5}), 0.1).snapshot();
    const auto empty = Isosurface(noise_volume({5, 5, 5}), 100.0).snapshot();
    CHECK(empty->shell().tree().nodes().empty());
    CHECK(Shell().tree().nodes().empty());
    const Shell copy = surface->shell();
    CHECK(&copy.tree() == &surface->shell().tree());
}

TEST_CASE("The tree of a shell can be cancelled, and the next call builds it", "[shell]")
{
    const auto snapshot = Isosurface(noise_volume({100, 100, 100}), 0.1).snapshot();
    const Shell& shell = snapshot->shell();
    REQUIRE_THROWS_AS(shell.tree([](double) { return false; }), Cancelled);
    REQUIRE(!shell.tree([](double) { return true; }).nodes().empty());
}
