// The histogram of a volume's values; the levels of its surfaces can be dragged.

import {clamp} from "./geometry.js";
import {active, makeSvg, stepped, tidy} from "./dom.js";

const WIDTH = 310, HEIGHT = 112, TOP = 22, BOTTOM = 96;

// The lowest and the highest level that is worth while: of values with a spacing, halfway to the next ones.
/** @type {(source: any) => [number, number]} */
export const endsOf = ({range, spacing_of_values: spacing}) => [range[0] + spacing / 2, range[1] - spacing / 2];

// The nearest level that is a number of steps from the lowest one: of values with a spacing, halfway between two of them.
export function nearest(value, step, source) {
  const [first, last] = endsOf(source), from = source.spacing_of_values ? first : 0;
  return clamp(from + Math.round((value - from) / step) * step, first, last);
}

// The size of a volume's range, for the digits of its values.
export const spanOf = source => source ? source.range[1] - source.range[0] || undefined : undefined;

export class Histogram {
  /** @param {import("./main.js").App} app
   *  @param {any} element */
  constructor(app, element) {
    this.app = app;
    this.element = element;
    this.zoom = null; // the visible range, for the volume with this key
    this.bars = null; // what the bars were drawn for
    this.markers = makeSvg("g");
  }

  // The volume of the selected surface, or the first one.
  source() {
    const selected = this.app.sources.get(this.app.object(this.app.selected)?.source);
    return selected?.kind === "volume" ? selected : [...this.app.sources.values()].find(each => each.kind === "volume");
  }

  range(source) {
    return this.zoom?.key === source.key ? this.zoom.range : source.range;
  }

  // The step of levels: the spacing of values, or a fraction of the range for continuous values; finer with Shift.
  step(source) {
    return source.spacing_of_values || (source.range[1] - source.range[0]) / 2000 || 1;
  }

  draw() {
    const {app} = this, source = this.source();
    this.element.hidden = !source;
    if (!source) return;
    const range = this.range(source), [lower, upper] = range, span = upper - lower || 1;
    const x = value => (value - lower) / span * WIDTH;
    const focused = active()?.dataset?.object;
    if (this.bars?.source !== source || String(this.bars.range) !== String(range)) {
      this.bars = {source, range};
      this.drawBars(source, range, x);
    }
    this.markers.replaceChildren(...app.state.objects.filter(each => each.source === source.key && each.level !== null)
      .map(each => this.marker(each, x(each.level), source)).filter(Boolean));
    if (focused !== undefined && this.element !== active()) this.element.querySelector(`[data-object="${focused}"]`)?.focus();
  }

  marker(each, place, source) {
    if (place < -1 || place > WIDTH + 1) return null;
    const marker = makeSvg("g", {class: "level", tabindex: 0, role: "slider", "aria-label": `Level ${tidy(each.level, spanOf(source))}`, "aria-valuenow": each.level,
      "data-object": each.id},
      makeSvg("rect", {x: place - 8, y: 0, width: 16, height: BOTTOM}),
      makeSvg("line", {x1: place, x2: place, y1: TOP - 4, y2: BOTTOM, stroke: each.color}),
      makeSvg("circle", {cx: place, cy: TOP - 4, r: 6, fill: each.color}),
      makeSvg("text", {x: clamp(place, 22, WIDTH - 22), y: 10}, tidy(each.level, spanOf(source))));
    marker.onpointerdown = event => this.drag(event, each.id, source);
    marker.onkeydown = event => this.key(event, each.id, source);
    return marker;
  }

  drawBars(source, [lower, upper], x) {
    const bars = source.histogram, most = Math.log1p(Math.max(...bars)), width = (source.range[1] - source.range[0] || 1) / bars.length;
    let path = `M0,${BOTTOM}`;
    bars.forEach((count, i) => {
      const left = x(source.range[0] + i * width), right = x(source.range[0] + (i + 1) * width);
      if (right < 0 || left > WIDTH) return;
      const y = BOTTOM - (BOTTOM - TOP) * Math.log1p(count) / most;
      path += `L${clamp(left, 0, WIDTH)},${y}L${clamp(right, 0, WIDTH)},${y}`;
    });
    const svg = makeSvg("svg", {viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: "none", role: "group", "aria-label": `Histogram of ${source.name}`},
      makeSvg("path", {class: "bars", d: `${path}L${WIDTH},${BOTTOM}Z`}),
      makeSvg("line", {x1: 0, x2: WIDTH, y1: BOTTOM, y2: BOTTOM, stroke: "#9aa7b3"}),
      ...[[lower, "start"], [upper, "end"]].map(([value, anchor], i) =>
        makeSvg("text", {x: i * WIDTH, y: HEIGHT - 3, "text-anchor": anchor, class: "end"}, tidy(value, upper - lower))),
      this.markers);
    svg.onwheel = event => this.zoomed(event, source);
    svg.ondblclick = () => { this.zoom = null; this.draw(); };
    this.element.replaceChildren(svg);
  }

  setLevel(id, value) {
    if (value !== this.app.object(id).level) this.app.changeObject(id, {level: Number(value.toPrecision(12))});
  }

  drag(event, id, source) {
    event.preventDefault();
    this.app.selected = id;
    const [lower, upper] = this.range(source), pixels = this.element.clientWidth;
    let level = this.app.object(id).level, from = event.clientX;
    const move = now => {
      level += (now.clientX - from) / pixels * (upper - lower) * (now.shiftKey ? 0.1 : 1);
      from = now.clientX;
      this.setLevel(id, nearest(level, this.step(source) * (now.shiftKey ? 0.1 : 1), source));
    };
    const end = () => { removeEventListener("pointermove", move); removeEventListener("pointerup", end); removeEventListener("pointercancel", end); };
    addEventListener("pointermove", move);
    addEventListener("pointerup", end);
    addEventListener("pointercancel", end);
    this.app.tell("selected");
  }

  key(event, id, source) {
    const direction = {ArrowLeft: -1, ArrowRight: 1, PageDown: -10, PageUp: 10}[event.key];
    if (!direction) return;
    event.preventDefault();
    const step = this.step(source) * (event.shiftKey ? 0.1 : 1);
    this.setLevel(id, stepped(this.app.object(id).level, direction * step, endsOf(source)));
  }

  // The wheel zooms the range about the value under the pointer.
  zoomed(event, source) {
    event.preventDefault();
    const [lower, upper] = this.range(source), factor = Math.exp(event.deltaY * 0.002);
    const value = lower + event.offsetX / this.element.clientWidth * (upper - lower);
    const range = [value + (lower - value) * factor, value + (upper - value) * factor];
    range[0] = Math.max(range[0], source.range[0]);
    range[1] = Math.min(range[1], source.range[1]);
    this.zoom = {key: source.key, range};
    this.draw();
  }
}
