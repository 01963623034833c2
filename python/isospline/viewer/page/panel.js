// The controls at the side. Each part is rebuilt when its state changes, unless the user is operating it.

import {add, basis, scale} from "./geometry.js";
import {active, byId, checkbox, field, isOperated, keyOf, make, numberInput, segments, select, slider, tidy, watchOperation} from "./dom.js";
import {resultText} from "./measurements.js";
import {boundsOf} from "./gizmo.js";
import {endsOf, Histogram, spanOf} from "./histogram.js";

const LIGHTS = {studio: "Studio", phong: "Phong", outline: "Outline", "ambient-occlusion": "Ambient", "path-trace": "Path traced"};
const RULES = {color: "One colour", own: "Its own colours", normal: "Direction", "mean-curvature": "Mean curvature", "gaussian-curvature": "Gaussian curvature",
  "maximum-curvature": "Largest curvature", "minimum-curvature": "Smallest curvature"};
// Windows for computed tomography: width and level, in Hounsfield units.
const WINDOWS = {"Soft tissue": [400, 40], Bone: [1800, 400], Lung: [1500, -600], Brain: [80, 40]};
const TOOLS = {point: "Point", distance: "Distance", angle: "Angle", thickness: "Thickness"};
const HINTS = {point: "Click on a surface to measure a point.", distance: "Click on two points.",
  angle: "Click on three points: the angle is at the second.", thickness: "Click on a surface to measure its wall."};
const SAVES = {png: "Picture (PNG)", exr: "Picture with layers (EXR)", turntable: "Turntable (MP4)",
  mesh: "Mesh (STL)", session: "Session", python: "Python"};

const CONTROLS = "button, select, input";

export class Panel {
  /** @param {import("./main.js").App} app */
  constructor(app) {
    this.app = app;
    this.histogram = new Histogram(app, byId("histogram"));
    this.drawn = {}; // the dependencies of each part at the time it was built
    for (const name of ["state", "document", "selected"]) app.on(name, () => this.draw());
    app.on("other_viewer", () => { this.drawn = {}; this.histogram.zoom = null; });
    watchOperation(byId("panel"), () => this.draw());
    app.on("measured", ({point}) => { if (point) byId("measurements").open = true; });
    this.drawSaves();
  }

  draw() {
    const {app} = this;
    if (!app.state) return;
    this.histogram.draw();
    const {objects, light, shadows, exponent, background, clip, slices, measurements} = app.state, open = [...app.sources.keys()];
    // Levels change often; they only change the value of their input.
    const withoutLevels = objects.map(each => ({...each, level: each.level !== null}));
    this.put("objects", [withoutLevels, light, app.selected, open, app.defaultLimits], () => objects.map(each => this.drawObject(each)));
    for (const each of objects) {
      const level = /** @type {any} */ (document.querySelector(`.object[data-object="${each.id}"] .head input.number`));
      level?.show(each.level);
    }
    this.put("add", [objects.map(each => each.source), open], () => this.drawAdd());
    this.put("light", [light, shadows, exponent, background], () => this.drawLight(), true);
    this.put("cut", [clip.kind, clip.capped, clip.values], () => this.drawCut(), true);
    this.put("measurements", [measurements, app.tool, app.unit], () => this.drawMeasurements(), true);
    this.put("slicing", [slices.shown, slices.volume, slices.window, open], () => this.drawSlicing(), true);
  }

  // Rebuild a part, except its summary, if its dependencies have changed and the user does not operate it.
  put(id, depends, draw, afterSummary = false) {
    const part = byId(id), key = JSON.stringify(depends);
    if (this.drawn[id] === key || isOperated(part)) return;
    this.drawn[id] = key;
    const focused = part.contains(active()) && active().matches(CONTROLS) ? keyOf(active()) : null;
    part.replaceChildren(...(afterSummary ? [part.querySelector("summary")] : []), ...draw().filter(Boolean));
    if (focused === null) return;
    const same = [...part.querySelectorAll(CONTROLS)].find(each => keyOf(each) === focused);
    (same ?? part.closest("details").querySelector("summary")).focus(); // that of a removed object is gone
  }

  number(label, value, change, options = {}) {
    return numberInput(label, value, {...options, change, refuse: text => this.app.note(text)});
  }

  // -- Surfaces ------------------------------------------------------------------------------------------------------

  drawObject(each) {
    const {app} = this, source = app.sources.get(each.source);
    const change = changes => app.changeObject(each.id, changes), title = source ? app.nameOf(source) : each.source;
    const color = make("input", {type: "color", value: each.color, "aria-label": "Colour", title: "Colour"});
    color.oninput = () => change({color: color.value});
    const name = make("button", {class: "bare name", title, "aria-expanded": String(app.selected === each.id),
      onclick: () => { app.selected = app.selected === each.id ? null : each.id; this.draw(); }}, title);
    const level = each.level === null ? make("span", {class: "hint"}, `${source?.faces} faces`)
      : this.number(`Level of ${title}`, each.level, value => change({level: value}),
        {step: source && this.histogram.step(source), least: source?.level_range[0], most: source?.level_range[1], ends: source && endsOf(source), span: spanOf(source), live: true});
    const element = make("div", {class: `object${each.visible ? "" : " off"}`, "data-object": each.id},
      make("div", {class: "head"}, color, name, level,
        make("button", {class: "bare", title: each.visible ? "Hide" : "Show", "aria-label": each.visible ? "Hide" : "Show", "data-key": "visible",
          onclick: () => change({visible: !each.visible})}, each.visible ? "●" : "○"),
        make("button", {class: "bare", title: "Remove", "aria-label": "Remove", onclick: () => {
          app.change({type: "remove_object", id: each.id});
        }}, "×")));
    if (source?.body_level != null) {
      element.append(make("div", {class: "row"}, checkbox("Only the body, without the table", each.body_level !== null,
        body => change({body_level: body ? source.body_level : null}))));
    }
    if (app.selected === each.id) element.append(...this.drawLook(each, change));
    return element;
  }

  drawLook(each, change) {
    const {app} = this, rules = Object.fromEntries(app.options.color_rules.map(rule => [rule, RULES[rule]]));
    if (!app.sources.get(each.source)?.has_rule) delete rules.own;
    if (each.level === null) for (const rule of Object.keys(rules)) if (rule.includes("curvature")) delete rules[rule];
    for (const source of app.sources.values()) if (source.kind === "volume") rules[source.key] = `Values of ${app.nameOf(source)}`;
    const edges = slider("Opacity at edges", each.silhouette_opacity ?? each.opacity, 0, 1, 0.01, silhouette_opacity => change({silhouette_opacity}));
    const pieces = {all: "All"};
    for (const count of [1, 2, 3, 5, 10, each.largest ?? 1].sort((a, b) => a - b)) pieces[`+${count}`] = count === 1 ? "The largest" : `The ${count} largest`;
    const parts = [
      each.level !== null && field("Pieces", select("Pieces", pieces, each.largest === null ? "all" : `+${each.largest}`,
        value => change({largest: value === "all" ? null : Number(value)}))),
      each.level !== null && make("div", {class: "row"}, checkbox("Closed at the border", each.closed, closed => change({closed}))),
      app.state.light !== "path-trace" && field("Opacity", slider("Opacity", each.opacity, 0, 1, 0.01, opacity => {
        change({opacity});
        if (app.object(each.id).silhouette_opacity === null) edges.value = opacity; // it follows
      })),
      app.state.light !== "path-trace" && field("Opacity at edges", edges),
      field("Colour by", select("Colour by", rules, each.color_by, color_by => change({color_by, limits: null}))),
    ];
    if (!["color", "own", "normal"].includes(each.color_by)) {
      const maps = Object.fromEntries(Object.keys(app.options.color_maps).map(name => [name, name]));
      const limitsOf = () => app.object(each.id).limits ?? app.defaultLimits[each.id] ?? [0, 1], limits = limitsOf();
      const span = Math.abs(limits[1] - limits[0]);
      parts.push(field("Colour map", select("Colour map", maps, each.cmap, cmap => change({cmap}))),
        make("div", {class: "color-bar", style: `background: linear-gradient(to right, ${app.options.color_maps[each.cmap]?.join()})`}),
        make("div", {class: "pair", style: "margin-top: 4px"},
          this.number("First value", limits[0], value => change({limits: [value, limitsOf()[1]]}), {span}),
          this.number("Last value", limits[1], value => change({limits: [limitsOf()[0], value]}), {span})));
    }
    if (app.state.light === "path-trace") {
      parts.push(field("Metal", slider("Metal", each.metallic, 0, 1, 0.01, metallic => change({metallic}))),
        field("Roughness", slider("Roughness", each.roughness, 0, 1, 0.01, roughness => change({roughness}))));
    }
    return parts.filter(Boolean);
  }

  drawAdd() {
    const {app} = this;
    return [...app.sources.values()].map(source => {
      const title = app.nameOf(source), isShown = app.state.objects.some(each => each.source === source.key);
      const name = source.kind === "mesh" ? `+ ${title}` : app.sources.size > 1 ? `+ level of ${title}` : "+ level";
      const level = () => {
        const levels = app.state.objects.filter(each => each.source === source.key).map(each => each.level);
        return suggested(levels, source) ?? between(levels, source.range);
      };
      return make("div", {class: "row source"}, source.kind === "mesh" && isShown ? make("span", {class: "name"}, title)
        : make("button", {"data-key": `add ${source.key}`, onclick: () => app.change({type: "add_object", source: source.key, level: source.kind === "mesh" ? null : level()})}, name),
        make("button", {class: "bare", title: `Close ${title}; this cannot be undone`, "aria-label": `Close ${title}`, "data-key": `close ${source.key}`,
          onclick: () => app.send({type: "close", source: source.key})}, "Close"));
    });
  }

  // -- Light ---------------------------------------------------------------------------------------------------------

  drawLight() {
    const {app} = this, {state} = app;
    const background = make("input", {type: "color", value: state.background, "aria-label": "Background"});
    background.oninput = () => app.changeState({background: background.value});
    return [
      segments("Light", LIGHTS, state.light, light => app.changeState({light})),
      state.light === "phong" && make("div", {class: "row"}, checkbox("Shadows", state.shadows, shadows => app.changeState({shadows}))),
      state.light === "outline" && field("Exponent", slider("Exponent", state.exponent, 0.2, 8, 0.1, exponent => app.changeState({exponent}))),
      state.light === "path-trace" && make("p", {class: "hint"}, "All surfaces are opaque. Select a surface to set its metal and roughness."),
      field("Background", background),
    ];
  }

  // -- Cut -----------------------------------------------------------------------------------------------------------

  drawCut() {
    const {app} = this, {clip} = app.state;
    const change = changes => app.changeState({clip: {...app.state.clip, ...changes}});
    const choose = kind => {
      const [lower, upper] = boundsOf(app), middle = scale(add(lower, upper), 0.5);
      const corner = side => middle.map((each, i) => each + side * 0.3 * (upper[i] - lower[i]));
      change({kind, ...kind === "plane" ? {point: middle} : kind === "box" ? {minimum: corner(-1), maximum: corner(1)} : {}});
    };
    const along = normal => () => change({normal});
    return [
      segments("Cut", {none: "None", plane: "Plane", box: "Box"}, clip.kind, choose),
      clip.kind === "plane" && make("div", {class: "row"},
        make("button", {onclick: along([1, 0, 0])}, "x"), make("button", {onclick: along([0, 1, 0])}, "y"), make("button", {onclick: along([0, 0, 1])}, "z"),
        make("button", {onclick: () => change({normal: basis(app.camera).forward})}, "facing me"),
        make("button", {onclick: () => change({normal: scale(app.state.clip.normal, -1)})}, "flip")),
      clip.kind !== "none" && make("div", {class: "row"},
        checkbox("Closed", clip.capped, capped => change({capped})),
        clip.capped && checkbox("Values on the cut", clip.values, values => change({values}))),
      clip.kind !== "none" && make("p", {class: "hint"}, "Drag the handles in the picture. Meshes are not cut."),
    ];
  }

  // -- Slices --------------------------------------------------------------------------------------------------------

  drawSlicing() {
    const {app} = this, {slices} = app.state, volumes = [...app.sources.values()].filter(each => each.kind === "volume");
    const change = changes => app.changeState({slices: {...app.state.slices, ...changes}});
    const source = app.sources.get(slices.volume);
    if (!source) return [make("p", {class: "hint"}, "No volume is open.")];
    const windowOf = () => app.state.slices.window ?? source.window, widthOf = all => all[1] - all[0], levelOf = all => (all[0] + all[1]) / 2;
    const set = (width, level) => change({window: [level - width / 2, level + width / 2]});
    return [
      make("div", {class: "row"}, checkbox("Show three slices", slices.shown, shown => change({shown}))),
      volumes.length > 1 && field("Volume", select("Volume", Object.fromEntries(volumes.map(each => [each.key, app.nameOf(each)])), slices.volume, key => {
        const other = app.sources.get(key);
        change({volume: key, index: other.counts.map(each => (each - 1) / 2), window: other.window});
      })),
      field("Window", this.number("Window", widthOf(windowOf()), width => set(width, levelOf(windowOf())), {least: 1e-12, span: spanOf(source)})),
      field("Level", this.number("Window level", levelOf(windowOf()), level => set(widthOf(windowOf()), level), {span: spanOf(source)})),
      source.patient && make("div", {class: "row"}, ...Object.entries(WINDOWS).map(([name, [width, level]]) =>
        make("button", {title: `Window ${width}, level ${level}`, onclick: () => set(width, level)}, name)),
        make("button", {onclick: () => change({window: source.window})}, "All")),
      make("p", {class: "hint"}, "In a slice: drag to move the point, use the wheel to change the slice, Ctrl and the wheel to zoom, the middle button to pan, and the right button to set window and level. A double click maximises."),
    ];
  }

  // -- Measurements and files to save --------------------------------------------------------------------------------

  drawMeasurements() {
    const {app} = this, {measurements} = app.state;
    const choose = tool => { app.tool = tool; this.draw(); };
    return [
      segments("Measure", TOOLS, app.tool, choose),
      make("p", {class: "hint"}, HINTS[app.tool]),
      ...measurements.map((each, i) => this.drawMeasurement(each, i)),
      measurements.length > 0 && make("div", {class: "row"},
        make("button", {onclick: () => app.send({type: "save", what: "measurements"})}, "Save as CSV"),
        make("button", {onclick: () => app.change({type: "clear_measurements"})}, "Clear")),
    ];
  }

  drawMeasurement(each, i) {
    const {app} = this, vector = numbers => numbers.map(number => tidy(number)).join("  "), length = number => number == null ? null : tidy(number) + app.unit;
    const result = app.results[i], rows = [[TOOLS[each.tool].toLowerCase(), resultText(each, result, app.unit, tidy)]];
    for (const point of each.points) rows.push(["position", vector(point.position) + app.unit]);
    if (each.tool === "point") {
      const [point] = each.points;
      rows.push(["index", point.index && vector(point.index)], ["value", point.value != null && tidy(point.value, spanOf(app.sources.get(app.object(point.object)?.source)))], ["normal", vector(point.normal)],
        ["curvature", point.mean_curvature != null && `mean ${tidy(point.mean_curvature)}  Gaussian ${tidy(point.gaussian_curvature)}`],
        ["thickness", length(point.thickness)]);
    }
    return make("div", {class: "measurement"}, make("strong", {}, `${i + 1}`),
      make("button", {class: "bare", "aria-label": `Remove measurement ${i + 1}`, "data-key": `remove ${each.id}`,
        onclick: () => app.change({type: "remove_measurement", id: each.id})}, "×"),
      make("dl", {}, ...rows.filter(([, text]) => text).flatMap(([name, text]) => [make("dt", {}, name), make("dd", {}, text)])));
  }

  drawSaves() {
    const {app} = this, options = {transparent: false, measurements: true}; // and width and height, if they are not those of the picture
    const sides = Object.fromEntries(["Width", "Height"].map(name => [name.toLowerCase(), this.number(name, 1, value => {
      options[name.toLowerCase()] = value;
    }, {step: 1, least: 1, most: 16384, whole: true})]));
    let size = {};
    const show = () => { for (const [name, input] of Object.entries(sides)) if (!(name in options)) input.show(size[name]); };
    app.on("size", now => { size = now; show(); });
    const forget = () => { for (const name of Object.keys(sides)) delete options[name]; show(); };
    byId("saving").append(
      field("Pixels", make("div", {class: "pair"}, sides.width, "×", sides.height,
        make("button", {class: "bare", title: "Size of the picture", "aria-label": "Size of the picture", onclick: forget}, "↺"))),
      make("div", {class: "row"}, checkbox("Transparent background", false, transparent => { options.transparent = transparent; }),
        checkbox("Measurements", true, measurements => { options.measurements = measurements; })),
      make("div", {class: "row"}, ...Object.entries(SAVES).map(([what, name]) =>
        make("button", {"data-save": what, onclick: () => app.send({type: "save", what: /** @type {any} */ (what), options})}, name))));
  }
}

// The first suggested level that is not near another one.
export function suggested(levels, {suggested_levels: all, range}) {
  const [lower, upper] = range;
  return all.find(each => levels.every(level => Math.abs(level - each) > 0.02 * (upper - lower)));
}

// A level in the middle of the widest gap between levels.
export function between(levels, range) {
  const [lower, upper] = range, all = [lower, ...levels, upper].sort((a, b) => a - b);
  let best = 0;
  for (let i = 1; i + 1 < all.length; ++i) if (all[i + 1] - all[i] > all[best + 1] - all[best]) best = i;
  return Number(tidy((all[best] + all[best + 1]) / 2, upper - lower));
}
