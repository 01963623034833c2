// Three slices through a volume. Values come from the server; gray values and contours of levels are computed here.

import {clamp} from "./geometry.js";
import {byId, make, tidy} from "./dom.js";
import {spanOf} from "./histogram.js";
import {isSwapped, layout, sideOf, transposed} from "./orientation.js";

const HEIGHT = "260px";
const MOST_ZOOM = 64, MOST_POINTS = 1024, PIXELS = 2; // pixels of a point of a slice
// Colours of the slices across x, y and z, as in the picture.
export const PLANES = ["#c8553d", "#3a8f5c", "#2f6f9f"];

// The corners of a part of a slice in the order of the grid's axes; the same turns them back.
const inGridOrder = (view, part) => isSwapped(view) ? {...part, lower: [...part.lower].reverse(), upper: [...part.upper].reverse()} : part;

export class Slices {
  /** @param {import("./main.js").App} app */
  constructor(app) {
    this.app = app;
    this.element = byId("slices");
    this.views = [0, 1, 2].map(axis => {
      const canvas = make("canvas", {tabindex: 0, style: `border-top: 2px solid ${PLANES[axis]}`,
        "aria-label": `Slice across ${"xyz"[axis]}: arrow keys move the point, Page Up and Page Down the slice`});
      const caption = make("figcaption"), name = `slice across ${"xyz"[axis]}`;
      const button = (title, text, act) => make("button", {title, "aria-label": `${title}: ${name}`, onclick: act}, text);
      const view = {axis, canvas, caption, plane: [0, 1], flips: [false, false], fingers: new Map()};
      view.figure = make("figure", {}, canvas, caption, make("div", {class: "tools", role: "toolbar", "aria-label": `Tools of the ${name}`},
        button("Zoom out (-)", "−", () => this.zoomBy(1 / 1.5)), button("Zoom in (+)", "+", () => this.zoomBy(1.5)),
        button("Maximise (m)", "⤢", () => this.maximise(view))));
      this.element.append(view.figure);
      canvas.oncontextmenu = event => event.preventDefault();
      canvas.onpointerdown = event => this.drag(event, view);
      canvas.addEventListener("pointermove", event => { view.pointer = [event.clientX, event.clientY]; this.tell(view); });
      canvas.onpointerleave = () => { view.pointer = null; this.tell(view); };
      canvas.onkeydown = event => this.keyPressed(event, view);
      canvas.addEventListener("wheel", event => {
        event.preventDefault();
        if (event.ctrlKey || event.metaKey) this.zoomBy(Math.exp(-event.deltaY * (event.deltaMode ? 0.04 : 0.0015)), view, [event.clientX, event.clientY]);
        else this.moveTo(this.slices.index.map((each, i) => each + (i === axis ? Math.sign(event.deltaY) : 0)));
      }, {passive: false});
      canvas.ondblclick = () => {
        this.moveTo(view.pressed[0]);
        this.maximise(view);
      };
      return view;
    });
    this.viewsSent = null; // the parts of the slices that the viewer knows
    this.zoom = 1;
    this.centre = null; // of the zoomed part, in grid coordinates; null for the middle
    new ResizeObserver(() => { this.draw(); this.askForViews(); }).observe(this.element);
    for (const name of ["state", "document"]) app.on(name, () => { if (app.state) this.stateChanged(); });
    app.on("slice_values", message => this.received(message));
    app.on("sampled", message => this.answered(message));
    app.on("error", () => { this.asking = false; }); // perhaps of a store that could not be read
    addEventListener("keydown", event => { if (event.key === "Escape" && this.maximised && !document.querySelector("dialog[open]")) this.maximise(this.maximised); });
    app.on("other_viewer", () => { this.volume = null; });
    app.on("connected", () => { this.values = null; this.viewsSent = null; this.asked = null; this.asking = false; });
  }

  get slices() { return this.app.state.slices; }
  get source() { return this.app.sources.get(this.slices.volume); }

  stateChanged() {
    const shown = this.slices.shown && !!this.source;
    this.element.hidden = !shown;
    document.documentElement.style.setProperty("--slices", shown ? HEIGHT : "0px");
    if (!shown && this.maximised) this.maximise(this.maximised);
    if (this.source) for (const view of this.views) Object.assign(view, layout(view.axis, this.source));
    if (this.volume !== this.slices.volume) {
      this.zoomTo(1, null);
      this.asking = false;
      this.next = null;
    }
    this.volume = this.slices.volume;
    if (shown) this.draw();
  }

  // -- Zoom ----------------------------------------------------------------------------------------------------------

  // Show one slice in place of the picture and the others, or all again.
  maximise(view) {
    this.maximised = this.maximised === view ? null : view;
    this.element.classList.toggle("maximised", !!this.maximised);
    for (const each of this.views) each.figure.hidden = !!this.maximised && each !== view;
    view.canvas.focus();
    this.app.tell("covered");
  }

  // Zoom all slices; a point of one of them stays where it is, by default the cross.
  zoomBy(factor, view = null, place = null) {
    const zoom = clamp(this.zoom * factor, 1, MOST_ZOOM), counts = this.counts();
    const fixed = place ? this.pointAt(view, place).index : this.slices.index;
    const centre = this.centre ?? counts.map(each => (each - 1) / 2), share = this.zoom / zoom;
    this.zoomTo(zoom, centre.map((each, i) => view && i === view.axis ? each : fixed[i] + (each - fixed[i]) * share));
  }

  zoomTo(zoom, centre) {
    this.zoom = zoom;
    this.centre = zoom === 1 ? null : centre.map((each, i) => clamp(each, 0, this.counts()[i] - 1));
    if (!this.element.hidden) this.draw();
    this.askForViews();
  }

  // Tell the viewer which parts of the slices are seen, and how many points they need, once per screen refresh.
  askForViews() {
    if (this.viewsWait) return;
    this.viewsWait = true;
    requestAnimationFrame(() => {
      this.viewsWait = false;
      if (this.element.hidden || !this.source) return;
      const views = this.views.map(view => inGridOrder(view, this.seen(view))), text = JSON.stringify(views);
      if (text === this.viewsSent) return;
      this.viewsSent = text;
      this.app.send({type: "slice_views", views});
    });
  }

  // The part of a slice that is seen, in grid coordinates along its two axes; of one behind another, all of it, coarsely.
  seen(view) {
    const {width, height, left, top, w, h, flips} = this.placement(view), counts = this.counts();
    if (!width || !height) return {lower: [0, 0], upper: view.plane.map(axis => counts[axis] - 1), points: 2};
    const ranges = [[-left / w, (width - left) / w], [-top / h, (height - top) / h]].map((range, i) => {
      const [lower, upper] = range.map(each => clamp(flips[i] ? 1 - each : each, 0, 1) * (counts[view.plane[i]] - 1));
      return [Math.min(lower, upper), Math.max(lower, upper)];
    });
    return {lower: ranges.map(each => each[0]), upper: ranges.map(each => each[1]), points: clamp(Math.round(Math.max(width, height) / PIXELS), 2, MOST_POINTS)};
  }

  received({about, content}) {
    this.app.send({type: "acknowledge", slices: true});
    let offset = 0;
    const source = this.app.sources.get(about.volume);
    const values = source ? about.shapes.map(([rows, columns], axis) => {
      const part = new Float32Array(content, offset, rows * columns), [lower, upper] = about.regions[axis];
      offset += 4 * part.length;
      const view = layout(axis, source);
      return {...isSwapped(view) ? transposed({rows, columns, part}) : {rows, columns, part}, ...inGridOrder(view, {lower, upper})};
    }) : null;
    this.values = values && {volume: about.volume, values};
    this.draw();
    this.askForViews();
    this.app.tell("slices-shown");
  }

  counts() { return this.source?.counts ?? [1, 1, 1]; } // of samples along x, y and z

  moveTo(index) {
    const counts = this.counts();
    this.app.changeState({slices: {...this.slices, index: index.map((each, i) => clamp(each, 0, counts[i] - 1))}});
  }

  keyPressed(event, view) {
    const [across, along] = view.plane, {flips} = this.placement(view);
    const right = flips[0] ? -1 : 1, down = flips[1] ? -1 : 1;
    const steps = {ArrowRight: [across, right], ArrowLeft: [across, -right], ArrowDown: [along, down], ArrowUp: [along, -down],
      PageDown: [view.axis, 1], PageUp: [view.axis, -1]};
    const others = {"+": () => this.zoomBy(1.5), "=": () => this.zoomBy(1.5), "-": () => this.zoomBy(1 / 1.5), 0: () => this.zoomTo(1, null),
      m: () => this.maximise(view)};
    if (others[event.key] && !event.ctrlKey && !event.metaKey) {
      event.preventDefault();
      others[event.key]();
    }
    if (!steps[event.key]) return;
    event.preventDefault();
    const [axis, step] = steps[event.key];
    this.moveTo(this.slices.index.map((each, i) => each + (i === axis ? step : 0)));
    const {lower, upper} = this.seen(view); // the zoomed part follows the point
    if (view.plane.some((each, i) => this.slices.index[each] < lower[i] || this.slices.index[each] > upper[i])) this.zoomTo(this.zoom, this.slices.index);
  }

  // The place of a slice in its canvas: without zoom, the whole slice fits. Its proportions follow the spacing of samples.
  placement(view) {
    const {affine} = this.source, ratio = Math.min(devicePixelRatio || 1, 2);
    const width = view.canvas.clientWidth * ratio, height = view.canvas.clientHeight * ratio;
    const extent = view.plane.map(axis => (this.counts()[axis] - 1 || 1) * Math.hypot(...[0, 1, 2].map(row => affine[row][axis])));
    const factor = Math.min(width / extent[0], height / extent[1]) * 0.94 * this.zoom;
    const [w, h] = extent.map(each => each * factor), {flips} = view;
    const [x, y] = view.plane.map((axis, i) => {
      const part = this.centre ? this.centre[axis] / (this.counts()[axis] - 1 || 1) : 0.5;
      return flips[i] ? 1 - part : part;
    });
    return {width, height, ratio, left: width / 2 - x * w, top: height / 2 - y * h, w, h, flips};
  }

  draw() {
    const values = this.values;
    if (this.element.hidden || !values || values.volume !== this.slices.volume) return;
    for (const view of this.views) this.drawView(view, values.values[view.axis]);
  }

  drawView(view, {rows, columns, part, lower, upper}) {
    const place = this.placement(view), {canvas} = view, {flips} = place;
    if (!place.width || !place.height) return;
    Object.assign(canvas, {width: place.width, height: place.height});
    const [low, high] = this.slices.window ?? this.source.window, factor = 255 / (high - low || 1);
    const pixels = new ImageData(columns, rows);
    for (let row = 0, out = 0; row < rows; ++row) {
      const from = (flips[1] ? rows - 1 - row : row) * columns;
      for (let column = 0; column < columns; ++column, out += 4) {
        const gray = (part[from + (flips[0] ? columns - 1 - column : column)] - low) * factor;
        pixels.data[out] = pixels.data[out + 1] = pixels.data[out + 2] = gray;
        pixels.data[out + 3] = 255;
      }
    }
    const scratch = new OffscreenCanvas(columns, rows);
    scratch.getContext("2d").putImageData(pixels, 0, 0);
    const context = canvas.getContext("2d");
    context.fillStyle = "#111";
    context.fillRect(0, 0, place.width, place.height);
    context.imageSmoothingQuality = "high";
    // Samples are points: the first and the last ones are on the border of the slice.
    const [x, y, w, h] = this.rectangle(view, place, lower, upper);
    const dx = w / Math.max(1, columns - 1), dy = h / Math.max(1, rows - 1);
    context.drawImage(scratch, x - dx / 2, y - dy / 2, w + dx, h + dy);
    for (const each of this.app.state.objects) {
      if (each.source !== this.slices.volume || each.level === null || !each.visible) continue;
      context.strokeStyle = each.color;
      context.lineWidth = 1.5 * place.ratio;
      context.beginPath();
      strokeContour(part, rows, columns, each.level, (column, row) =>
        [x + (flips[0] ? columns - 1 - column : column) * dx, y + (flips[1] ? rows - 1 - row : row) * dy], context);
      context.stroke();
    }
    this.drawCross(context, view, place);
    this.drawSides(context, view, place);
    this.tell(view);
  }

  // The rectangle of a part of a slice: left, top, width and height.
  rectangle(view, {left, top, w, h, flips}, lower, upper) {
    const [across, along] = view.plane.map((axis, i) => {
      const last = this.counts()[axis] - 1 || 1, ends = [lower[i] / last, upper[i] / last];
      if (this.counts()[axis] === 1) return [0, 1];
      return flips[i] ? [1 - ends[1], ends[1] - ends[0]] : [ends[0], ends[1] - ends[0]];
    });
    return [left + across[0] * w, top + along[0] * h, across[1] * w, along[1] * h];
  }

  // The sides of a patient at the edges of the canvas.
  drawSides(context, view, {width, height, ratio, flips}) {
    if (!this.source.patient) return;
    const side = (axis, direction) => sideOf(this.source.affine, axis, direction);
    const [right, down] = flips.map(flipped => flipped ? -1 : 1), [across, along] = view.plane, edge = 10 * ratio;
    Object.assign(context, {fillStyle: "#ffd479", font: `600 ${12 * ratio}px system-ui, sans-serif`, textAlign: "center", textBaseline: "middle"});
    context.fillText(side(across, -right), edge, height / 2);
    context.fillText(side(across, right), width - edge, height / 2);
    context.fillText(side(along, -down), width / 2, edge);
    context.fillText(side(along, down), width / 2, height - edge);
  }

  // The point of the grid at a place in the window, and whether it is inside of the slice.
  pointAt(view, point) {
    const [x, y] = point, place = this.placement(view), box = view.canvas.getBoundingClientRect(), counts = this.counts();
    const at = [((x - box.left) * place.ratio - place.left) / place.w, ((y - box.top) * place.ratio - place.top) / place.h];
    const index = [...this.slices.index];
    view.plane.forEach((axis, i) => { index[axis] = (place.flips[i] ? 1 - at[i] : at[i]) * (counts[axis] - 1); });
    return {index, inside: at.every(each => each >= 0 && each <= 1)};
  }

  // Ask for the value of the volume at a point; one question at a time.
  ask(point) {
    const asked = JSON.stringify(point);
    if (asked === this.asked) return;
    if (this.asking) { this.next = point; return; }
    this.asked = asked;
    this.asking = true;
    this.app.send({type: "sample", ...point});
  }

  answered(message) {
    this.asking = false;
    this.sampled = message;
    for (const view of this.views) if (view.pointer) this.tell(view);
    const {next} = this;
    this.next = null;
    if (next) this.ask(next);
  }

  // The caption: the slice, and the index, the place and the value under the pointer.
  tell(view) {
    const round = each => tidy(Math.round(each * 100) / 100);
    const lines = [`${"xyz"[view.axis]} = ${round(this.slices.index[view.axis])}`];
    const point = view.pointer && this.source ? this.pointAt(view, view.pointer) : null;
    if (point?.inside) {
      const {affine, unit} = this.source;
      const world = affine.slice(0, 3).map(line => line[0] * point.index[0] + line[1] * point.index[1] + line[2] * point.index[2] + line[3]);
      lines.push(`index ${point.index.map(round).join(", ")}`, `${world.map(round).join(", ")} ${unit}`.trim());
      this.ask({volume: this.slices.volume, index: point.index});
      if (this.sampled && JSON.stringify(this.sampled.index) === JSON.stringify(point.index)) lines.push(`value ${tidy(this.sampled.value, spanOf(this.source))}`);
    }
    view.caption.textContent = lines.join("\n");
  }

  drawCross(context, view, place) {
    const counts = this.counts();
    const [x, y] = view.plane.map((axis, i) => {
      const part = this.slices.index[axis] / (counts[axis] - 1 || 1);
      return place.flips[i] ? 1 - part : part;
    });
    context.strokeStyle = "#ffffff66";
    context.lineWidth = place.ratio;
    context.beginPath();
    context.moveTo(place.left + x * place.w, place.top);
    context.lineTo(place.left + x * place.w, place.top + place.h);
    context.moveTo(place.left, place.top + y * place.h);
    context.lineTo(place.left + place.w, place.top + y * place.h);
    context.stroke();
  }

  // The left button moves the point, the middle one or Ctrl the slices. The right button, or Shift, changes the window:
  // sideways its width, up and down its level. Two fingers zoom and move the slices.
  drag(event, view) {
    const {canvas, fingers} = view;
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    canvas.onpointerup = canvas.onpointercancel = ended => {
      fingers.delete(ended.pointerId);
      canvas.onpointermove = null;
    };
    if (fingers.size > 1) {
      if (fingers.size === 2) this.moveTo(view.pressed[1]); // the first finger has moved it
      canvas.onpointermove = fingers.size === 2 ? now => this.pinch(now, view) : null;
      return;
    }
    view.pressed = [view.pressed?.[1] ?? this.slices.index, this.slices.index]; // where the point was before the last two
    const windowing = event.button === 2 || event.shiftKey, panning = event.button === 1 || event.ctrlKey;
    if (panning) event.preventDefault();
    let last = [event.clientX, event.clientY];
    const move = now => {
      if (windowing) {
        const [low, high] = this.slices.window ?? this.source.window, span = this.source.range[1] - this.source.range[0];
        const level = (low + high) / 2 - (now.clientY - last[1]) / 400 * span;
        const width = Math.max(span / 1000, high - low + (now.clientX - last[0]) / 400 * span);
        this.app.changeState({slices: {...this.slices, window: [level - width / 2, level + width / 2]}});
      } else if (panning) {
        const [a, b] = [last, [now.clientX, now.clientY]].map(each => this.pointAt(view, each).index);
        if (this.centre) this.zoomTo(this.zoom, this.centre.map((each, i) => each + a[i] - b[i]));
      } else {
        this.moveTo(this.pointAt(view, [now.clientX, now.clientY]).index);
      }
      last = [now.clientX, now.clientY];
    };
    canvas.onpointermove = move;
    if (!windowing && !panning) move(event);
  }

  // One of two fingers has moved: what was in their middle is there again, enlarged as their distance is.
  pinch(event, view) {
    const before = view.fingers.get(event.pointerId), now = [event.clientX, event.clientY];
    const [other] = [...view.fingers].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
    const [from, to] = [before, now].map(place => ({
      middle: place.map((each, i) => (each + other[i]) / 2), width: Math.max(1, Math.hypot(...place.map((each, i) => each - other[i]))),
    }));
    view.fingers.set(event.pointerId, now);
    this.zoomBy(to.width / from.width, view, from.middle);
    const [a, b] = [from, to].map(each => this.pointAt(view, each.middle).index);
    if (this.centre) this.zoomTo(this.zoom, this.centre.map((each, i) => each + a[i] - b[i]));
  }
}

// Lines where the bilinear interpolation equals the level, square by square (marching squares).
export function strokeContour(values, rows, columns, level, to, context) {
  const crossing = (a, b) => (level - a) / (b - a);
  for (let y = 0; y < rows - 1; ++y) {
    for (let x = 0; x < columns - 1; ++x) {
      const at = y * columns + x;
      const [a, b, c, d] = [values[at], values[at + 1], values[at + columns + 1], values[at + columns]];
      const kind = Number(a >= level) | Number(b >= level) << 1 | Number(c >= level) << 2 | Number(d >= level) << 3;
      if (kind === 0 || kind === 15) continue;
      const points = [];
      if ((a >= level) !== (b >= level)) points.push([x + crossing(a, b), y]);
      if ((b >= level) !== (c >= level)) points.push([x + 1, y + crossing(b, c)]);
      if ((d >= level) !== (c >= level)) points.push([x + crossing(d, c), y + 1]);
      if ((a >= level) !== (d >= level)) points.push([x, y + crossing(a, d)]);
      // At a saddle, the value in the middle decides which crossings are connected.
      if (points.length === 4 && ((a + b + c + d) / 4 >= level) !== (a >= level)) points.push(points.shift());
      for (let i = 0; i + 1 < points.length; i += 2) {
        context.moveTo(...to(...points[i]));
        context.lineTo(...to(...points[i + 1]));
      }
    }
  }
}
