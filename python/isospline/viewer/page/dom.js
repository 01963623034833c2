// Short functions that make elements.

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
  element.append(...children.filter(child => child != null));
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

export function numberInput(label, value, step, change) {
  const input = make("input", {type: "number", step: step || "any", "aria-label": label});
  input.value = tidy(value);
  input.onchange = () => { if (Number.isFinite(input.valueAsNumber)) change(input.valueAsNumber); };
  return input;
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

// A number for display: at most six digits.
export const tidy = value => value == null ? "–" : String(Number(value.toPrecision(6)));
