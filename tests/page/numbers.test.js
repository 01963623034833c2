// Numbers that users write and read, and levels that are suggested.

import assert from "node:assert/strict";
import test from "node:test";

import {parseNumber, stepped, tidy} from "../../python/isospline/viewer/page/dom.js";
import {endsOf, nearest} from "../../python/isospline/viewer/page/histogram.js";
import {apart, resultText} from "../../python/isospline/viewer/page/measurements.js";
import {between, suggested} from "../../python/isospline/viewer/page/panel.js";
import {pixelsOf} from "../../python/isospline/viewer/page/stage.js";

test("numbers have a point or a comma, and nothing else is one", () => {
  for (const [text, number] of Object.entries({"1": 1, " 2,5 ": 2.5, "\u22123": -3, "+.5": 0.5, "1e3": 1000, "7.": 7})) assert.equal(parseNumber(text), number);
  for (const text of ["", "x", "1 000", "1.000,5", "1,2,3", "0x10", "NaN", "Infinity", "1e999", "--1"]) assert.equal(parseNumber(text), null, text);
});

test("numbers are shown whole, or with six digits", () => {
  assert.deepEqual([1234567, 1234567.8, 0.1 + 0.2, -0.00001234567, null].map(each => tidy(each)), ["1234567", "1234570", "0.3", "-0.0000123457", "–"]);
});

test("numbers of a narrow range have the digits that tell them apart", () => {
  assert.deepEqual([1e9 + 123.5, 1e9 + 124, 1e9 + 123.456789].map(value => tidy(value, 1000)), ["1000000123.5", "1000000124", "1000000123.46"]);
  assert.deepEqual([tidy(-1000.00012345678, 1e-4), tidy(0.123456789, 50), tidy(1.5, 0)], ["-1000.000123457", "0.123457", "1.5"]);
  assert.equal(between([1e9 + 500.5], [1e9, 1e9 + 1000]), 1e9 + 250.25);
});

test("results have units", () => {
  const texts = [
    resultText({tool: "distance", points: [{}, {}]}, 12.5, " mm", String), resultText({tool: "angle", points: [{}, {}, {}]}, 45, " mm", String),
    resultText({tool: "thickness", points: [{}]}, null, "", String), resultText({tool: "angle", points: [{}]}, null, "", String),
    resultText({tool: "angle", points: [{}, {}, {}]}, null, "", String), resultText({tool: "point", points: [{}]}, null, "", String)];
  assert.deepEqual(texts, ["12.5 mm", "45°", "no other side", null, "two points are one", null]);
});

test("new levels are suggested ones, and then in the widest gap", () => {
  const source = {suggested_levels: [100, 300, 50], range: [0, 1000]};
  assert.equal(suggested([], source), 100);
  assert.equal(suggested([110], source), 300);
  assert.equal(suggested([110, 290, 45], source), undefined);
  assert.equal(between([110, 290, 45], source.range), 645);
  assert.equal(between([], [0, 1]), 0.5);
});

test("levels of whole numbers stay halfway between them, also at the ends", () => {
  const bytes = {range: [0, 255], spacing_of_values: 1}, ends = endsOf(bytes);
  const walk = (from, ...steps) => steps.map(step => (from = stepped(from, step, ends)));
  assert.deepEqual(walk(253.5, 1, 1, 1, -1, -1), [254.5, 254.5, 254.5, 253.5, 252.5]);
  assert.deepEqual(walk(2.5, -10, -1, 1), [0.5, 0.5, 1.5]);
  assert.deepEqual(walk(70, 1, -0.5), [71, 70.5]); // one that was typed in keeps its part of a step
  assert.deepEqual(walk(255, 1, -1), [255, 253.5]);
  assert.deepEqual([-3, 127.3, 300].map(value => nearest(value, 1, bytes)), [0.5, 127.5, 254.5]);
  const bits = {range: [0, 1], spacing_of_values: 1};
  assert.deepEqual([stepped(0.5, 1, endsOf(bits)), stepped(0.5, -1, endsOf(bits)), nearest(0.9, 1, bits)], [0.5, 0.5, 0.5]);
  const continuous = {range: [-1, 1], spacing_of_values: 0};
  assert.deepEqual([stepped(0.95, 0.1, endsOf(continuous)), nearest(-0.97, 0.25, continuous), nearest(3, 0.25, continuous)], [1, -1, 1]);
});

test("labels of near measurements are below each other", () => {
  const at = (text, x, y) => ({text, place: [x, y]}), placed = apart([at("1: 12.5", 100, 50), at("2: 40", 110, 52), at("3", 300, 50), at("4: 7", 90, 60)]);
  assert.deepEqual(placed.map(({place}) => place[0]), [100, 110, 300, 90]);
  const tops = placed.map(({place}) => place[1]).toSorted((a, b) => a - b);
  assert.deepEqual([tops[0], tops[1]], [50, 50]);
  assert.ok(tops[2] - 50 >= 12 && tops[3] - tops[2] >= 12);
});

test("labels of near measurements have an end at every height", () => {
  for (const height of [430.3, 100.3, 1e18]) {
    const [first, second] = apart([{text: "1", place: [10, height]}, {text: "2", place: [12, height]}]);
    assert.ok(first.place[1] === height && second.place[1] >= height);
  }
  const crowd = [...Array(40).keys()].map(i => ({text: "1", place: [10, 430.3 + (i * 7) % 11]})), tops = apart(crowd).map(({place}) => place[1]).toSorted((a, b) => a - b);
  assert.ok(tops.every((top, i) => !i || top - tops[i - 1] > 14.39));
});

test("pictures of large windows have at most 4096 pixels a side", () => {
  assert.deepEqual(pixelsOf(800, 600, 1.25), {width: 1000, height: 750});
  assert.deepEqual(pixelsOf(800, 600, 3), {width: 1600, height: 1200});
  assert.deepEqual(pixelsOf(5120, 1440, 1), {width: 4096, height: 1152});
  assert.deepEqual(pixelsOf(2240, 2700, 2), {width: 3398, height: 4096});
  assert.deepEqual(pixelsOf(0, 0, 2), {width: 1, height: 1});
});
