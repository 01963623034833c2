// The cut, drawn over the picture with handles to drag.

import {add, basis, clamp, cross, dot, heightOf, normalize, project, scale, subtract, turned} from "./geometry.js";
import {makeSvg} from "./dom.js";

const ACCENT = "#2f6f9f";
const EDGES = [[0, 1], [0, 2], [0, 4], [1, 3], [1, 5], [2, 3], [2, 6], [3, 7], [4, 5], [4, 6], [5, 7], [6, 7]];

// The lower and upper corner of all visible objects.
export function boundsOf(app) {
  const keys = new Set(app.state.objects.map(each => each.source));
  const boxes = [...app.sources.values()].filter(source => keys.has(source.key)).map(source => source.bounds);
  if (!boxes.length) return [[-1, -1, -1], [1, 1, 1]];
  return [0, 1].map(side => [0, 1, 2].map(axis => (side ? Math.max : Math.min)(...boxes.map(box => box[side][axis]))));
}

const corners = (lower, upper) => [...Array(8).keys()].map(i => [0, 1, 2].map(axis => i >> axis & 1 ? upper[axis] : lower[axis]));

// The corners, in order, of the polygon in which a plane cuts a box.
function section(point, normal, lower, upper) {
  const all = corners(lower, upper), sides = all.map(corner => dot(subtract(corner, point), normal));
  const points = [];
  for (const [a, b] of EDGES) {
    if (sides[a] * sides[b] < 0) points.push(add(all[a], scale(subtract(all[b], all[a]), sides[a] / (sides[a] - sides[b]))));
  }
  if (points.length < 3) return [];
  const middle = scale(points.reduce(add), 1 / points.length);
  const first = normalize(subtract(points[0], middle)), second = cross(normal, first);
  const angle = each => Math.atan2(dot(subtract(each, middle), second), dot(subtract(each, middle), first));
  return points.sort((a, b) => angle(a) - angle(b));
}

export class ClipGizmo {
  /** @param {import("./main.js").App} app
   *  @param {any} stage */
  constructor(app, stage) {
    this.app = app;
    this.stage = stage;
  }

  change(changes) {
    this.app.changeState({clip: {...this.app.state.clip, ...changes}});
  }

  draw(camera, width, height) {
    const clip = this.app.state?.clip;
    if (!clip || clip.kind === "none") return [];
    const to = point => project(camera, point, width, height);
    const [lower, upper] = boundsOf(this.app);
    if (clip.kind === "box") return this.drawBox(clip, to, camera, height);
    const points = section(clip.point, normalize(clip.normal), lower, upper).map(to);
    const parts = [];
    if (points.length && points.every(Boolean)) {
      parts.push(makeSvg("polygon", {points: points.map(each => each.slice(0, 2).join()).join(" "), fill: ACCENT,
        "fill-opacity": clip.capped && clip.values ? 0 : 0.07, // values keep the greys of their colour bar
        stroke: ACCENT, "stroke-width": 1.5, "stroke-dasharray": "5 4"}));
    }
    const reach = heightOf(camera) * 0.13, normal = normalize(clip.normal);
    const tip = add(clip.point, scale(normal, reach)), start = to(clip.point), end = to(tip);
    if (!start || !end) return parts;
    parts.push(makeSvg("line", {x1: start[0], y1: start[1], x2: end[0], y2: end[1], stroke: ACCENT, "stroke-width": 3}));
    const move = distance => this.change({point: add(clip.point, scale(normal, distance))});
    parts.push(this.handle("move the plane", start, event => this.along(event, clip.point, normal, camera, height, move),
      {value: dot(clip.point, normal), press: (right, up) => move((right + up) * this.step())}));
    parts.push(this.handle("tilt the plane", end, event => this.tilt(event, clip, normal, camera, height), {radius: 6, press: (right, up) => {
      const axes = basis(camera), angle = dot(normal, axes.forward) < 0 ? -Math.PI / 36 : Math.PI / 36;
      this.change({normal: turned(turned(normal, axes.up, -right * angle), axes.right, up * angle)});
    }}));
    return parts;
  }

  drawBox(clip, to, camera, height) {
    const places = corners(clip.minimum, clip.maximum).map(to);
    const parts = EDGES.filter(([a, b]) => places[a] && places[b]).map(([a, b]) => makeSvg("line",
      {x1: places[a][0], y1: places[a][1], x2: places[b][0], y2: places[b][1], stroke: ACCENT, "stroke-width": 1.2, "stroke-dasharray": "5 4"}));
    const middle = scale(add(clip.minimum, clip.maximum), 0.5);
    for (const side of ["minimum", "maximum"]) {
      for (const axis of [0, 1, 2]) {
        const point = middle.map((each, i) => i === axis ? clip[side][axis] : each), place = to(point);
        if (!place) continue;
        const direction = [0, 1, 2].map(i => Number(i === axis));
        const move = distance => {
          const corner = [...clip[side]];
          corner[axis] += distance;
          const other = clip[side === "minimum" ? "maximum" : "minimum"][axis];
          const least = this.step() * 1e-4;
          corner[axis] = side === "minimum" ? Math.min(corner[axis], other - least) : Math.max(corner[axis], other + least);
          this.change({[side]: corner});
        };
        parts.push(this.handle(`move the ${side} of ${"xyz"[axis]}`, place, event => this.along(event, point, direction, camera, height, move),
          {value: clip[side][axis], press: (right, up) => move((right + up) * this.step())}));
      }
    }
    return parts;
  }

  // A hundredth of the size of all objects.
  step() {
    const [lower, upper] = boundsOf(this.app);
    return Math.max(...subtract(upper, lower)) / 100;
  }

  // `begin` starts a drag; `press` gets the directions of arrow keys, to the right and up; Shift is ten times finer.
  handle(title, place, begin, {radius = 8, value = null, press}) {
    const slider = value === null ? {role: "button"} : {role: "slider", "aria-valuenow": value};
    const element = makeSvg("circle", {class: "handle", cx: place[0], cy: place[1], r: radius, fill: "#fff", stroke: ACCENT, "stroke-width": 3,
      "data-handle": title, tabindex: 0, "aria-label": title, ...slider});
    element.append(makeSvg("title", {}, title));
    element.onpointerdown = event => { event.preventDefault(); begin(event); };
    element.onkeydown = event => {
      const arrow = {ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[event.key];
      if (!arrow) return;
      event.preventDefault();
      press(...scale(arrow, event.shiftKey ? 0.1 : 1));
    };
    return element;
  }

  // Follow the pointer until it is released. The window listens, because handles are redrawn meanwhile.
  follow(moved) {
    const move = event => moved(event);
    const end = () => { removeEventListener("pointermove", move); removeEventListener("pointerup", end); removeEventListener("pointercancel", end); };
    addEventListener("pointermove", move);
    addEventListener("pointerup", end);
    addEventListener("pointercancel", end);
  }

  // Drag along a line in the world; `moved` gets the distance that the pointer has moved along it.
  along(event, point, direction, camera, height, moved) {
    const width = this.stage.canvas.clientWidth, step = heightOf(camera) * 0.01;
    const a = project(camera, point, width, height), b = project(camera, add(point, scale(direction, step)), width, height);
    let [dx, dy] = subtract(b, a).slice(0, 2);
    // If the line points at the viewer, use the vertical direction instead.
    if (Math.hypot(dx, dy) < 0.2) [dx, dy] = [0, -1];
    const squared = dx * dx + dy * dy, from = [event.clientX, event.clientY];
    this.follow(now => moved(((now.clientX - from[0]) * dx + (now.clientY - from[1]) * dy) / squared * step));
  }

  // Drag the tip of the normal over the surface of a ball.
  tilt(event, clip, normal, camera, height) {
    const {right, up, forward} = basis(camera), from = [event.clientX, event.clientY], radius = 0.13 * height;
    const begin = [dot(normal, right), dot(normal, up)], behind = dot(normal, forward);
    this.follow(now => {
      const x = begin[0] + (now.clientX - from[0]) / radius, y = begin[1] - (now.clientY - from[1]) / radius;
      const depth = Math.sign(behind || 1) * Math.sqrt(clamp(1 - x * x - y * y, 0, 1));
      this.change({normal: normalize(add(add(scale(right, x), scale(up, y)), scale(forward, depth)))});
    });
  }
}
