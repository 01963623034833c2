// Measurements, drawn over the picture: points, distances, angles and the walls' thickness, with numbers and units.

import {add, pixelsPerUnit, project, scale} from "./geometry.js";
import {makeSvg} from "./dom.js";

const COLOR = "#c8553d", INK = "#1f2933", SIZE = 12;

// The result of a measurement; null without one. `round` makes a text of a number.
export function resultText({tool, points}, result, unit, round) {
  if (result != null) return round(result) + (tool === "angle" ? "°" : unit);
  return tool === "thickness" ? "no other side" : tool === "angle" && points.length === 3 ? "two points are one" : null;
}

export function drawMeasurements(measurements, results, unit, camera, width, height) {
  const drawn = measurements.map((each, i) => drawMeasurement(each, results[i], `${i + 1}`, unit, camera, width, height));
  return [...drawn.flatMap(({marks}) => marks), ...apart(drawn.map(({label}) => label).filter(Boolean)).map(label)];
}

// Texts at places that do not cover each other: later ones move down.
export function apart(texts) {
  const put = [];
  for (const {text, place: [x, y]} of texts) {
    const widthOf = other => other.text.length * SIZE * 0.6;
    const beside = put.filter(other => x < other.place[0] + widthOf(other) && other.place[0] < x + widthOf({text}));
    let top = y;
    for (const [, above] of beside.map(each => each.place).sort((a, b) => a[1] - b[1])) if (Math.abs(above - top) < SIZE * 1.2) top = above + SIZE * 1.2;
    put.push({text, place: [x, top]});
  }
  return put;
}

function drawMeasurement(each, result, number, unit, camera, width, height) {
  const places = each.points.map(point => project(camera, point.position, width, height));
  const text = result == null ? number : `${number}: ${resultText(each, result, unit, short)}`;
  const lines = places.slice(1).map((place, i) => line(places[i], place)), marks = places.map(dot);
  const [first, second] = places;
  const middle = each.tool === "angle" && places.length > 1 ? second : first && second && scale(add(first, second), 0.5);
  const at = middle ?? first;
  return {marks: [...lines, each.tool === "thickness" && ball(each.points[0], camera, width, height), ...marks].filter(Boolean),
    label: at && {text, place: [at[0] + 8, at[1] - 6]}};
}

// The largest ball that fits in the wall at a point.
function ball({position, normal, thickness}, camera, width, height) {
  if (thickness == null) return null;
  const middle = add(position, scale(normal, -thickness / 2)), place = project(camera, middle, width, height);
  return place && makeSvg("circle", {cx: place[0], cy: place[1], r: thickness / 2 * pixelsPerUnit(camera, place[2], height), fill: COLOR,
    "fill-opacity": 0.12, stroke: COLOR, "stroke-width": 1.5, "stroke-dasharray": "4 3"});
}

function line(a, b) {
  if (!a || !b) return null;
  const ends = {x1: a[0], y1: a[1], x2: b[0], y2: b[1]};
  return makeSvg("g", {}, makeSvg("line", {...ends, stroke: "#fff", "stroke-width": 4, "stroke-opacity": 0.7}),
    makeSvg("line", {...ends, stroke: COLOR, "stroke-width": 1.8}));
}

const dot = place => place && makeSvg("circle", {cx: place[0], cy: place[1], r: 4, fill: COLOR, stroke: "#fff", "stroke-width": 1.5});

const label = ({text, place: [x, y]}) => makeSvg("text", {class: "measured", x, y, "font-size": SIZE, "font-weight": 600,
  fill: INK, stroke: "#fff", "stroke-width": 3, "paint-order": "stroke"}, text);

const short = value => String(Number(value.toPrecision(4)));
