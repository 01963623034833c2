// Contours of levels in slices, against circles and saddles.

import assert from "node:assert/strict";
import test from "node:test";

import {strokeContour} from "../../python/isospline/viewer/page/slices.js";

// The segments of the contour of a function of column and row.
function segments(f, rows, columns, level) {
  const found = [], values = new Float32Array(rows * columns);
  for (let y = 0; y < rows; ++y) for (let x = 0; x < columns; ++x) values[y * columns + x] = f(x, y);
  let begin = null;
  strokeContour(values, rows, columns, level, (x, y) => [x, y], {moveTo: (...at) => { begin = at; }, lineTo: (...at) => { found.push([begin, at]); }});
  return found;
}

test("the contour of a cone is a circle", () => {
  const all = segments((x, y) => Math.hypot(x - 30, y - 25), 60, 70, 19.7);
  const total = all.reduce((sum, [a, b]) => sum + Math.hypot(a[0] - b[0], a[1] - b[1]), 0);
  assert.ok(Math.abs(total - 2 * 19.7 * Math.PI) < 0.1);
  for (const point of all.flat()) assert.ok(Math.abs(Math.hypot(point[0] - 30, point[1] - 25) - 19.7) < 0.01);
  // It is closed: each point is the end of two segments.
  const ends = new Map();
  for (const point of all.flat()) ends.set(point.map(each => each.toFixed(4)).join(), (ends.get(point.map(each => each.toFixed(4)).join()) ?? 0) + 1);
  assert.ok([...ends.values()].every(count => count === 2));
});

test("at a saddle, the value in the middle decides what is connected", () => {
  const corners = [1, 0, 0.9, 0]; // two opposite corners are above
  for (const [level, isConnected] of [[0.4, true], [0.6, false]]) {
    const all = segments((x, y) => corners[y * 2 + (y ? 1 - x : x)] , 2, 2, level);
    assert.equal(all.length, 2);
    // The line through the middle from the lower to the higher corners crosses no segment exactly if they are connected.
    const side = ([x, y]) => Math.sign(x - y);
    assert.equal(all.every(([a, b]) => side(a) === side(b)), isConnected);
  }
});
