// The page's state and its socket; other parts of the page are notified of changes.

import {Stage} from "./stage.js";
import {Panel} from "./panel.js";
import {RawForm} from "./raw.js";
import {Slices} from "./slices.js";
import {inCell, openSocket} from "./socket.js";
import {Uploads} from "./uploads.js";
import {byId, make} from "./dom.js";

export class App {
  constructor() {
    /** @type {Viewer.ViewState | null} */
    this.state = null;         // the displayed state, as Python's ViewState
    /** @type {Map<string, Viewer.SourceAbout>} */
    this.sources = new Map();  // open volumes and meshes by key
    /** @type {Viewer.CameraState | null} */
    this.camera = null;        // of this window
    /** @type {(Viewer.Frame & {number: number}) | null} */
    this.frame = null;         // the description of the newest picture
    this.same = new Map();     // numbers of changes that did not change the picture of another number
    this.defaultLimits = {};
    /** @type {(number | null)[]} */
    this.results = [];         // of the measurements
    /** @type {Viewer.Measurement["tool"]} */
    this.tool = "point";       // that the next click measures with
    this.inputs = 0;           // changes sent
    this.stateInput = 0;       // the newest one of the state
    this.sentAt = new Map();   // the time when each change was sent, by its number
    this.latencies = [];       // milliseconds from a change to its picture
    this.framesShown = 0;
    this.selected = null;      // id of an object
    this.options = {color_maps: {}, color_rules: []};
    this.listeners = {};
    this.cameraWaits = false;
    this.query = location.search; // with the token
    this.refusals = 0;
    this.run = null;           // of the viewer that the page is connected to
    this.history = {undo: false, redo: false}; // whether there is something to undo and to redo
    this.before = null;        // what the page showed of a viewer that has ended
    this.slices = null;        // the part of the page
  }

  on(name, listener) { (this.listeners[name] ??= []).push(listener); }
  tell(name, detail) { for (const listener of this.listeners[name] ?? []) listener(detail); }

  connect() {
    this.socket = openSocket(this.query);
    this.socket.onopen = () => {
      this.retry = 300;
      // The cookie replaces the token in the address, except in a frame of a page of another site, which has no cookie.
      if (window.top === window) history.replaceState(null, "", location.pathname);
      this.closed?.remove();
      this.closed = null;
      this.refusals = 0;
      this.tell("connected");
    };
    this.socket.onmessage = event =>
      typeof event.data === "string" ? this.receive(JSON.parse(event.data)) : this.receiveBinary(event.data);
    this.socket.onclose = () => {
      this.tell("progress", {title: null});
      this.closed ??= this.note("The connection to the viewer is lost. This page continues when the viewer is back.");
      if (!this.closed.isConnected) byId("messages").append(this.closed);
      this.lookForAnother();
      setTimeout(() => this.connect(), this.retry = Math.min((this.retry ?? 300) * 1.5, 5000));
    };
  }

  // A viewer that answers and refuses the socket has another token.
  async lookForAnother() {
    if (this.closed.dataset.told || inCell) return;
    const refused = await fetch("alive").then(answer => answer.ok && this.socket.readyState !== WebSocket.OPEN, () => false);
    if (!refused || ++this.refusals < 3) return;
    this.closed.dataset.told = true;
    this.closed.textContent = "Another viewer is at this address, with another token. Open the address that it printed.";
  }

  /** @param {Viewer.FromPage} message */
  send(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  // Send a numbered change of the picture. The first picture that shows it has the same number.
  /** @param {Viewer.FromPage} message */
  change(message) {
    this.inputs += 1;
    if (message.type !== "camera" && message.type !== "size") this.stateInput = this.inputs;
    this.sentAt.set(this.inputs, performance.now());
    this.send({...message, input: this.inputs});
  }

  /** @param {Partial<Viewer.ViewState>} changes */
  changeState(changes) {
    this.state = {...this.state, ...changes};
    this.change({type: "change", changes});
    this.tell("state", {own: true});
  }

  /** @type {(id: number, changes: Partial<Viewer.ObjectState>) => void} */
  changeObject(id, changes) {
    const objects = this.state.objects.map(each => each.id === id ? {...each, ...changes} : each);
    this.state = {...this.state, objects};
    this.change({type: "change_object", id, changes});
    this.tell("state", {own: true});
  }

  // Cameras are sent at most once per screen refresh.
  /** @param {Viewer.CameraState} camera */
  moveCamera(camera) {
    this.camera = camera;
    if (this.cameraWaits) return;
    this.cameraWaits = true;
    requestAnimationFrame(() => {
      this.cameraWaits = false;
      this.change({type: "camera", camera: this.camera});
      this.tell("camera");
    });
  }

  // Whether world coordinates are a patient's.
  get patient() { return [...this.sources.values()].some(source => source.patient); }
  // The unit of lengths behind a space: that of the volumes of all objects; empty if it is not known of each.
  get unit() {
    const sources = this.state?.objects.map(each => this.sources.get(each.source)) ?? [];
    const units = new Set(sources.filter(source => source?.kind === "volume").map(source => source.unit)), [unit] = units;
    return units.size === 1 && unit ? ` ${unit}` : "";
  }

  // The name of a source, with a number if an earlier one has the same.
  nameOf(source) {
    const same = [...this.sources.values()].filter(each => each.name === source.name), place = same.findIndex(each => each.key === source.key);
    return place > 0 ? `${source.name} (${place + 1})` : source.name;
  }

  object(id) { return this.state?.objects.find(each => each.id === id); }

  /** @param {Viewer.ToPage} message */
  receive(message) {
    if (message.type === "state") {
      const limits = this.defaultLimits;
      this.defaultLimits = message.default_limits;
      // A state from before the page's newest change is older than the displayed one; the state with it follows.
      if (message.input < this.stateInput && this.state) return;
      this.history = message.history;
      this.tell("history");
      const before = JSON.stringify([this.state, limits]), earlier = this.state?.objects ?? [];
      this.state = message.state;
      this.results = message.results;
      if (JSON.stringify([this.state, this.defaultLimits]) === before) { // the page's own change
        this.before = null;
        return;
      }
      const added = earlier.length && this.state.objects.find(each => !earlier.some(({source}) => source === each.source)); // of a new file
      if (added || !this.object(this.selected)) this.selected = (added || this.state.objects[0])?.id ?? null;
      this.tell("state", {own: false});
      if (this.before) this.before.isOver = true;
      this.tellLost();
    } else if (message.type === "document") {
      this.sources = new Map(message.sources.map(each => [each.key, each]));
      this.tell("document");
      this.tellLost();
    } else if (message.type === "camera_moved") {
      this.camera = message.camera;
      this.tell("camera");
    } else if (message.type === "options") {
      this.options = message;
      if (this.run && this.run !== message.run && this.state) {
        this.before = {state: this.state, camera: this.camera, sources: [...this.sources.values()].map(({key, name}) => ({key, name}))};
      }
      if (this.run !== message.run) this.tell("other_viewer"); // its keys of sources may be those of the viewer before
      this.run = message.run;
    } else if (message.type === "same_picture") {
      this.same.set(message.before, message.input);
      this.matchFrame();
    } else if (message.type === "error") {
      this.note(message.text);
      this.tell("error");
    } else {
      this.tell(message.type, message);
    }
  }

  // The newest picture shows later changes as well if they did not change it. Pictures of earlier numbers may follow.
  matchFrame() {
    while (this.same.has(this.frame?.input)) this.frame.input = this.same.get(this.frame.input);
  }

  // After a restart of the viewer, say what is no longer open, and offer the earlier view.
  tellLost() {
    const {before} = this;
    if (!before?.isOver || !this.sources.size) return; // the viewer may still be reading its first file
    this.before = null;
    const lost = before.sources.map(each => each.name);
    for (const {name} of this.sources.values()) if (lost.includes(name)) lost.splice(lost.indexOf(name), 1);
    const note = this.note("The viewer was restarted. "
      + (lost.length ? `No longer open: ${lost.join(", ")}. ` : "") + "Levels, colours, cuts, slices and measurements of before are not shown. ", "note");
    if (lost.length < before.sources.length) {
      note.append(make("button", {id: "restore", onclick: () =>
        this.change({type: "restore", sources: before.sources, state: {...before.state, camera: before.camera}})}, "Show them again"));
    }
  }

  receiveBinary(buffer) {
    const size = new DataView(buffer).getUint32(0, true);
    const about = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, size)));
    const content = buffer.slice(4 + size);
    if (about.type === "file") {
      const url = URL.createObjectURL(new Blob([content]));
      make("a", {href: url, download: about.name}).click();
      setTimeout(() => URL.revokeObjectURL(url), 10000);
    } else {
      this.tell(about.type, {about, content});
    }
  }

  // A message that stays until it is closed.
  note(text, kind = "error") {
    const messages = byId("messages");
    const known = [...messages.children].find(each => each.firstChild.textContent === text);
    if (known) return known;
    const element = make("p", {class: kind === "note" ? "note" : null}, text);
    element.append(make("button", {class: "bare", "aria-label": "Close the message", onclick: () => element.remove()}, "×"));
    element.onclick = () => element.remove();
    messages.append(element);
    return element;
  }
}

const app = new App();
/** @type {any} */ (window).isospline = app; // for tests and the curious
const stage = new Stage(app);
app.slices = new Slices(app);
new Panel(app);
new RawForm(app);
const uploads = new Uploads(app);

app.on("connected", () => {
  app.inputs = 0;
  app.stateInput = 0;
  app.sentAt.clear();
  app.same.clear();
  if (app.frame) app.frame.input = -1; // of another connection
  app.send({type: "hello", ...stage.pixels()});
});
app.on("progress", ({title, fraction}) => {
  const element = byId("progress");
  element.hidden = title == null;
  element.querySelector("span").textContent = title ?? "";
  const bar = element.querySelector("progress");
  if (fraction > 0) bar.value = fraction;
  else bar.removeAttribute("value");
});

// The drawer of a narrow page.
const panel = byId("panel"), opener = byId("show-panel");
function showPanel(shown) {
  panel.classList.toggle("shown", shown);
  opener.setAttribute("aria-expanded", String(shown));
  app.tell("covered");
  (shown ? byId("hide-panel") : opener).focus();
}
// What the drawer or a maximised slice covers does not get the focus.
app.on("covered", () => {
  const isDrawn = panel.matches(".shown");
  for (const id of ["view", "views", "show-panel"]) byId(id).inert = isDrawn || !!app.slices.maximised;
  byId("slices").inert = isDrawn;
});
matchMedia("(max-width: 440px)").addEventListener("change", () => { if (panel.matches(".shown")) showPanel(false); });
opener.onclick = () => showPanel(true);
byId("hide-panel").onclick = () => showPanel(false);
addEventListener("pointerdown", event => { // beside the drawer: it closes, and nothing else happens
  if (!panel.matches(".shown") || /** @type {Element} */ (event.target).closest("#panel, #messages")) return;
  event.stopPropagation();
  event.preventDefault();
  showPanel(false);
}, {capture: true});
addEventListener("keydown", event => { if (event.key === "Escape" && panel.matches(".shown")) showPanel(false); });

// Undo and redo; in a field for text, these keys are the field's own.
for (const name of ["undo", "redo"]) {
  const button = byId(name);
  button.onclick = () => move(name);
  app.on("history", () => button.setAttribute("aria-disabled", String(!app.history[name]))); // and not disabled, which takes the focus away
}
addEventListener("keydown", event => {
  if (!(event.ctrlKey || event.metaKey) || event.altKey || document.querySelector("dialog[open]") || /** @type {Element} */ (event.target).matches("input.number, input[type=text]")) return;
  const key = event.key.toLowerCase(), name = key === "y" || key === "z" && event.shiftKey ? "redo" : key === "z" ? "undo" : null;
  if (!name) return;
  event.preventDefault();
  move(name);
});

function move(name) {
  if (!app.history[name]) return;
  app.change({type: name});
}

const drop = byId("drop");
addEventListener("dragover", event => { event.preventDefault(); drop.hidden = false; });
addEventListener("dragleave", event => { if (!event.relatedTarget) drop.hidden = true; });
addEventListener("drop", event => {
  event.preventDefault();
  drop.hidden = true;
  uploads.add(event.dataTransfer.files);
});
byId("open-files").onclick = () => byId("open").click();
byId("open").onchange = event => {
  uploads.add(event.target.files);
  event.target.value = "";
};
app.connect();
