// The connection to the viewer: a web socket, or the notebook that has the page in a cell.

/** Whether the page is in the cell of a notebook. Its kernel has no address that the browser knows. */
export const inCell = location.protocol === "about:";

// Has what the page uses of a WebSocket. The other end is widget.js: it sends true when the viewer listens, false when
// it has ended, and the number of bytes that have arrived.
class CellSocket {
  constructor() {
    /** @type {number} */
    this.readyState = WebSocket.CONNECTING;
    this.bufferedAmount = 0;
    /** @type {((event?: any) => void) | null} */
    this.onopen = null;
    /** @type {((event: any) => void) | null} */
    this.onmessage = null;
    /** @type {((event?: any) => void) | null} */
    this.onclose = null;
    const {port1, port2} = new MessageChannel();
    this.port = port1;
    port1.onmessage = ({data}) => this.receive(data);
    parent.postMessage("isospline", "*", [port2]);
  }

  receive(data) {
    if (typeof data === "boolean") {
      this.readyState = data ? WebSocket.OPEN : WebSocket.CLOSED;
      (data ? this.onopen : this.onclose)?.();
    } else if (typeof data === "number") {
      this.bufferedAmount -= data;
    } else {
      this.onmessage?.({data});
    }
  }

  /** @param {string | ArrayBuffer} data */
  send(data) {
    if (typeof data !== "string") this.bufferedAmount += data.byteLength;
    this.port.postMessage(data);
  }
}

/** Binary messages are array buffers. */
export function openSocket(query) {
  if (inCell) return new CellSocket();
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  const socket = new WebSocket(`${scheme}://${location.host}/socket${query}`);
  socket.binaryType = "arraybuffer";
  return socket;
}
