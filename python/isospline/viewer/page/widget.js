// The viewer in the cell of a notebook: an anywidget (https://anywidget.dev). The page is in a frame, and its messages
// go to the kernel and back through the notebook: there need be no other way from the browser to the kernel.

let count = 0;

/** The addresses of the page's modules, which import each other by bare names.
 * @param {Record<string, string>} modules */
function addressesOf(modules) {
  const urls = Object.entries(modules).map(([name, source]) =>
    [name, URL.createObjectURL(new Blob([source], {type: "text/javascript"}))]);
  return Object.fromEntries(urls);
}

/** @param {DataView} view */
const bytesOf = view => view.buffer.slice(view.byteOffset, view.byteOffset + view.byteLength);

function render({model, el}) {
  const window = `${Date.now().toString(36)}-${Math.random().toString(36).slice(2)}-${count++}`;
  const send = (kind, content = {}, buffers = []) => model.send({window, kind, ...content}, undefined, buffers);
  const still = document.createElement("img");
  still.src = model.get("still");
  still.alt = "isosurfaces";
  still.style.maxWidth = "100%";
  el.append(still); // where there is no kernel, it stays
  /** @type {HTMLIFrameElement | null} */
  let frame = null;
  /** @type {MessagePort | null} */
  let port = null;
  /** @type {Record<string, string>} */
  let imports = {};

  function fromKernel(content, buffers) {
    if (content.window !== window) return;
    if (content.kind === "page" && !frame) {
      frame = document.createElement("iframe");
      frame.title = "isospline";
      Object.assign(frame.style, {width: "100%", height: `${model.get("height")}px`, border: "0", display: "block"});
      frame.allow = "clipboard-write; fullscreen";
      imports = addressesOf(content.page.modules);
      frame.srcdoc = content.page.html.replace("IMPORTS", () => JSON.stringify({imports}));
      still.replaceWith(frame);
    } else if (content.kind === "open" || content.kind === "closed") {
      port?.postMessage(content.kind === "open");
    } else if (content.kind === "received") {
      port?.postMessage(content.bytes);
    } else if (content.kind === "text") {
      port?.postMessage(content.text);
    } else if (content.kind === "binary") {
      const bytes = bytesOf(buffers[0]);
      port?.postMessage(bytes, [bytes]);
    }
  }

  // Each connection of the page has a port of its own.
  function fromFrame(event) {
    if (event.source !== frame?.contentWindow || event.data !== "isospline") return;
    port?.close();
    [port] = event.ports;
    port.onmessage = ({data}) =>
      typeof data === "string" ? send("text", {text: data}) : send("binary", {}, [data]);
    send("open");
  }

  const close = () => send("close"); // also if the notebook is left or loaded again
  model.on("msg:custom", fromKernel);
  addEventListener("message", fromFrame);
  addEventListener("pagehide", close);
  send("page");
  return () => {
    model.off("msg:custom", fromKernel);
    removeEventListener("message", fromFrame);
    removeEventListener("pagehide", close);
    port?.close();
    Object.values(imports).forEach(url => URL.revokeObjectURL(url));
    close();
  };
}

export default {render};
