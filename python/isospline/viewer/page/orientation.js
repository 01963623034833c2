// How the slices of a volume lie on the screen.

import {normalize} from "./geometry.js";

const ORDERS = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

// For each axis of the grid, the world axis that it follows best, each one once, and its sign.
export function worldAxes(affine) {
  const columns = [0, 1, 2].map(axis => normalize([0, 1, 2].map(row => affine[row][axis])));
  const fit = order => order.reduce((sum, world, axis) => sum + Math.abs(columns[axis][world]), 0);
  const best = ORDERS.reduce((a, b) => fit(b) > fit(a) + 1e-9 ? b : a);
  return best.map((world, axis) => [world, columns[axis][world] < 0 ? -1 : 1]);
}

// The axes of the grid to the right and downwards in the slice across an axis, and whether each of them is reversed. Slices
// of patients follow the radiological convention: to the patient's left, or else to the back; downwards to the back, or
// else to the feet. In others, the axes are in their order, and the second one points upwards.
export function layout(axis, {affine, patient}) {
  const plane = [0, 1, 2].filter(each => each !== axis);
  if (!patient) return {plane, flips: [false, true]};
  const axes = worldAxes(affine);
  plane.sort((a, b) => axes[a][0] - axes[b][0]);
  return {plane, flips: plane.map(each => axes[each][0] === 2 ? axes[each][1] > 0 : axes[each][1] < 0)};
}

// The side of a patient (LPS) in a direction along an axis of the grid.
export function sideOf(affine, axis, direction) {
  const [world, sign] = worldAxes(affine)[axis];
  return (sign * direction > 0 ? "LPS" : "RAI")[world];
}

// Values of a slice come with columns along the first axis of the grid.
export const isSwapped = ({plane}) => plane[0] > plane[1];

export function transposed({rows, columns, part}) {
  return {rows: columns, columns: rows, part: part.map((_, at) => part[at % rows * columns + Math.floor(at / rows)])};
}
