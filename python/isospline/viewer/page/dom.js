// Short functions that make elements.

import {clamp} from "./geometry.js";

// An element of the page, of the type that the caller expects.
/** @type {(id: string) => any} */
export const byId = id => document.getElementById(id);

// The element that has the focus.
/** @type {() => any} */
export const active = () => document.activeElement;

// -- What the user operates ------------------------------------------------------------------------------------------

/** @type {any} */
let pressed = null, edited = null; // the element under a pressed pointer, and the control whose value is not complete

// Whether the user operates a control in an element: it keeps what it shows, and is not replaced.
/** @param {any} element */
export const isOperated = element => [pressed, edited].some(each => each && element.contains(each));

// Notice what is operated in an element. `ended` is called when that ends, after the click and the change of the focus.
export function watchOperation(root, ended) {
  const edit = event => { edited = event.target; };
  root.addEventListener("input", edit, {capture: true}); // before the control hears it
  root.addEventListener("click", event => { if (event.target.matches("input[type=color]")) edit(event); });
  for (const name of ["change", "focusout"]) {
    root.addEventListener(name, () => {
      if (edited) setTimeout(ended);
      edited = null;
    });
  }
  root.addEventListener("pointerdown", event => { if (!event.target.closest("select")) pressed = event.target; }); // its list gets the pointer's end
  for (const name of ["pointerup", "pointercancel"]) {
    addEventListener(name, () => {
      if (pressed) setTimeout(ended);
      pressed = null;
      if (!edited?.matches("input.number")) edited = null; // there may be no change after a drag
    });
  }
}

// What a control is called in its part of the page, also when it is drawn anew: the object that it belongs to, and its name.
/** @param {any} control */
export const keyOf = control => [control.closest("[data-object]")?.dataset.object,
  control.dataset.key ?? control.getAttribute("aria-label") ?? control.closest("label")?.textContent ?? control.textContent].join();

// -- Elements --------------------------------------------------------------------------------------------------------

// make("button", {class: "bare", onclick: f}, "text", child, ...)
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  return fill(element, attributes, children);
}

export function makeSvg(tag, attributes = {}, ...children) {
  return fill(document.createElementNS("http://www.w3.org/2000/svg", tag), attributes, children);
}

function fill(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element[name] = value;
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value != null) element.setAttribute(name, value);
  }
  element.append(...children.filter(child => child != null && child !== false));
  return element;
}

export const field = (name, ...children) => make("label", {class: "field"}, make("span", {}, name), ...children);

// A row of buttons; one of them is pressed.
export function segments(label, options, current, choose) {
  return make("div", {class: "segments", role: "group", "aria-label": label}, ...Object.entries(options).map(([value, text]) =>
    make("button", {"aria-pressed": String(value === current), "data-value": value, onclick: () => choose(value)}, text)));
}

export function slider(label, value, least, most, step, change) {
  const input = make("input", {type: "range", min: least, max: most, step, "aria-label": label});
  input.value = value;
  input.oninput = () => change(Number(input.value));
  return input;
}

// A field for a number, with a decimal point or comma. A value that is not a number or not within the limits does not
// count, nor one that is not whole where it must be: the field returns to the last one, and `refuse` is told why. Arrow keys change the value by a step. A field
// that is `live` also changes while the user types.
/** @param {any} options */
export function numberInput(label, value, options) {
  const {step, least = -Infinity, most = Infinity, ends = [least, most], live = false, whole = false, span, change, refuse} = options;
  const text = number => tidy(number, span);
  const input = make("input", {type: "text", inputmode: "decimal", class: "number", role: "spinbutton", autocomplete: "off", "aria-label": label});
  let actual = value, before = value; // the value that counts, and the one before the user began to type
  const wrong = number => number === null || whole && !Number.isInteger(number) ? `expected a ${whole ? "whole " : ""}number`
    : number < least || number > most ? `expected ${Number.isFinite(most) ? `${text(least)} to ${text(most)}` : `at least ${text(least)}`}` : null;
  input.show = number => {
    actual = number;
    if (isOperated(input)) return;
    before = number;
    input.value = text(number);
  };
  input.onchange = () => {
    const number = parseNumber(input.value), problem = wrong(number);
    if (problem) refuse(`${label}: ${problem}, got ${input.value.trim() || "nothing"}. It is still ${text(before)}.`);
    else before = number;
    input.value = text(before);
    if (actual !== before) change(actual = before);
  };
  if (live) {
    input.oninput = () => {
      const number = parseNumber(input.value);
      if (!wrong(number)) change(actual = number);
    };
  }
  input.onkeydown = event => {
    const direction = {ArrowUp: 1, ArrowDown: -1}[event.key], number = input.value === text(actual) ? actual : parseNumber(input.value);
    if (!direction || !step || number === null) return;
    event.preventDefault();
    actual = before = stepped(number, direction * step, ends);
    input.value = text(actual);
    change(actual);
  };
  input.show(value);
  return input;
}

// A value after a step within ends. From beyond an end, a step only leads back.
export function stepped(value, step, [first, last]) {
  const moved = clamp(clamp(value, first, last) + step, first, last);
  return (moved - value) * step > 0 ? moved : value;
}

// The number that a text says, or null. A comma is a decimal comma; groups of thousands are not understood.
export function parseNumber(text) {
  const plain = text.trim().replace("\u2212", "-").replace(",", ".");
  return /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(plain) && Number.isFinite(Number(plain)) ? Number(plain) : null;
}

export function checkbox(label, value, change) {
  const input = make("input", {type: "checkbox"});
  input.checked = value;
  input.onchange = () => change(input.checked);
  return make("label", {}, input, label);
}

export function select(label, options, value, change) {
  const input = make("select", {"aria-label": label}, ...Object.entries(options).map(([key, text]) => make("option", {value: key}, text)));
  input.value = value;
  input.onchange = () => change(input.value);
  return input;
}

// A number for display: whole, or at most six digits. One of a range has the digits that tell it from others there.
export function tidy(value, span = Math.abs(value)) {
  if (value == null) return "–";
  if (Number.isInteger(value)) return String(value);
  const more = Math.floor(Math.log10(Math.abs(value) / span));
  return String(Number(value.toPrecision(clamp(6 + (Number.isFinite(more) ? more : 0), 6, 15))));
}
