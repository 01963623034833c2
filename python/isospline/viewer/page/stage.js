// The picture, its overlays, and input from pointer and keyboard.

import {basis, distanceOf, dot, heightOf, length, orbited, panned, project, scale, subtract, withProjection, zoomed, zoomedAt} from "./geometry.js";
import {active, byId, make, makeSvg, tidy} from "./dom.js";
import {ClipGizmo} from "./gizmo.js";
import {drawMeasurements} from "./measurements.js";
import {PLANES} from "./slices.js";

// Faces of the cube: their direction in the world, their upward direction, and their view.
const FACES = [
  {normal: [1, 0, 0], up: [0, 0, 1], view: "+x", patient: ["left", "L"]},
  {normal: [-1, 0, 0], up: [0, 0, 1], view: "-x", patient: ["right", "R"]},
  {normal: [0, 1, 0], up: [0, 0, 1], view: "+y", patient: ["posterior", "P"]},
  {normal: [0, -1, 0], up: [0, 0, 1], view: "-y", patient: ["anterior", "A"]},
  {normal: [0, 0, 1], up: [0, 1, 0], view: "+z", patient: ["superior", "S"]},
  {normal: [0, 0, -1], up: [0, -1, 0], view: "-z", patient: ["inferior", "I"]},
];
const ORDER = ["anterior", "posterior", "left", "right", "superior", "inferior"];
const MOST_PIXELS = 4096; // of a side of the picture, as the viewer allows

// The pixels of a picture that fills an element: at most two for one of CSS, and fewer in a very large window.
export function pixelsOf(width, height, ratio) {
  const factor = Math.min(ratio, 2, MOST_PIXELS / Math.max(width, height, 1));
  return {width: Math.max(1, Math.round(width * factor)), height: Math.max(1, Math.round(height * factor))};
}

export class Stage {
  /** @param {import("./main.js").App} app */
  constructor(app) {
    this.app = app;
    this.canvas = byId("picture");
    this.context = this.canvas.getContext("2d", {alpha: false});
    this.overlay = byId("overlay");
    this.gizmo = new ClipGizmo(app, this);
    this.pointers = new Map();
    this.fps = [];
    this.isBusy = false;
    this.listen();
    new ResizeObserver(() => this.resized()).observe(this.canvas);
    app.on("frame", frame => this.show(frame));
    app.on("document", () => { this.makeViews(); this.tellBlank(); if (app.state) this.drawValueBars(); });
    app.on("state", () => this.stateChanged());
    app.on("progress", ({title}) => { this.isBusy = title != null; this.tellBlank(); });
  }

  // Device pixels of the picture.
  pixels() { return pixelsOf(this.canvas.clientWidth, this.canvas.clientHeight, devicePixelRatio || 1); }

  resized() {
    const {width, height} = this.pixels();
    if (width === this.sent?.width && height === this.sent?.height) return;
    this.sent = {width, height};
    this.app.tell("size", this.sent);
    if (this.app.state) this.app.change({type: "size", width, height});
  }

  async show({about, content}) {
    const app = this.app;
    const {socket} = app;
    about.number = this.count = (this.count ?? 0) + 1;
    const picture = await createImageBitmap(new Blob([content], {type: `image/${about.format}`}));
    app.send({type: "acknowledge"});
    if (socket !== app.socket) return;
    // Decoding may finish out of order; an older picture does not replace a newer one.
    if (app.frame?.number > about.number) return;
    const {width, height} = this.pixels();
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, {width, height});
    this.context.imageSmoothingQuality = about.samples ? "high" : "low";
    this.context.drawImage(picture, 0, 0, width, height);
    picture.close();
    const now = performance.now(), sent = app.sentAt.get(about.input);
    if (sent !== undefined) {
      app.latencies.push(now - sent);
      for (const number of app.sentAt.keys()) if (number <= about.input) app.sentAt.delete(number);
    }
    app.frame = about;
    app.matchFrame();
    app.framesShown += 1;
    this.tellStatus(now);
    this.tellBlank();
    this.drawOverlay();
    app.tell("shown", about);
  }

  tellStatus(now) {
    const {size, samples, final, scales: details} = this.app.frame;
    this.fps = [...this.fps.filter(each => now - each < 1000), now];
    const latency = this.app.latencies.at(-1);
    const moving = samples === 0;
    byId("status").textContent = `${size[0]} × ${size[1]} · ` + (moving
      ? `${this.fps.length} pictures/s · ${latency ? latency.toFixed(0) : "–"} ms`
      : `${samples} sample${samples > 1 ? "s" : ""}${final ? "" : " …"}`)
      + (details.length ? `, scale ${details.join(", ")}` : "");
  }

  // -- Pointer and keyboard ------------------------------------------------------------------------------------------

  listen() {
    const canvas = this.canvas;
    canvas.oncontextmenu = event => event.preventDefault();
    canvas.onpointerdown = event => {
      canvas.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
      this.travelled = 0;
      this.isClick = this.pointers.size === 1; // and no gesture of two fingers
      canvas.classList.add("moving");
    };
    canvas.onpointermove = event => this.pointerMoved(event);
    canvas.onpointerup = canvas.onpointercancel = event => {
      this.pointers.delete(event.pointerId);
      canvas.classList.remove("moving");
      if (event.type === "pointerup" && this.isClick && this.travelled < 4 && event.button === 0) this.pick(event.offsetX, event.offsetY);
    };
    canvas.addEventListener("wheel", event => {
      event.preventDefault();
      if (!this.app.camera) return;
      const factor = Math.exp(event.deltaY * (event.deltaMode ? 0.04 : 0.0015)), {clientWidth: width, clientHeight: height} = canvas;
      this.app.moveCamera(zoomedAt(this.app.camera, factor, (event.offsetX - width / 2) / height, (height / 2 - event.offsetY) / height));
    }, {passive: false});
    canvas.onkeydown = event => this.keyPressed(event);
  }

  pointerMoved(event) {
    const before = this.pointers.get(event.pointerId), {app} = this;
    if (!before || !app.camera) return;
    const now = [event.offsetX, event.offsetY];
    const [dx, dy] = subtract(now, before), height = this.canvas.clientHeight;
    this.pointers.set(event.pointerId, now);
    this.travelled += Math.hypot(dx, dy);
    if (this.travelled < 4) return;
    if (this.pointers.size === 2) {
      const other = [...this.pointers].find(([id]) => id !== event.pointerId)[1];
      const factor = length(subtract(before, other)) / Math.max(1, length(subtract(now, other)));
      app.moveCamera(panned(zoomed(app.camera, factor), dx / height / 2, -dy / height / 2));
    } else if (event.buttons & 6 || event.shiftKey) {
      app.moveCamera(panned(app.camera, dx / height, -dy / height));
    } else {
      app.moveCamera(orbited(app.camera, -dx / height * Math.PI, -dy / height * Math.PI));
    }
  }

  keyPressed(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return; // a key of the browser
    const {app} = this, {camera} = app, {clientWidth: width, clientHeight: height} = this.canvas;
    const arrow = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[event.key], factor = {"+": 1 / 1.1, "-": 1.1}[event.key];
    if (camera && arrow && event.shiftKey) app.moveCamera(panned(camera, ...scale(arrow, 0.05)));
    else if (camera && arrow) app.moveCamera(orbited(camera, ...scale([-arrow[0], arrow[1]], Math.PI / 36)));
    else if (camera && factor) app.moveCamera(zoomed(camera, factor));
    else if (event.key === "f") app.send({type: "look", view: "home"});
    else if (event.key === "Enter" || event.key === " ") this.pick(width / 2, height / 2);
    else return;
    event.preventDefault();
  }

  // Measure at a place of the picture.
  pick(x, y) {
    const {width, height} = this.pixels();
    this.app.send({type: "pick", tool: this.app.tool, x: x / this.canvas.clientWidth * width, y: y / this.canvas.clientHeight * height});
  }

  // -- Overlays ------------------------------------------------------------------------------------------------------

  stateChanged() {
    document.documentElement.style.setProperty("--stage", this.app.state.background);
    this.tellBlank();
    this.drawValueBars();
    this.drawOverlay();
  }

  // Until there is a picture of the objects, scale, cube and status would be those of nothing.
  tellBlank() {
    const {state, frame, sources} = this.app, objects = state?.objects ?? [];
    byId("stage").classList.toggle("blank", !frame || objects.some(each => each.visible) && !frame.objects);
    byId("welcome").hidden = !state || objects.length > 0 || this.isBusy;
    byId("welcome").firstElementChild.textContent = sources.size ? "No surface is shown" : "Drop a volume or a mesh here";
  }

  // A bar for each volume whose values are on the cut.
  drawValueBars() {
    const {objects, clip, slices} = this.app.state, shown = clip.kind !== "none" && clip.capped && clip.values;
    const keys = shown ? new Set(objects.filter(each => each.visible && each.level !== null).map(each => each.source)) : [];
    const sources = [...keys].map(key => this.app.sources.get(key)).filter(Boolean);
    byId("value-bars").replaceChildren(...sources.map(source => {
      const [low, high] = slices.window && slices.volume === source.key ? slices.window : source.window;
      return make("div", {class: "value-bar"}, make("span", {}, sources.length > 1 ? this.app.nameOf(source) : "Value"), make("i"),
        make("div", {}, ...[low, (low + high) / 2, high].map(value => make("span", {}, tidy(value, high - low || undefined)))));
    }));
  }

  makeViews() {
    const {app} = this, bar = byId("views");
    const look = view => () => app.send({type: "look", view});
    const faces = this.app.patient ? ORDER.map(name => FACES.find(face => face.patient[0] === name)) : FACES;
    bar.replaceChildren(
      make("button", {onclick: look("home"), title: "Show everything (f)"}, "⌂"), make("i"),
      ...faces.map(face => this.app.patient
        ? make("button", {onclick: look(face.patient[0]), title: `From ${face.patient[0]}`}, face.patient[1])
        : make("button", {onclick: look(face.view), title: `From ${face.view}`}, face.view.replace("-", "−"))),
      make("i"),
      make("button", {id: "projection", title: "Parallel rays", onclick: () => {
        const other = app.camera.projection === "perspective" ? "orthographic" : "perspective";
        app.moveCamera(withProjection(app.camera, other));
      }}, "Orthographic"));
    byId("cube").replaceChildren(...FACES.map(face => make("button",
      {tabindex: -1, onclick: look(this.app.patient ? face.patient[0] : face.view)},
      this.app.patient ? face.patient[1] : face.view.toUpperCase().replace("-", "−"))));
  }

  drawOverlay() {
    const camera = this.app.frame?.camera;
    if (!camera) return;
    const {clientWidth: width, clientHeight: height} = this.canvas;
    this.turnCube(camera);
    this.drawScaleBar(camera, height);
    byId("projection")?.setAttribute("aria-pressed", String(camera.projection === "orthographic"));
    const {app} = this, measured = drawMeasurements(app.state.measurements, app.results, app.unit, camera, width, height);
    const focused = this.overlay.contains(active()) ? active().dataset.handle : null;
    this.overlay.replaceChildren(...this.slicePlanes(camera, width, height), ...this.gizmo.draw(camera, width, height), ...measured);
    if (focused) this.overlay.querySelector(`[data-handle="${focused}"]`)?.focus();
  }

  // The borders of the slices in space.
  slicePlanes(camera, width, height) {
    const {slices} = this.app.state, source = slices.shown && this.app.sources.get(slices.volume);
    if (!source) return [];
    return [0, 1, 2].map(axis => {
      const corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(at => {
        const index = source.counts.map((count, i) => i === axis ? slices.index[i] : at[i === (axis === 2 ? 1 : 2) ? 1 : 0] * (count - 1));
        return project(camera, source.affine.slice(0, 3).map(row => dot(row.slice(0, 3), index) + row[3]), width, height);
      });
      return corners.every(Boolean) && makeSvg("polygon", {class: "slice", points: corners.map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`).join(" "),
        fill: "none", stroke: PLANES[axis], "stroke-width": 1.2});
    }).filter(Boolean);
  }

  turnCube(camera) {
    const {right, up, forward} = basis(camera);
    const css = world => [right, up, forward].map((axis, i) => (i ? -1 : 1) * (axis[0] * world[0] + axis[1] * world[1] + axis[2] * world[2]));
    [...byId("cube").children].forEach((face, i) => {
      const {normal, up: upwards} = FACES[i];
      const sideways = [upwards[1] * normal[2] - upwards[2] * normal[1], upwards[2] * normal[0] - upwards[0] * normal[2],
        upwards[0] * normal[1] - upwards[1] * normal[0]];
      const columns = [css(sideways), css(scale(upwards, -1)), css(normal)];
      face.style.transform = `matrix3d(${columns.map(column => [...column, 0]).flat().map(each => each.toFixed(5)).join()},`
        + `${scale(columns[2], 22).map(each => each.toFixed(3)).join()},1)`;
    });
  }

  drawScaleBar(camera, height) {
    const perPixel = heightOf(camera) / height;
    const wanted = 120 * perPixel, power = 10 ** Math.floor(Math.log10(wanted));
    const round = [5, 2, 1].find(each => each * power <= wanted) * power;
    const bar = byId("scale-bar");
    bar.firstElementChild.style.width = `${round / perPixel}px`;
    bar.lastElementChild.textContent = tidy(round) + this.app.unit;
    bar.title = camera.projection === "perspective" ? "Lengths at the distance of the view's centre" : "";
    bar.hidden = !Number.isFinite(distanceOf(camera));
  }
}
