// The form for files of samples alone: their shape and type, which the viewer suggests.

import {checkbox, field, make, numberInput, select, tidy} from "./dom.js";

// Types of samples, and the bytes of one.
const TYPES = {u1: ["8 bits, 0 to 255", 1], i1: ["8 bits, signed", 1], u2: ["16 bits, from 0", 2], i2: ["16 bits, signed", 2],
  u4: ["32 bits, from 0", 4], i4: ["32 bits, signed", 4], u8: ["64 bits, from 0", 8], i8: ["64 bits, signed", 8],
  f4: ["32 bits, floating point", 4], f8: ["64 bits, floating point", 8]};
const LARGEST = 1 << 20; // samples along an axis

export class RawForm {
  /** @param {import("./main.js").App} app */
  constructor(app) {
    this.app = app;
    this.waiting = [];
    app.on("raw", question => { this.waiting.push(question); if (this.waiting.length === 1) this.show(question); });
    app.on("connected", () => { // questions of another connection
      for (const {name} of this.waiting) app.note(`The connection was lost before ${name} was opened. Open it again.`);
      this.waiting = [];
      this.dialog?.remove();
    });
  }

  show({number, name, size, shape, dtype}) {
    const values = {shape: shape ? [...shape].reverse() : [1, 1, 1], spacing: [1, 1, 1],
      type: dtype?.replace(/[<>]/, "") ?? "u1", big: dtype?.startsWith(">") ?? false, offset: 0};
    const whole = {step: 1, least: 1, most: LARGEST, live: true, whole: true, refuse: text => { problem.textContent = text; }};
    const problem = make("p", {class: "hint wrong", role: "alert"});
    const sizes = make("p", {class: "hint", role: "status"}), open = make("button", {type: "submit", class: "main"}, "Open");
    const bytes = () => values.shape.reduce((a, b) => a * b, TYPES[values.type][1]);
    const check = () => {
      const got = bytes(), fits = got + values.offset === size;
      sizes.textContent = `${values.shape.map(each => tidy(each)).join(" × ")} samples are ${got.toLocaleString("en")} bytes; the file has `
        + `${(size - values.offset).toLocaleString("en")}${values.offset ? " after its header" : ""}.`;
      sizes.classList.toggle("wrong", !fits);
      open.disabled = !fits;
    };
    const three = (label, key, options) => field(label, make("div", {class: "pair"}, ...["x", "y", "z"].map((axis, i) =>
      numberInput(`${label} along ${axis}`, values[key][i], {...options, change: value => { values[key][i] = value; check(); }}))));
    const names = Object.fromEntries(Object.entries(TYPES).map(([key, [text]]) => [key, text]));
    const form = make("form", {method: "dialog"},
      make("h2", {id: "raw-title"}, name),
      make("p", {class: "hint"}, "This file has samples alone. " + (shape ? "Its shape and type are suggested." : "What are their number and type?")),
      three("Samples", "shape", whole),
      field("Type", select("Type", names, values.type, type => { values.type = type; check(); })),
      make("div", {class: "row"}, checkbox("Most significant byte first", values.big, big => { values.big = big; })),
      field("Header", numberInput("Bytes before the samples", 0, {...whole, least: 0, most: size, change: value => { values.offset = value; check(); }})),
      three("Spacing", "spacing", {...whole, whole: false, least: 1e-12, most: 1e12, step: 0.1}),
      sizes, problem,
      make("div", {class: "row"}, open, make("button", {type: "button", onclick: () => dialog.close()}, "Cancel")));
    const dialog = this.dialog = make("dialog", {"aria-labelledby": "raw-title"}, form);
    let answer = null;
    form.oninput = () => { problem.textContent = ""; };
    form.onsubmit = () => {
      answer = {shape: [...values.shape].reverse(), dtype: `${values.big ? ">" : "<"}${values.type}`, offset: values.offset, spacing: values.spacing};
    };
    dialog.onclose = () => {
      this.app.send({type: "open_raw", number, options: answer});
      dialog.remove();
      this.waiting.shift();
      if (this.waiting.length) this.show(this.waiting[0]);
    };
    document.body.append(dialog);
    check();
    dialog.showModal();
  }
}
