// The handles of cuts, without a page.

import assert from "node:assert/strict";
import test from "node:test";

import {ClipGizmo} from "../../python/isospline/viewer/page/gizmo.js";

// An element with attributes.
function element() {
  const attributes = {};
  return {attributes, append() {}, setAttribute(name, value) { attributes[name] = value; }};
}

test("a box of a cut becomes as thin in small volumes as in large ones", () => {
  globalThis.document = /** @type {any} */ ({createElementNS: element, createElement: element});
  for (const size of [1e-5, 1, 1e5]) {
    const at = part => [part * size, part * size, part * size], clip = {kind: "box", minimum: at(0.2), maximum: at(0.8)};
    const app = /** @type {any} */ ({state: {objects: [{source: "s"}], clip}, sources: new Map([["s", {key: "s", bounds: [at(0), at(1)]}]]),
      changeState(changes) { this.state = {...this.state, ...changes}; }});
    const camera = {eye: at(-4), target: at(0.5), up: [0, 0, 1], projection: "perspective", field_of_view: 30, height: size};
    for (let i = 0; i < 100; ++i) {
      const all = new ClipGizmo(app, {}).draw(camera, 400, 300);
      all.find(each => each.attributes["data-handle"] === "move the minimum of x").onkeydown({key: "ArrowRight", preventDefault() {}});
    }
    const width = (app.state.clip.maximum[0] - app.state.clip.minimum[0]) / size;
    assert.ok(width > 0 && width < 1e-5, `${width}`);
  }
});
