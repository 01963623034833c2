// Slices of patients in all 48 orders of the grid's axes, against the radiological convention.

import assert from "node:assert/strict";
import test from "node:test";

import {isSwapped, layout, sideOf, transposed, worldAxes} from "../../python/isospline/viewer/page/orientation.js";

const ORDERS = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

// The affine map of a grid whose axes run along world axes with signs.
const affineOf = (order, signs) => [0, 1, 2, 3].map(row => [0, 1, 2, 3].map(axis => order[axis] === row ? 2 * signs[axis] : Number(row === 3 && axis === 3)));

test("axial slices have the left at the right, coronal and sagittal ones the head above", () => {
  const cases = ORDERS.flatMap(order => [...Array(8).keys()].map(bits => ({order, signs: [0, 1, 2].map(axis => bits >> axis & 1 ? -1 : 1)})));
  for (const {order, signs} of cases) {
    const affine = affineOf(order, signs);
    assert.deepEqual(worldAxes(affine), order.map((world, axis) => [world, signs[axis]]));
    for (const axis of [0, 1, 2]) {
      const {plane, flips} = layout(axis, {affine, patient: true});
      const to = plane.map((each, i) => sideOf(affine, each, flips[i] ? -1 : 1)).join("");
      assert.equal(to, ["PI", "LI", "LP"][order[axis]]); // right and down: sagittal, coronal, axial
    }
  }
});

test("oblique axes follow different sides", () => {
  const c = Math.SQRT1_2;
  const axes = worldAxes([[c, c, 0, 0], [-c, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]);
  assert.deepEqual(axes.map(([world]) => world).sort(), [0, 1, 2]);
});

test("other volumes have their axes in order", () => {
  assert.deepEqual(layout(1, {affine: affineOf([2, 1, 0], [1, 1, 1]), patient: false}), {plane: [0, 2], flips: [false, true]});
});

test("values are transposed where the axes are swapped", () => {
  const values = transposed({rows: 2, columns: 3, part: Float32Array.of(0, 1, 2, 10, 11, 12)});
  assert.deepEqual({...values, part: [...values.part]}, {rows: 3, columns: 2, part: [0, 10, 1, 11, 2, 12]});
  assert.ok(isSwapped({plane: [2, 1]}) && !isSwapped({plane: [0, 1]}));
});
