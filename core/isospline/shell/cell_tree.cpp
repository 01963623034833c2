#include "isospline/shell/cell_tree.h"

#include "isospline/util/check.h"

#include <algorithm>
#include <span>

namespace isospline {

namespace {

using Node = CellTree::Node;

void extend(Node& node, const Node& other)
{
    for (std::size_t axis = 0; axis < 3; ++axis) {
        node.lower[axis] = std::min(node.lower[axis], other.lower[axis]);
        node.upper[axis] = std::max(node.upper[axis], other.upper[axis]);
    }
}

std::vector<Node> leaves_of(const std::vector<Cell>& cells)
{
    std::vector<Node> leaves;
    const auto is_same_block = [](const Cell& a, const Cell& b) {
        return a.x / 2 == b.x / 2 && a.y / 2 == b.y / 2 && a.z / 2 == b.z / 2;
    };
    const auto next = [](std::uint16_t index) { return static_cast<std::uint16_t>(index + 1); };
    for (std::size_t row = 0; row < cells.size(); ++row) {
        const Cell& cell = cells[row];
        const Node alone{
            {cell.x, cell.y, cell.z}, {next(cell.x), next(cell.y), next(cell.z)}, static_cast<std::uint32_t>(row), 1};
        if (row == 0 || !is_same_block(cells[row - 1], cell)) {
            leaves.push_back(alone);
        } else {
            extend(leaves.back(), alone);
            ++leaves.back().count;
        }
    }
    return leaves;
}

void add_subtree(std::span<Node> leaves, std::vector<Node>& nodes, const Progress& progress)
{
    if (leaves.size() == 1) {
        nodes.push_back(leaves[0]);
        return;
    }
    constexpr std::size_t leaves_between_reports = 1 << 16;
    if (leaves.size() > leaves_between_reports)
        report(progress, 0.0);
    Node node = leaves[0];
    node.count = 0;
    for (const Node& leaf : leaves)
        extend(node, leaf);
    std::size_t longest = 0;
    for (std::size_t axis = 1; axis < 3; ++axis)
        if (node.upper[axis] - node.lower[axis] > node.upper[longest] - node.lower[longest])
            longest = axis;

    const std::size_t half = leaves.size() / 2;
    std::nth_element(leaves.begin(), leaves.begin() + static_cast<std::ptrdiff_t>(half), leaves.end(),
                     [longest](const Node& a, const Node& b) {
                         return a.lower[longest] != b.lower[longest] ? a.lower[longest] < b.lower[longest]
                                                                     : a.first < b.first;
                     });
    const std::size_t at = nodes.size();
    nodes.push_back(node);
    add_subtree(leaves.first(half), nodes, progress);
    nodes[at].first = static_cast<std::uint32_t>(nodes.size());
    add_subtree(leaves.subspan(half), nodes, progress);
}

} // namespace

CellTree::CellTree(const std::vector<Cell>& cells, const Progress& progress)
{
    check_count("cells of the shell, twice", 2 * static_cast<std::uint64_t>(cells.size())); // nodes have 32-bit indices
    std::vector<Node> leaves = leaves_of(cells);
    if (leaves.empty())
        return;
    nodes_.reserve(2 * leaves.size() - 1);
    add_subtree(leaves, nodes_, progress);
}

} // namespace isospline
