// Cameras, against closed forms and what stays the same in each movement.

import assert from "node:assert/strict";
import test from "node:test";

import * as geometry from "../../python/isospline/viewer/page/geometry.js";

const {basis, distanceOf, dot, heightOf, length, orbited, panned, pixelsPerUnit, project, subtract, turned, withProjection, zoomed, zoomedAt} = geometry;

const camera = {eye: [3, -10, 2], target: [1, 2, -1], up: [0.1, 0, 1], projection: "perspective", field_of_view: 40, height: 5};
const both = [camera, {...camera, projection: "orthographic"}];
const near = (a, b, tolerance = 1e-9) => [a].flat().forEach((each, i) => assert.ok(Math.abs(each - [b].flat()[i]) < tolerance, `${a} and ${b}`));

test("a camera along y with z upwards sees x to the right", () => {
  const simple = {...camera, eye: [0, -10, 0], target: [0, 0, 0], up: [0, 0, 1], field_of_view: 90};
  near(project(simple, [1, 0, 2], 400, 200), [200 + 10, 100 - 20, 10]); // 20 units high at the target
  assert.equal(project(simple, [0, -11, 0], 400, 200), null);
  near(project({...simple, projection: "orthographic"}, [1, 0, 2], 400, 200), [200 + 40, 100 - 80, 10]);
  near(heightOf(simple), 20);
});

test("the axes of a camera are unit vectors at right angles", () => {
  const {right, up, forward} = basis(camera);
  near([right, up, forward].map(length), [1, 1, 1]);
  near([dot(right, up), dot(up, forward), dot(forward, right)], [0, 0, 0]);
  near(forward, subtract(camera.target, camera.eye).map(each => each / distanceOf(camera)));
});

test("a rotation keeps the axis and lengths", () => {
  near(turned([0, 0, 3], [0, 0, 1], 1.2), [0, 0, 3]);
  near(turned([2, 0, 1], [0, 0, 1], Math.PI / 2), [0, 2, 1]);
});

test("an orbit keeps target, distance and a level horizon, and stops at the poles", () => {
  const level = orbited({...camera, up: [0, 0, 1]}, 0.3, -0.2);
  near([distanceOf(level), basis(level).right[2]], [distanceOf(camera), 0]);
  const above = orbited(level, 0, -10);
  near(subtract(above.eye, above.target).map(each => each / distanceOf(above)), [0, 0, 1], 1e-6);
});

test("zooming at a point of the picture keeps it there", () => {
  for (const each of both) {
    const {right, up} = basis(each), height = heightOf(each);
    const point = each.target.map((x, i) => x + height * (0.3 * right[i] - 0.2 * up[i]));
    const after = zoomedAt(each, 0.4, 0.3, -0.2);
    near(project(after, point, 600, 500).slice(0, 2), project(each, point, 600, 500).slice(0, 2), 1e-6);
    near(heightOf(after), 0.4 * height);
  }
});

test("panning moves the target by parts of the picture", () => {
  for (const each of both) {
    near(project(panned(each, 0.1, -0.05), each.target, 600, 500).slice(0, 2), [300 + 50, 250 + 25], 1e-6);
    near(heightOf(panned(each, 1, 1)), heightOf(each));
  }
});

test("another projection shows the target at the same size", () => {
  const parallel = withProjection(camera, "orthographic"), again = withProjection(zoomed(parallel, 2), "perspective");
  near(heightOf(parallel), heightOf(camera));
  near(heightOf(again), 2 * heightOf(camera));
  near(pixelsPerUnit(camera, distanceOf(camera), 500), 500 / heightOf(camera));
});
